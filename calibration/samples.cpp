#include "calibration/samples.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "tools/csv_table.h"

namespace wasp::calibration {
namespace {

namespace fs = std::filesystem;
using tools::CsvTable;

/// Three columns that are known by their names.
struct KnownColumns {
  Sensor sensor;
  std::array<const char*, 3> names;
  const char* unit;
};
constexpr std::array kKnownColumns = {
    KnownColumns{Sensor::kAccel, {"accel_x_body_mps2", "accel_y_body_mps2", "accel_z_body_mps2"}, "m/s^2"},
    KnownColumns{Sensor::kAccel, {"a_RS_S_x [m s^-2]", "a_RS_S_y [m s^-2]", "a_RS_S_z [m s^-2]"}, "m/s^2"},
    KnownColumns{Sensor::kAccel, {"ax_mps2", "ay_mps2", "az_mps2"}, "m/s^2"},
    KnownColumns{Sensor::kAccel, {"accelerometer_m_s2[0]", "accelerometer_m_s2[1]", "accelerometer_m_s2[2]"}, "m/s^2"},
    KnownColumns{Sensor::kAccel, {"accel_x_g", "accel_y_g", "accel_z_g"}, "g"},
    KnownColumns{Sensor::kAccel, {"xacc", "yacc", "zacc"}, "mg"},  // RAW_IMU and SCALED_IMU as ArduPilot fills them
    KnownColumns{Sensor::kAccel, {"accel_x_counts", "accel_y_counts", "accel_z_counts"}, "counts"},
    KnownColumns{Sensor::kAccel, {"ax", "ay", "az"}, "counts"},
    KnownColumns{Sensor::kGyro, {"gyro_x_body_radps", "gyro_y_body_radps", "gyro_z_body_radps"}, "rad/s"},
    KnownColumns{Sensor::kGyro, {"w_RS_S_x [rad s^-1]", "w_RS_S_y [rad s^-1]", "w_RS_S_z [rad s^-1]"}, "rad/s"},
    KnownColumns{Sensor::kGyro, {"gx_radps", "gy_radps", "gz_radps"}, "rad/s"},
    KnownColumns{Sensor::kGyro, {"gyro_rad[0]", "gyro_rad[1]", "gyro_rad[2]"}, "rad/s"},
    KnownColumns{Sensor::kGyro, {"gyro_x_degps", "gyro_y_degps", "gyro_z_degps"}, "deg/s"},
    KnownColumns{Sensor::kGyro, {"xgyro", "ygyro", "zgyro"}, "mrad/s"},
    KnownColumns{Sensor::kGyro, {"gyro_x_counts", "gyro_y_counts", "gyro_z_counts"}, "counts"},
    KnownColumns{Sensor::kGyro, {"gx", "gy", "gz"}, "counts"},
    KnownColumns{Sensor::kMag, {"mag_x_body_gauss", "mag_y_body_gauss", "mag_z_body_gauss"}, "gauss"},
    KnownColumns{Sensor::kMag, {"mx_gauss", "my_gauss", "mz_gauss"}, "gauss"},
    KnownColumns{Sensor::kMag, {"magnetometer_ga[0]", "magnetometer_ga[1]", "magnetometer_ga[2]"}, "gauss"},
    KnownColumns{Sensor::kMag, {"mag_x_ut", "mag_y_ut", "mag_z_ut"}, "uT"},
    KnownColumns{Sensor::kMag, {"xmag", "ymag", "zmag"}, "mgauss"},
    KnownColumns{Sensor::kMag, {"mag_x_counts", "mag_y_counts", "mag_z_counts"}, "counts"},
    KnownColumns{Sensor::kMag, {"mx", "my", "mz"}, "counts"},
};

/// Names of times and what one unit of them is in seconds; then any name that ends so.
struct KnownTime {
  const char* name;
  double unit_s;
};
constexpr std::array kKnownTimes = {
    KnownTime{"exposed_at_ns", 1e-9},
    KnownTime{"#timestamp [ns]", 1e-9},
    KnownTime{"timestamp [ns]", 1e-9},
    KnownTime{"timestamp_us", 1e-6},
    KnownTime{"time_usec", 1e-6},
    KnownTime{"timestamp", 1e-6},
    KnownTime{"time_boot_ms", 1e-3},
    KnownTime{"t_s", 1.0},
    KnownTime{"time_s", 1.0},
    KnownTime{"t", 1.0},
    KnownTime{"time", 1.0},
    KnownTime{"timestamp_ns", 1e-9},
    KnownTime{"time_ns", 1e-9},
    KnownTime{"time_us", 1e-6},
    KnownTime{"time_ms", 1e-3},
};

const char* word(Sensor sensor) {
  return sensor == Sensor::kAccel ? "accelerometer" : sensor == Sensor::kGyro ? "gyroscope" : "magnetometer";
}

KnownColumns find_columns(const CsvTable& table, const std::string& file, Sensor sensor) {
  for (const KnownColumns& known : kKnownColumns) {
    const bool all = std::all_of(known.names.begin(), known.names.end(), [&](auto n) { return table.column(n); });
    if (known.sensor == sensor && all) return known;
  }
  throw std::runtime_error(
      fmt::format("{}: no {} columns that are known by name; give --columns X,Y,Z and --unit", file, word(sensor)));
}

/// Names as asked for on the command line.
KnownColumns named_columns(const CsvTable& table, const std::string& file, Sensor sensor, const SampleOptions& o) {
  for (const auto& name : o.columns)
    if (!table.column(name)) throw std::runtime_error(fmt::format("{}: no column '{}'", file, name));
  return {sensor, {o.columns[0].c_str(), o.columns[1].c_str(), o.columns[2].c_str()}, "counts"};
}

double unit_of_time(const std::string& name) {
  for (const KnownTime& known : kKnownTimes)
    if (name == known.name) return known.unit_s;
  for (const auto& [ending, unit_s] : {std::pair{"ns", 1e-9}, {"us", 1e-6}, {"ms", 1e-3}})
    if (name.ends_with(ending) || name.ends_with(std::string(ending) + "]")) return unit_s;
  return 1.0;
}

/// Seconds since the first row; empty without such a column.
std::vector<double> times_of(const CsvTable& table, const std::string& file, const SampleOptions& o) {
  std::string name = o.time_column;
  if (!name.empty() && !table.column(name)) throw std::runtime_error(fmt::format("{}: no column '{}'", file, name));
  for (const KnownTime& known : kKnownTimes)
    if (name.empty() && table.column(known.name)) name = known.name;
  if (name.empty()) return {};
  const std::vector<double> raw = table.numbers(name);
  const auto whole = table.integers(name);  // nanoseconds since 1970 need all their digits
  std::vector<double> seconds;
  for (std::size_t i = 0; i < raw.size(); ++i)
    seconds.push_back(unit_of_time(name) *
                      (whole[i] != 0 && whole[0] != 0 ? static_cast<double>(whole[i] - whole[0]) : raw[i] - raw[0]));
  return seconds;
}

std::vector<double> temperatures_of(const CsvTable& table) {
  for (const char* name : {"temperature_degc", "temperature", "temp_degc", "temp"})
    if (table.column(name)) return table.numbers(name);
  return {};
}

}  // namespace

void add_sample_options(CLI::App& app, SampleOptions& o, const std::vector<std::string>& units) {
  app.add_option("SOURCE", o.source, "CSV file, or a folder with log/imu.csv (a wasp flight), imu.csv or imu0/data.csv")
      ->required();
  app.add_option("--columns", o.columns, "names of the three columns x,y,z; default: known by name")
      ->delimiter(',')
      ->expected(3);
  app.add_option("--unit", o.unit, "unit of the columns; default: told by their names, else counts")
      ->check(CLI::IsMember(units));
  app.add_option("--time-column", o.time_column, "default: known by name");
  app.add_option("--rate-hz", o.rate_hz, "samples a second where no column tells the time")
      ->check(CLI::Range(0.1, 1e5));
}

fs::path imu_csv_in(const fs::path& source) {
  if (!fs::exists(source)) throw std::runtime_error(source.string() + ": no such file or folder");
  if (!fs::is_directory(source)) return source;
  for (const char* inside : {"log/imu.csv", "imu.csv", "imu0/data.csv", "mav0/imu0/data.csv", "data.csv"})
    if (fs::exists(source / inside)) return source / inside;
  throw std::runtime_error(source.string() + ": no log/imu.csv, imu.csv or imu0/data.csv in it; name a CSV file");
}

double Samples::rate_hz() const {
  if (time_s.size() < 2 || !(time_s.back() > time_s.front())) return 0;
  std::vector<double> steps;
  for (std::size_t i = 1; i < time_s.size(); ++i) steps.push_back(time_s[i] - time_s[i - 1]);
  std::nth_element(steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2), steps.end());
  const double middle = steps[steps.size() / 2];
  return middle > 0 ? 1 / middle : static_cast<double>(time_s.size() - 1) / (time_s.back() - time_s.front());
}

