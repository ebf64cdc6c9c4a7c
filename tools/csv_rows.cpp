#include "tools/csv_rows.h"

#include <fmt/format.h>

#include <array>
#include <concepts>

namespace wasp::tools {
namespace {

/// Appends fields to a line; floats as %.9g, which names every float uniquely.
class Line {
 public:
  Line& add(float v) { return put("{:.9g}", v); }
  Line& add(std::integral auto v) { return put("{}", static_cast<std::int64_t>(v)); }
  Line& add(std::string_view v) { return put("{}", v); }
  template <std::size_t N>
  Line& add(const std::array<float, N>& values) {
    for (const float v : values) add(v);
    return *this;
  }
  std::string finish(const RingStamp& stamp) {
    add(stamp.number).add(stamp.published_at_ns);
    return fmt::to_string(buffer_);
  }

 private:
  template <class T>
  Line& put(fmt::format_string<const T&> format, const T& v) {
    if (buffer_.size() != 0) buffer_.push_back(',');
    fmt::format_to(std::back_inserter(buffer_), format, v);
    return *this;
  }
  fmt::memory_buffer buffer_;
};

constexpr std::array<std::string_view, 5> kModes = {"disarmed", "hold", "behaviour", "manual", "failsafe"};
constexpr std::array<std::string_view, 16> kReasons = {
    "none",      "start",     "mission_step", "cue_lost",   "cue_back",       "attitude_lost",   "attitude_back",
    "link_lost", "link_back", "pilot",        "not_finite", "autopilot_left", "deadline_missed", "stop_requested",
    "landed",    "too_old"};
static_assert(static_cast<std::size_t>(ModeReason::kTooOld) + 1 == kReasons.size());
static_assert(static_cast<std::size_t>(FlightMode::kFailsafe) + 1 == kModes.size());

}  // namespace

std::string_view imu_columns() {
  return "exposed_at_ns,sequence,fields,"
         "accel_x_body_mps2,accel_y_body_mps2,accel_z_body_mps2,gyro_x_body_radps,gyro_y_body_radps,gyro_z_body_radps,"
         "mag_x_body_gauss,mag_y_body_gauss,mag_z_body_gauss,pressure_hpa,temperature_degc,number,published_at_ns";
}
std::string_view attitude_columns() {
  return "exposed_at_ns,sequence,q_w,q_x,q_y,q_z,rate_x_body_radps,rate_y_body_radps,rate_z_body_radps,"
         "number,published_at_ns";
}
std::string_view cue_columns() {
  return "exposed_at_ns,released_at_ns,started_at_ns,finished_at_ns,behaviour,behaviour_index,frame_sequence,step_"
         "index,"
         "over_budget,attitude_valid,q_w,q_x,q_y,q_z,rate_x_body_radps,rate_y_body_radps,rate_z_body_radps,"
         "validity,has_height,has_heading_rate,has_pitch,avoid,quality,height_m,height_sigma_m,heading_rate_radps,"
         "pitch_rad,has_velocity,has_climb,velocity_forward_mps,velocity_right_mps,velocity_sigma_mps,climb_mps,climb_"
         "1ps,"
         "accel_valid,accel_x_body_mps2,accel_y_body_mps2,accel_z_body_mps2,detail_0,detail_1,detail_2,detail_3,detail_"
         "4,detail_5,detail_6,detail_7,number,published_at_ns";
}
std::string_view command_columns() {
  return "exposed_at_ns,due_at_ns,released_at_ns,computed_at_ns,written_at_ns,tick,q_w,q_x,q_y,q_z,yaw_rate_radps,"
         "thrust,height_setpoint_m,height_m,climb_rate_mps,cue_source,mode,reason,sent,mission_phase,velocity_forward_"
         "mps,velocity_right_mps,avoid,velocity_held,mode_name,"
         "reason_name,number,published_at_ns";
}
std::string_view truth_columns() {
  return "exposed_at_ns,position_north_m,position_east_m,position_down_m,velocity_north_mps,velocity_east_mps,"
         "velocity_down_mps,q_w,q_x,q_y,q_z,rate_x_body_radps,rate_y_body_radps,rate_z_body_radps,height_m,armed,"
         "flight_time_s,"
         "number,published_at_ns";
}

std::string csv_row(const ImuSample& s, const RingStamp& stamp) {
  Line line;
  line.add(s.exposed_at_ns).add(s.sequence).add(s.fields).add(s.accel_body_mps2).add(s.gyro_body_radps);
  return line.add(s.mag_body_gauss).add(s.pressure_hpa).add(s.temperature_degc).finish(stamp);
}

std::string csv_row(const AttitudeSample& s, const RingStamp& stamp) {
  Line line;
  return line.add(s.exposed_at_ns).add(s.sequence).add(s.q_ned_body).add(s.rate_body_radps).finish(stamp);
}

std::string csv_row(const Cue& c, const RingStamp& stamp, std::string_view behaviour) {
  const CueBody& b = c.body;
  Line line;
  line.add(c.exposed_at_ns).add(c.released_at_ns).add(c.started_at_ns).add(c.finished_at_ns).add(behaviour);
  line.add(c.behaviour).add(c.frame_sequence).add(c.step_index).add(c.over_budget).add(c.attitude_valid);
  line.add(c.q_ned_body).add(c.rate_body_radps).add(static_cast<int>(b.validity)).add(b.has_height);
  line.add(b.has_heading_rate).add(b.has_pitch).add(b.avoid).add(b.quality).add(b.height_m).add(b.height_sigma_m);
  line.add(b.heading_rate_radps).add(b.pitch_rad).add(b.has_velocity).add(b.has_climb).add(b.velocity_forward_mps);
  line.add(b.velocity_right_mps).add(b.velocity_sigma_mps).add(b.climb_mps).add(b.climb_1ps).add(c.accel_valid);
  return line.add(c.accel_body_mps2).add(b.detail).finish(stamp);
}

std::string csv_row(const Command& c, const RingStamp& stamp) {
  Line line;
  line.add(c.exposed_at_ns).add(c.due_at_ns).add(c.released_at_ns).add(c.computed_at_ns).add(c.written_at_ns);
  line.add(c.tick).add(c.q_ned_body).add(c.yaw_rate_radps).add(c.thrust).add(c.height_setpoint_m).add(c.height_m);
  line.add(c.climb_rate_mps).add(c.cue_source).add(static_cast<int>(c.mode)).add(static_cast<int>(c.reason));
  line.add(c.sent).add(c.mission_phase).add(c.velocity_forward_mps).add(c.velocity_right_mps).add(c.avoid);
  line.add(c.velocity_held).add(mode_name(c.mode)).add(reason_name(c.reason));
  return line.finish(stamp);
}

std::string csv_row(const Truth& t, const RingStamp& stamp) {
  Line line;
  line.add(t.exposed_at_ns).add(t.position_ned_m).add(t.velocity_ned_mps).add(t.q_ned_body).add(t.rate_body_radps);
  return line.add(t.height_m).add(t.armed).add(t.flight_time_s).finish(stamp);
}

std::string_view mode_name(FlightMode mode) {
  const auto i = static_cast<std::size_t>(mode);
  return i < kModes.size() ? kModes[i] : "unknown";
}

std::string_view reason_name(ModeReason reason) {
  const auto i = static_cast<std::size_t>(reason);
  return i < kReasons.size() ? kReasons[i] : "unknown";
}

}  // namespace wasp::tools
