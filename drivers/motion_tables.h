// The tables of motion that recordings carry, one reader a format. Rows that make no sense, and rows whose time does not
// rise, are problems and left out. A file that is not there is no problem: the stream stays empty.
#pragma once

#include <filesystem>

#include "drivers/recording_motion.h"
#include "drivers/recording_problems.h"

namespace wasp::drivers {

enum class TimeUnit { kSeconds, kNanoseconds };

/// Where the numbers of a row stand, from 0; negative: the table has none.
struct InertialColumns {
  TimeUnit unit = TimeUnit::kNanoseconds;
  int gyro = 1, accel = 4;
};
void read_inertial(const std::filesystem::path& file, const InertialColumns& columns, InertialStream& out,
                   RecordingProblems& problems);

enum class QuaternionOrder { kWxyz, kXyzw };
struct PoseColumns {
  TimeUnit unit = TimeUnit::kNanoseconds;
  int position = 1, quaternion = 4;
  QuaternionOrder order = QuaternionOrder::kWxyz;
};
void read_poses(const std::filesystem::path& file, const PoseColumns& columns, PoseStream& out,
                RecordingProblems& problems);

/// Seconds, x, y, heading about the world's z: a vehicle on a floor (Rawseeds).
void read_planar_poses(const std::filesystem::path& file, PoseStream& out, RecordingProblems& problems);

/// Leaves out the rows of `samples` (times by `lines[i]`) that do not rise; says which.
template <class Sample>
void drop_unordered(const std::filesystem::path& file, const std::vector<int>& lines, std::vector<Sample>& samples,
                    RecordingProblems& problems);

}  // namespace wasp::drivers
