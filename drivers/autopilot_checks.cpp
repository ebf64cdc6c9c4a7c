#include "drivers/autopilot_checks.h"

#include <cmath>

#include "types/units.h"

namespace wasp::drivers {
namespace {

// ---- PX4 (src/modules/commander, mavlink_receiver.cpp; names of releases from 2016 on, so some are absent)

enum Px4Parameter : std::size_t {
  kThrHover,
  kLossTime,
  kLossAct,
  kLossActNoRadio,
  kForward,
  kRadioMode,
  kRadioExcept,
  kGcsAct
};
constexpr std::array<std::string_view, 8> kPx4Names{"MPC_THR_HOVER", "COM_OF_LOSS_T",  "COM_OBL_RC_ACT", "COM_OBL_ACT",
                                                    "MAV_FWDEXTSP",  "COM_RC_IN_MODE", "COM_RCL_EXCEPT", "NAV_DLL_ACT"};

constexpr std::array<std::string_view, 8> kLossActs{"position mode, without a radio return",
                                                    "altitude mode, without a radio return",
                                                    "manual mode, without a radio return",
                                                    "return",
                                                    "it lands",
                                                    "hold",
                                                    "it terminates",
                                                    "it disarms"};
constexpr std::array<std::string_view, 5> kLossActsNoRadio{"it lands", "hold", "return", "it terminates", "lockdown"};

constexpr unsigned kExceptOffboard = 4;  ///< bit of COM_RCL_EXCEPT

template <std::size_t N>
std::string_view choice(const std::array<std::string_view, N>& names, double value) noexcept {
  return value >= 0 && value < static_cast<double>(N) ? names[static_cast<std::size_t>(value)] : "not known to wasp";
}

// ---- ArduCopter (ArduCopter/GCS_MAVLink_Copter.cpp, mode_guided.cpp, Parameters.cpp; newer names behind older)

enum CopterParameter : std::size_t {
  kGuidOptions,
  kDevOptions,
  kGuidTimeout,
  kSpeedUp_cmps,
  kSpeedDown_cmps,
  kSpeedUp_mps,
  kSpeedDown_mps,
  kFrameClass,
  kArmingCheck,
  kEnforceId,
  kGcsId,
  kAngleMax_cdeg,
  kDisarmDelay
};
constexpr std::array<std::string_view, 13> kCopterNames{
    "GUID_OPTIONS", "DEV_OPTIONS",  "GUID_TIMEOUT",  "WPNAV_SPEED_UP", "WPNAV_SPEED_DN", "WP_SPD_UP",   "WP_SPD_DN",
    "FRAME_CLASS",  "ARMING_CHECK", "SYSID_ENFORCE", "SYSID_MYGCS",    "ANGLE_MAX",      "DISARM_DELAY"};

constexpr double kOptionsEnd = 4096;       ///< beyond: no bits of GUID_OPTIONS but a default that was never set
constexpr double kOldGuidTimeout_s = 1.0;  ///< of releases without GUID_TIMEOUT; with it 3 s by default
constexpr double kLongestTimeout_s = 5.0;  ///< of a setpoint stream that ended, until somebody notices
constexpr std::uint32_t kVersion4_1Release = 0x040100'40;  ///< dev versions of 4.1 end in 00

const Reading& at(const Readings& readings, std::size_t i) noexcept { return readings[i]; }
bool known(const Readings& readings, std::size_t i) noexcept { return readings[i].state == ReadingState::kKnown; }

/// "NAME = value: why; set NAME to ...".
TextLine because(std::string_view name, double value, std::string_view why) noexcept {
  TextLine line;
  line << name << " = " << value << ": " << why;
  return line;
}

Verdict judge_px4(const CheckContext& c, const Readings& r) noexcept {
  Verdict v;
  v.semantics = semantics_of(c.wish);
  if (known(r, kThrHover) && at(r, kThrHover).value > 0.05 && c.wish.hover_share <= 0)
    v.semantics.hover_share = static_cast<float>(at(r, kThrHover).value);
  // Who decides on the loss: with a radio COM_OBL_RC_ACT, without one COM_OBL_ACT, which newer releases lack.
  if (known(r, kLossTime)) v.failsafe << "after " << at(r, kLossTime).value << " s ";
  if (known(r, kLossAct))
    v.failsafe << choice(kLossActs, at(r, kLossAct).value) << " (COM_OBL_RC_ACT " << at(r, kLossAct).value << ")";
  if (known(r, kLossActNoRadio))
    v.failsafe << "; without a radio " << choice(kLossActsNoRadio, at(r, kLossActNoRadio).value) << " (COM_OBL_ACT "
               << at(r, kLossActNoRadio).value << ")";
  if (known(r, kForward) && at(r, kForward).value == 0)
    v.refusal = because("MAV_FWDEXTSP", 0, "setpoints are not passed on to its controllers; set it to 1");
  if (known(r, kLossTime) && at(r, kLossTime).value > kLongestTimeout_s)
    v.refusal = because("COM_OF_LOSS_T", at(r, kLossTime).value,
                        "a stream of setpoints that ended would go unnoticed for so long; set it to 1");
  if (known(r, kLossTime) && at(r, kLossTime).value > 0 && at(r, kLossTime).value < 0.15)
    v.refusal = because("COM_OF_LOSS_T", at(r, kLossTime).value,
                        "three setpoints of wasp are further apart; set it to 0.5 or more");
  if (known(r, kLossAct) && at(r, kLossAct).value >= 6)
    v.refusal = because("COM_OBL_RC_ACT", at(r, kLossAct).value,
                        "it would stop the rotors in the air when the stream ends; set it to 4 (land)");
  if (known(r, kLossActNoRadio) && at(r, kLossActNoRadio).value >= 3)
    v.refusal = because("COM_OBL_ACT", at(r, kLossActNoRadio).value,
                        "it would stop the rotors in the air when the stream ends; set it to 0 (land)");
  if (!known(r, kThrHover) && !known(r, kLossTime) && !known(r, kLossAct))
    v.refusal << "it answers no PARAM_REQUEST_READ: what a setpoint does there is not known";
  return v;
}

/// True if the thrust field is thrust. Where that cannot be told it asks for GUID_OPTIONS to be written without the
/// bit, and refuses until it is: a development version of 4.1 reads back a default that nobody set.
bool thrust_is_thrust(const CheckContext& c, const Readings& r, Verdict& v) noexcept {
  const auto bit = [](const Reading& reading, double end, unsigned mask) noexcept {
    const bool sane = reading.state == ReadingState::kKnown && reading.value >= 0 && reading.value < end &&
                      reading.value == std::floor(reading.value);
    return sane && (static_cast<unsigned>(reading.value) & mask) != 0;
  };
  const bool by_guid = bit(at(r, kGuidOptions), kOptionsEnd, 8), by_dev = bit(at(r, kDevOptions), 65536, 4);
  const bool old = c.version != 0 && c.version < kVersion4_1Release;  // its GUID_OPTIONS has no such bit
  if (old && by_guid && !by_dev) {
    v.to_write = kGuidOptions;
    v.value_to_write = at(r, kGuidOptions).value - 8;
    v.refusal = because("GUID_OPTIONS", at(r, kGuidOptions).value,
                        "bit 3 means thrust from 4.1 on, and this is a version between; wasp writes it without");
  }
  return old ? by_dev : by_guid;
}

/// What 1 and 0 in the thrust field mean [m/s]; false if the autopilot does not say.
bool climb_scales(const Readings& r, AutopilotSemantics& s) noexcept {
  const bool cm = known(r, kSpeedUp_cmps) && known(r, kSpeedDown_cmps);
  const bool m = known(r, kSpeedUp_mps) && known(r, kSpeedDown_mps);
  if (cm) {
    s.climb_at_full_mps = static_cast<float>(at(r, kSpeedUp_cmps).value / 100);
    s.sink_at_zero_mps = static_cast<float>(std::fabs(at(r, kSpeedDown_cmps).value) / 100);
  } else if (m) {
    s.climb_at_full_mps = static_cast<float>(at(r, kSpeedUp_mps).value);
    s.sink_at_zero_mps = static_cast<float>(std::fabs(at(r, kSpeedDown_mps).value));
  }
  return (cm || m) && s.climb_at_full_mps > 0.05f && s.sink_at_zero_mps > 0.05f;
}

Verdict judge_copter(const CheckContext& c, const Readings& r) noexcept {
  Verdict v;
  v.semantics = semantics_of(c.wish);
  const bool thrust = c.wish.thrust || (!c.wish.climb_rate && thrust_is_thrust(c, r, v));
  v.semantics.vertical = thrust ? VerticalChannel::kThrust : VerticalChannel::kClimbRate;
  v.semantics.learn_hover = thrust && c.wish.hover_share <= 0;
  v.failsafe << "after " << (known(r, kGuidTimeout) ? at(r, kGuidTimeout).value : kOldGuidTimeout_s)
             << " s it levels, holds its height and stays in the mode";
  if (!climb_scales(r, v.semantics) && !thrust)
    v.refusal << "it answers neither WPNAV_SPEED_UP, _DN nor WP_SPD_UP, _DN: what thrust asks for is not known";
  if (known(r, kFrameClass) && at(r, kFrameClass).value == 0)
    v.refusal = because("FRAME_CLASS", 0, "it does not know its own frame and cannot arm; set it to 1 (quad)");
  if (known(r, kGuidTimeout) && at(r, kGuidTimeout).value > kLongestTimeout_s)
    v.refusal = because("GUID_TIMEOUT", at(r, kGuidTimeout).value,
                        "the last setpoint would be flown on for so long after the stream ended; set it to 1");
  if (known(r, kAngleMax_cdeg) && at(r, kAngleMax_cdeg).value > 0) {
    const double degrees = at(r, kAngleMax_cdeg).value / 100, wanted = to_degrees(Radians{c.wish.max_tilt_rad}).value;
    if (degrees < wanted - 0.05)
      v.refusal = because("ANGLE_MAX", at(r, kAngleMax_cdeg).value,
                          "less than control.max_tilt_deg, commands would be cut; raise it, or lower that");
  }
  if (known(r, kEnforceId) && at(r, kEnforceId).value != 0 && known(r, kGcsId) &&
      at(r, kGcsId).value != static_cast<double>(c.own_system_id))
    v.refusal = because("SYSID_MYGCS", at(r, kGcsId).value,
                        "with SYSID_ENFORCE it hears nobody else; set it to wasp's system id");
  return v;
}

}  // namespace

std::span<const std::string_view> parameters_of(Flavour flavour) WASP_REALTIME {
  if (flavour == Flavour::kPx4) return kPx4Names;
  if (flavour == Flavour::kArduPilot) return kCopterNames;
  return {};
}

AutopilotSemantics semantics_of(const SetupWish& wish) WASP_REALTIME {
  AutopilotSemantics s;
  s.hover_share = wish.hover_share;
  if (wish.flavour == Flavour::kWasp) return s;
  s.heading_by_angle = s.silent_when_left = true;
  if (wish.flavour == Flavour::kPx4) {
    s.learn_hover = wish.hover_share <= 0;
    if (s.learn_hover) s.hover_share = 0.5f;  // PX4's own default
    return s;
  }
  // Its newer versions drop a setpoint with some rates given and others not, and stop guiding (GCS_MAVLink_Copter.cpp,
  // "The body rates are ill-defined"): never a yaw rate alone.
  s.heading_rate_used = false;
  s.vertical = wish.thrust ? VerticalChannel::kThrust : VerticalChannel::kClimbRate;
  if (s.hover_share <= 0) s.hover_share = 0.4f;
  return s;
}

std::string_view meaning_of(Flavour flavour, std::size_t i, double value) WASP_REALTIME {
  if (flavour == Flavour::kPx4) {
    if (i == kThrHover) return "where the learning of the thrust that carries it begins";
    if (i == kLossAct) return choice(kLossActs, value);
    if (i == kLossActNoRadio) return choice(kLossActsNoRadio, value);
    if (i == kRadioMode && value == 0) return "it arms with a radio alone";
    if (i == kRadioExcept && value >= 0 && value < 1024 && (static_cast<unsigned>(value) & kExceptOffboard) == 0)
      return "without a radio, releases before 1.14 never enter OFFBOARD; 4 lets them";
    if (i == kGcsAct && value > 0) return "it arms only while a ground station is connected; 0 lifts that";
  }
  if (flavour == Flavour::kArduPilot) {
    if (i == kGuidOptions && value >= kOptionsEnd) return "no options but a default that was never set; not used";
    if (i == kArmingCheck && value == 0) return "its own checks before arming are off";
  }
  return {};
}

Verdict judge(const CheckContext& context, const Readings& readings) WASP_REALTIME {
  if (context.wish.flavour == Flavour::kPx4) return judge_px4(context, readings);
  if (context.wish.flavour == Flavour::kArduPilot) return judge_copter(context, readings);
  Verdict v;
  v.semantics = semantics_of(context.wish);
  return v;
}

}  // namespace wasp::drivers
