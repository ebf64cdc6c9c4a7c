#include "scheduling/parameter_table.h"

#include <stdexcept>
#include <string>

namespace wasp::scheduling {
namespace {

using namespace mavlink::mav_param_type;  // NOLINT: a table of them

class Table {
 public:
  explicit Table(drivers::ParameterServer& server) : server_(server) {}
  void real(const std::string& name, double value) { check(name, server_.add(name, kReal32, value)); }
  void whole(const std::string& name, double value) { check(name, server_.add(name, kInt32, value)); }
  void rate(const char* name, double value, double greatest) {
    check(name, server_.add_writable(name, kReal32, value, 0, greatest));
  }

 private:
  static void check(const std::string& name, bool added) {
    if (!added) throw std::logic_error("parameter " + name + " does not fit its table");
  }
  drivers::ParameterServer& server_;
};

double milliseconds(DurationNs ns) { return static_cast<double>(ns) / kMillisecond; }

void add_control(const Config& c, Table& t) {
  const auto& p = c.control;
  t.real("CTRL_RATE_HZ", static_cast<double>(kSecond) / static_cast<double>(c.control_period_ns));
  t.whole("CTRL_DEADLINE_US", static_cast<double>(c.control_deadline_ns) / kMicrosecond);
  t.whole("CTRL_ATT_AGE_MS", milliseconds(p.attitude_age_limit_ns));
  t.whole("CTRL_LINK_AGE_MS", milliseconds(p.link_age_limit_ns));
  t.whole("CTRL_HOLD_MS", milliseconds(p.ground_hold_limit_ns));
  t.whole("CTRL_FAILSAFE", p.failsafe_action == control::FailsafeAction::kDescend ? 0 : 1);
  t.real("CTRL_FS_THRUST", static_cast<double>(p.failsafe_thrust_share));
  t.real("CTRL_TILT_RAD", static_cast<double>(p.limits.max_tilt_rad));
  t.real("CTRL_H_MIN_M", static_cast<double>(p.min_height_m));
  t.real("CTRL_H_MAX_M", static_cast<double>(p.max_height_m));
  t.real("ALT_KP", static_cast<double>(p.altitude_hold.kp_npm));
  t.real("ALT_KI", static_cast<double>(p.altitude_hold.ki_npms));
  t.real("ALT_KD", static_cast<double>(p.altitude_hold.kd_nspm));
  t.real("ALT_CLIMB_MPS", static_cast<double>(p.altitude_hold.max_climb_mps));
  t.real("VEH_MASS_KG", static_cast<double>(p.altitude_hold.mass_kg));
  t.real("VEH_THRUST_N", static_cast<double>(p.altitude_hold.full_thrust_n));
}

void add_mission(const control::MissionParams& m, Table& t) {
  t.whole("MIS_LEGS", m.leg_count);
  for (int i = 0; i < m.leg_count; ++i) {
    const auto& leg = m.legs[static_cast<std::size_t>(i)];
    t.real("MIS_" + std::to_string(i) + "_H_M", static_cast<double>(leg.height_m));
    t.real("MIS_" + std::to_string(i) + "_S", static_cast<double>(leg.seconds));
  }
}

void add_behaviours(const Config& c, Table& t) {
  double enabled = 0;
  for (std::size_t i = 0; i < c.behaviours.size(); ++i)
    if (c.behaviours[i].enabled) enabled += static_cast<double>(1u << i);
  t.whole("BEH_COUNT", static_cast<double>(c.behaviours.size()));
  t.whole("BEH_ENABLED", enabled);  // a bit for each, in the order of behaviours.cpp
}

void add_camera(const Config& c, Table& t) {
  t.real("CAM_RATE_HZ", c.camera_rate_hz);
  t.whole("CAM_WIDTH", c.camera.intrinsics.width_px);
  t.whole("CAM_HEIGHT", c.camera.intrinsics.height_px);
  t.real("CAM_PITCH_DEG", c.camera_pitch_down_deg);
  t.whole("CAM_DOWN", c.camera_down.enabled ? 1 : 0);
}

}  // namespace

drivers::ParameterServer parameter_table(const Config& c) {
  drivers::ParameterServer server(encoding_for(c.telemetry, c.autopilot.flavour));
  Table t(server);
  t.whole("SYS_ID", c.autopilot.system_id);
  t.whole("COMP_ID", c.autopilot.component_id);
  add_control(c, t);
  add_mission(c.control.mission, t);
  add_behaviours(c, t);
  add_camera(c, t);
  t.rate(kObstacleRate, c.telemetry.obstacle_distance_hz, 50);
  t.rate(kFlowRate, c.telemetry.optical_flow_hz, 50);
  t.rate(kComputerRate, c.telemetry.computer_status_hz, 10);
  t.rate(kNamedRate, c.telemetry.named_values_hz, 50);
  return server;
}

}  // namespace wasp::scheduling
