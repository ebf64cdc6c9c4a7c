#include "missions/flight_trace.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <stdexcept>

#include "control/mission.h"
#include "missions/world_probe.h"
#include "sim/lockstep.h"
#include "tools/csv_rows.h"
#include "tools/csv_table.h"
#include "types/frames.h"

namespace wasp::missions {
namespace {

namespace fs = std::filesystem;
using tools::CsvTable;

/// Columns of a table, read once; absent ones give 0.
class Columns {
 public:
  explicit Columns(const fs::path& file) : table_(CsvTable::read(file)) {
    if (!table_) throw std::runtime_error("cannot read " + file.string());
  }
  [[nodiscard]] std::size_t rows() const { return table_->rows(); }
  [[nodiscard]] std::vector<std::string> texts(const char* name) const { return table_->texts(name); }

  template <class Row, class Field>
  void integer(const char* name, std::vector<Row>& rows, Field&& field) const {
    const auto values = table_->integers(name);
    for (std::size_t i = 0; i < rows.size() && i < values.size(); ++i) {
      auto& f = field(rows[i]);
      f = static_cast<std::remove_reference_t<decltype(f)>>(values[i]);
    }
  }
  template <class Row, class Field>
  void number(const std::string& name, std::vector<Row>& rows, Field&& field) const {
    if (!table_->column(name)) return;
    const auto values = table_->numbers(name);
    for (std::size_t i = 0; i < rows.size() && i < values.size(); ++i) field(rows[i]) = static_cast<float>(values[i]);
  }
  /// Columns prefix + suffix[k] into an array field.
  template <class Row, class Field, std::size_t N>
  void array(const std::string& prefix, const std::array<const char*, N>& suffixes, std::vector<Row>& rows,
             Field&& field) const {
    for (std::size_t k = 0; k < N; ++k)
      number(prefix + suffixes[k], rows, [&field, k](Row& row) -> float& { return field(row)[k]; });
  }

