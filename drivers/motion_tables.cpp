#include "drivers/motion_tables.h"

#include <algorithm>
#include <map>

#include "drivers/rising_times.h"
#include "drivers/text_rows.h"

namespace wasp::drivers {
namespace {

bool parse_time(const TextRow& row, TimeUnit unit, TimeNs& out) {
  return unit == TimeUnit::kSeconds ? parse_seconds(row.fields[0], out) : parse_nanoseconds(row.fields[0], out);
}

/// A heading without '#': the first row, none of whose fields begins like a number.
bool is_heading(const TextRow& row) {
  if (row.line > 1) return false;
  const std::string_view first = row.fields[0];
  return first.empty() || std::string_view("0123456789+-.").find(first[0]) == std::string_view::npos;
}

/// Three numbers from a column on; true where the table has none.
bool parse_vector(const TextRow& row, int column, Eigen::Vector3d& out) {
  return column < 0 || parse_numbers(row, static_cast<std::size_t>(column), {out.data(), 3});
}

/// What most rows have.
std::size_t usual(const std::vector<std::size_t>& field_counts) {
  std::map<std::size_t, std::size_t> rows;
  for (const std::size_t n : field_counts) ++rows[n];
  const auto most = std::max_element(rows.begin(), rows.end(), [](auto& a, auto& b) { return a.second < b.second; });
  return most == rows.end() ? 0 : most->first;
}

/// Leaves out rows with more or fewer fields than most have: two lines run together, or one cut in a number.
template <class Sample>
void drop_irregular(const std::filesystem::path& file, const std::vector<std::size_t>& field_counts,
                    std::vector<int>& lines, std::vector<Sample>& samples, RecordingProblems& problems) {
  const std::size_t expected = usual(field_counts);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (field_counts[i] == expected)
      samples[kept] = samples[i], lines[kept++] = lines[i];
    else
      problems.add_line(ProblemKind::kUnreadable, file, lines[i],
                        std::to_string(field_counts[i]) + " fields, most rows have " + std::to_string(expected));
  }
  samples.resize(kept);
  lines.resize(kept);
}

/// Reads every row by `parse` (false: unreadable) and keeps those whose times rise.
template <class Sample, class Parse>
void read_table(const std::filesystem::path& file, const Parse& parse, const std::string& expected,
                std::vector<Sample>& out, RecordingProblems& problems) {
  if (!std::filesystem::exists(file)) return;
  std::vector<int> lines;
  std::vector<std::size_t> field_counts;
  try {
    visit_rows(file, [&](const TextRow& row) {
      Sample sample;
      if (is_heading(row)) return;
      if (!parse(row, sample)) return problems.add_line(ProblemKind::kUnreadable, file, row.line, expected);
      out.push_back(sample);
      lines.push_back(row.line);
      field_counts.push_back(row.fields.size());
    });
  } catch (const std::runtime_error& error) {
    problems.add(ProblemKind::kDamaged, file, error.what());
  }
  drop_irregular(file, field_counts, lines, out, problems);
  drop_unordered(file, lines, out, problems);
}

/// A unit quaternion, or false: norms of tables with few digits are within a per cent.
bool normalise(Eigen::Quaterniond& q) {
  const double norm = q.norm();
  if (!(norm > 0.98 && norm < 1.02)) return false;
  q.normalize();
  return true;
}

}  // namespace

template <class Sample>
void drop_unordered(const std::filesystem::path& file, const std::vector<int>& lines, std::vector<Sample>& samples,
                    RecordingProblems& problems) {
  std::vector<TimeNs> times;
  for (const Sample& sample : samples) times.push_back(sample.time_ns);
  const std::vector<TimeFate> fates = keep_rising(times);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (fates[i] == TimeFate::kKept)
      samples[kept++] = samples[i];
    else if (fates[i] == TimeFate::kDuplicate)
      problems.add_line(ProblemKind::kDuplicate, file, lines[i], "its time was there before");
    else
      problems.add_line(ProblemKind::kUnordered, file, lines[i], "its time is not between those of its neighbours");
  }
  samples.resize(kept);
}
template void drop_unordered(const std::filesystem::path&, const std::vector<int>&, std::vector<InertialSample>&,
                             RecordingProblems&);
template void drop_unordered(const std::filesystem::path&, const std::vector<int>&, std::vector<PoseSample>&,
                             RecordingProblems&);

void read_inertial(const std::filesystem::path& file, const InertialColumns& columns, InertialStream& out,
                   RecordingProblems& problems) {
  const auto parse = [&](const TextRow& row, InertialSample& sample) {
    return parse_time(row, columns.unit, sample.time_ns) && parse_vector(row, columns.gyro, sample.gyro_radps) &&
           parse_vector(row, columns.accel, sample.accel_mps2);
  };
  read_table(file, parse, "expected a time and six numbers (three without a gyro)", out.samples, problems);
  if (out.samples.empty()) return;
  out.source = file.string();
  out.has_gyro = columns.gyro >= 0;
  out.has_accel = columns.accel >= 0;
}

void read_poses(const std::filesystem::path& file, const PoseColumns& columns, PoseStream& out,
                RecordingProblems& problems) {
  const auto parse = [&](const TextRow& row, PoseSample& sample) {
    std::array<double, 4> q{};
    if (!parse_time(row, columns.unit, sample.time_ns) || !parse_vector(row, columns.position, sample.position_m) ||
        !parse_numbers(row, static_cast<std::size_t>(columns.quaternion), q))
      return false;
    sample.q_world_sensor = columns.order == QuaternionOrder::kWxyz ? Eigen::Quaterniond(q[0], q[1], q[2], q[3])
                                                                    : Eigen::Quaterniond(q[3], q[0], q[1], q[2]);
    return normalise(sample.q_world_sensor);
  };
  read_table(file, parse, "expected a time, a position and a unit quaternion", out.samples, problems);
  if (!out.samples.empty()) out.source = file.string();
}

void read_planar_poses(const std::filesystem::path& file, PoseStream& out, RecordingProblems& problems) {
  const auto parse = [&](const TextRow& row, PoseSample& sample) {
    Eigen::Vector3d planar;
    if (!parse_time(row, TimeUnit::kSeconds, sample.time_ns) || !parse_numbers(row, 1, {planar.data(), 3}))
      return false;
    sample.position_m = {planar.x(), planar.y(), 0};
    sample.q_world_sensor = Eigen::AngleAxisd(planar.z(), Eigen::Vector3d::UnitZ());
    return true;
  };
  read_table(file, parse, "expected seconds, x, y, heading", out.samples, problems);
  if (!out.samples.empty()) out.source = file.string();
}

}  // namespace wasp::drivers