Samples read_samples(const SampleOptions& o, Sensor sensor) {
  const std::string file = imu_csv_in(o.source).string();
  const auto table = CsvTable::read(file);
  if (!table) throw std::runtime_error(file + ": cannot be read, or has no line of column names");
  const KnownColumns columns =
      o.columns.empty() ? find_columns(*table, file, sensor) : named_columns(*table, file, sensor, o);
  std::array<std::vector<double>, 3> raw;
  for (std::size_t axis = 0; axis < 3; ++axis) raw[axis] = table->numbers(columns.names[axis]);
  std::vector<double> time_s = times_of(*table, file, o), warmth = temperatures_of(*table);
  if (time_s.empty() && o.rate_hz > 0)
    for (std::size_t i = 0; i < table->rows(); ++i) time_s.push_back(static_cast<double>(i) / o.rate_hz);
  Samples s;
  s.unit = o.unit.empty() ? columns.unit : o.unit;
  s.source = fmt::format("{}: {} [{}]", file, fmt::join(columns.names, ", "), s.unit);
  s.dropped = table->bad_lines();
  for (std::size_t i = 0; i < table->rows(); ++i) {
    const Eigen::Vector3d value(raw[0][i], raw[1][i], raw[2][i]);
    const bool whole = value.allFinite() && (time_s.empty() || std::isfinite(time_s[i]));
    s.dropped += whole ? 0 : 1;
    if (!whole) continue;
    s.values.push_back(value);
    if (!time_s.empty()) s.time_s.push_back(time_s[i]);
    if (!warmth.empty()) s.temperature_degc.push_back(warmth[i]);
  }
  if (s.values.empty()) throw std::runtime_error(file + ": no whole row");
  const bool warmth_known =
      std::all_of(s.temperature_degc.begin(), s.temperature_degc.end(), [](double t) { return std::isfinite(t); });
  if (!warmth_known) s.temperature_degc.clear();
  return s;
}

std::optional<double> to_flight_unit(std::string_view unit) {
  constexpr double kG_mps2 = 9.80665;
  if (unit == "m/s^2" || unit == "rad/s" || unit == "gauss") return 1.0;
  if (unit == "g") return kG_mps2;
  if (unit == "mg") return kG_mps2 * 1e-3;
  if (unit == "deg/s") return std::numbers::pi / 180;
  if (unit == "mrad/s" || unit == "mgauss") return 1e-3;
  if (unit == "uT") return 1e-2;
  return std::nullopt;
}

}  // namespace wasp::calibration