 private:
  std::optional<CsvTable> table_;
};

constexpr std::array kQ{"w", "x", "y", "z"};
constexpr std::array kXyzRate{"x_body_radps", "y_body_radps", "z_body_radps"};

std::vector<Truth> read_truth(const fs::path& file) {
  const Columns c(file);
  std::vector<Truth> rows(c.rows());
  c.integer("exposed_at_ns", rows, [](Truth& t) -> TimeNs& { return t.exposed_at_ns; });
  c.array(
      "position_", std::array{"north_m", "east_m", "down_m"}, rows,
      [](Truth & t) -> auto& { return t.position_ned_m; });
  c.array(
      "velocity_", std::array{"north_mps", "east_mps", "down_mps"}, rows,
      [](Truth & t) -> auto& { return t.velocity_ned_mps; });
  c.array(
      "q_", kQ, rows, [](Truth & t) -> auto& { return t.q_ned_body; });
  c.array(
      "rate_", kXyzRate, rows, [](Truth & t) -> auto& { return t.rate_body_radps; });
  c.number("height_m", rows, [](Truth& t) -> float& { return t.height_m; });
  c.number("armed", rows, [](Truth& t) -> float& { return t.armed; });
  c.number("flight_time_s", rows, [](Truth& t) -> float& { return t.flight_time_s; });
  return rows;
}

std::vector<Command> read_commands(const fs::path& file) {
  const Columns c(file);
  std::vector<Command> rows(c.rows());
  c.integer("exposed_at_ns", rows, [](Command& x) -> TimeNs& { return x.exposed_at_ns; });
  c.integer("due_at_ns", rows, [](Command& x) -> TimeNs& { return x.due_at_ns; });
  c.integer("written_at_ns", rows, [](Command& x) -> TimeNs& { return x.written_at_ns; });
  c.array(
      "q_", kQ, rows, [](Command & x) -> auto& { return x.q_ned_body; });
  c.number("yaw_rate_radps", rows, [](Command& x) -> float& { return x.yaw_rate_radps; });
  c.number("thrust", rows, [](Command& x) -> float& { return x.thrust; });
  c.number("height_setpoint_m", rows, [](Command& x) -> float& { return x.height_setpoint_m; });
  c.number("height_m", rows, [](Command& x) -> float& { return x.height_m; });
  c.number("velocity_forward_mps", rows, [](Command& x) -> float& { return x.velocity_forward_mps; });
  c.number("velocity_right_mps", rows, [](Command& x) -> float& { return x.velocity_right_mps; });
  c.integer("cue_source", rows, [](Command& x) -> std::int32_t& { return x.cue_source; });
  c.integer("mode", rows, [](Command& x) -> FlightMode& { return x.mode; });
  c.integer("sent", rows, [](Command& x) -> std::uint8_t& { return x.sent; });
  c.integer("avoid", rows, [](Command& x) -> std::uint8_t& { return x.avoid; });
  c.integer("mission_phase", rows, [](Command& x) -> std::uint8_t& { return x.mission_phase; });
  return rows;
}

std::map<std::string, std::vector<Cue>> read_cues(const fs::path& file) {
  const Columns c(file);
  std::vector<Cue> rows(c.rows());
  c.integer("exposed_at_ns", rows, [](Cue& x) -> TimeNs& { return x.exposed_at_ns; });
  c.integer("started_at_ns", rows, [](Cue& x) -> TimeNs& { return x.started_at_ns; });
  c.integer("finished_at_ns", rows, [](Cue& x) -> TimeNs& { return x.finished_at_ns; });
  c.integer("frame_sequence", rows, [](Cue& x) -> std::uint32_t& { return x.frame_sequence; });
  c.integer("over_budget", rows, [](Cue& x) -> std::uint32_t& { return x.over_budget; });
  c.array(
      "q_", kQ, rows, [](Cue & x) -> auto& { return x.q_ned_body; });
  c.array(
      "rate_", kXyzRate, rows, [](Cue & x) -> auto& { return x.rate_body_radps; });
  c.integer("validity", rows, [](Cue& x) -> Validity& { return x.body.validity; });
  c.integer("has_height", rows, [](Cue& x) -> std::uint8_t& { return x.body.has_height; });
  c.integer("has_heading_rate", rows, [](Cue& x) -> std::uint8_t& { return x.body.has_heading_rate; });
  c.integer("has_pitch", rows, [](Cue& x) -> std::uint8_t& { return x.body.has_pitch; });
  c.integer("has_velocity", rows, [](Cue& x) -> std::uint8_t& { return x.body.has_velocity; });
  c.integer("has_climb", rows, [](Cue& x) -> std::uint8_t& { return x.body.has_climb; });
  c.integer("avoid", rows, [](Cue& x) -> std::uint8_t& { return x.body.avoid; });
  c.number("quality", rows, [](Cue& x) -> float& { return x.body.quality; });
  c.number("height_m", rows, [](Cue& x) -> float& { return x.body.height_m; });
  c.number("height_sigma_m", rows, [](Cue& x) -> float& { return x.body.height_sigma_m; });
  c.number("heading_rate_radps", rows, [](Cue& x) -> float& { return x.body.heading_rate_radps; });
  c.number("pitch_rad", rows, [](Cue& x) -> float& { return x.body.pitch_rad; });
  c.number("velocity_forward_mps", rows, [](Cue& x) -> float& { return x.body.velocity_forward_mps; });
  c.number("velocity_right_mps", rows, [](Cue& x) -> float& { return x.body.velocity_right_mps; });
  c.number("climb_mps", rows, [](Cue& x) -> float& { return x.body.climb_mps; });
  c.number("climb_1ps", rows, [](Cue& x) -> float& { return x.body.climb_1ps; });
  c.array(
      "detail_", std::array{"0", "1", "2", "3", "4", "5", "6", "7"}, rows,
      [](Cue & x) -> auto& { return x.body.detail; });
  std::map<std::string, std::vector<Cue>> by_name;
  const auto names = c.texts("behaviour");
  for (std::size_t i = 0; i < rows.size(); ++i) by_name[names[i]].push_back(rows[i]);
  return by_name;
}

std::vector<ImuSample> read_imu(const fs::path& file) {
  const Columns c(file);
  std::vector<ImuSample> rows(c.rows());
  c.integer("exposed_at_ns", rows, [](ImuSample& x) -> TimeNs& { return x.exposed_at_ns; });
  c.array(
      "accel_", std::array{"x_body_mps2", "y_body_mps2", "z_body_mps2"}, rows,
      [](ImuSample & x) -> auto& { return x.accel_body_mps2; });
  c.array(
      "gyro_", kXyzRate, rows, [](ImuSample & x) -> auto& { return x.gyro_body_radps; });
  return rows;
}

void finish(FlightTrace& trace) {
  for (auto& [name, cues] : trace.cues)
    std::stable_sort(cues.begin(), cues.end(),
                     [](const Cue& a, const Cue& b) { return a.exposed_at_ns < b.exposed_at_ns; });
  if (trace.truth.empty()) throw std::runtime_error("the flight has no truth");
  for (const Truth& t : trace.truth)
    if (trace.lift_off_ns == kNever && t.flight_time_s > 0)
      trace.lift_off_ns = t.exposed_at_ns - from_seconds(static_cast<double>(t.flight_time_s));
}

}  // namespace

double FlightTrace::seconds(TimeNs at_ns) const {
  const TimeNs zero_ns = lift_off_ns != kNever ? lift_off_ns : truth.empty() ? at_ns : truth.front().exposed_at_ns;
  return to_seconds(at_ns - zero_ns);
}

const std::vector<Cue>& FlightTrace::of(const std::string& behaviour) const {
  static const std::vector<Cue> kNone;
  const auto it = cues.find(behaviour);
  return it == cues.end() ? kNone : it->second;
}

const Truth& FlightTrace::truth_at(TimeNs at_ns) const {
  const auto after = std::upper_bound(truth.begin(), truth.end(), at_ns,
                                      [](TimeNs t, const Truth& row) { return t < row.exposed_at_ns; });
  return after == truth.begin() ? *after : *std::prev(after);
}

FlightTrace trace_of(sim::LockstepLog log, const std::vector<std::string>& names) {
  FlightTrace trace;
  for (const auto& s : log.samples) trace.truth.push_back(s.truth), trace.commands.push_back(s.command);
  for (const Cue& c : log.cues) trace.cues[names.at(c.behaviour)].push_back(c);
  trace.imu = std::move(log.imu);
  finish(trace);
  return trace;
}

FlightTrace read_trace(const fs::path& folder) {
  FlightTrace trace;
  trace.truth = read_truth(folder / "truth.csv");
  trace.commands = read_commands(folder / "commands.csv");
  trace.cues = read_cues(folder / "cues.csv");
  trace.imu = read_imu(folder / "imu.csv");
  finish(trace);
  return trace;
}

TruthEuler euler_of(const Truth& t) {
  const Euler e = euler_from_quat(Quat(t.q_ned_body[0], t.q_ned_body[1], t.q_ned_body[2], t.q_ned_body[3]));
  return {static_cast<double>(e.roll_rad), static_cast<double>(e.pitch_rad), static_cast<double>(e.yaw_rad)};
}

void write_trace_csv(const FlightTrace& trace, const WorldProbe& probe, const fs::path& file) {
  std::ofstream out(file);
  out << "t_s,north_m,east_m,height_m,roll_rad,pitch_rad,yaw_rad,forward_mps,setpoint_m,estimate_m,velocity_forward_"
         "mps,"
         "velocity_right_mps,yaw_rate_radps,avoid,mode,phase,world_north_m,world_east_m\n";
  for (const Command& c : trace.commands) {
    const Truth& t = trace.truth_at(c.due_at_ns);
    const TruthEuler e = euler_of(t);
    const Vec3 at = probe.in_world(t);
    const double forward = static_cast<double>(t.velocity_ned_mps[0]) * std::cos(e.yaw_rad) +
                           static_cast<double>(t.velocity_ned_mps[1]) * std::sin(e.yaw_rad);
    out << fmt::format(
        "{:.3f},{:.4f},{:.4f},{:.4f},{:.5f},{:.5f},{:.5f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{},{},{},{:.4f},{:."
        "4f}\n",
        trace.seconds(c.due_at_ns), t.position_ned_m[0], t.position_ned_m[1], t.height_m, e.roll_rad, e.pitch_rad,
        e.yaw_rad, forward, c.height_setpoint_m, c.height_m, c.velocity_forward_mps, c.velocity_right_mps,
        c.yaw_rate_radps, c.avoid, static_cast<int>(c.mode), c.mission_phase, at.x(), at.y());
  }
  if (!out.flush()) throw std::runtime_error("cannot write " + file.string());
}

void write_cues_csv(const FlightTrace& trace, const fs::path& file) {
  std::ofstream out(file);
  out << tools::cue_columns() << '\n';
  for (const auto& [name, cues] : trace.cues)
    for (const Cue& c : cues) out << tools::csv_row(c, {}, name) << '\n';
  if (!out.flush()) throw std::runtime_error("cannot write " + file.string());
}

std::vector<LegSpan> legs_of(const FlightTrace& trace) {
  std::vector<LegSpan> spans;
  for (std::size_t i = 0; i < trace.commands.size(); ++i) {
    const int leg = control::leg_of(static_cast<control::MissionPhase>(trace.commands[i].mission_phase));
    if (leg < 0) continue;
    if (spans.empty() || spans.back().leg != leg || spans.back().last + 1 != i) spans.push_back({leg, i, i});
    spans.back().last = i;
  }
  return spans;
}

}  // namespace wasp::missions
