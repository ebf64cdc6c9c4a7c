// Samples of a sensor out of what people have: CSV with names that tell sensor and unit (wasp's own log/imu.csv, EuRoC
// ASL, PX4, MAVLink tables), or any three columns named on the command line.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace CLI {
class App;
}

namespace wasp::calibration {

enum class Sensor { kAccel, kGyro, kMag };

/// How a source is to be read.
struct SampleOptions {
  std::string source;                ///< CSV file, or a folder with log/imu.csv, imu.csv or imu0/data.csv
  std::vector<std::string> columns;  ///< three names; empty: found by their names
  std::string unit;                  ///< of those columns; empty: told by the names
  std::string time_column;           ///< empty: found by its name
  double rate_hz = 0;                ///< without a time column; 0: unknown
};

/// Declares them on a subcommand; `units` are those that `unit` may name.
void add_sample_options(CLI::App& app, SampleOptions& options, const std::vector<std::string>& units);

/// Rows that are whole and finite, in the order of the file.
struct Samples {
  std::vector<Eigen::Vector3d> values;
  std::vector<double> time_s;            ///< since the first row; empty where nothing tells it
  std::vector<double> temperature_degc;  ///< empty where there is no such column
  std::string unit;                      ///< m/s^2, g, mg, rad/s, deg/s, mrad/s, gauss, mgauss, uT or counts
  std::string source;                    ///< file and columns, for the evidence
  std::size_t dropped = 0;               ///< rows that were not whole or not finite

  [[nodiscard]] std::size_t size() const { return values.size(); }
  /// Samples a second; 0: unknown.
  [[nodiscard]] double rate_hz() const;
};

/// The table of inertial samples in a recording's folder; a file is itself. Throws std::runtime_error.
std::filesystem::path imu_csv_in(const std::filesystem::path& source);

/// Throws std::runtime_error naming the file and what it lacks.
Samples read_samples(const SampleOptions& options, Sensor sensor);

/// Factor from `unit` to the unit of ImuSample (m/s^2, rad/s, gauss); nullopt for counts.
std::optional<double> to_flight_unit(std::string_view unit);

}  // namespace wasp::calibration
