// A short flight without a mission or a camera: up to a height by the autopilot's own estimate, an attitude held for a
// while, down again. It shows on a simulated autopilot, or a vehicle in a net, that setpoints mean what wasp thinks.
#pragma once

#include <optional>
#include <string>

#include "control/altitude_hold.h"
#include "control/hover_share.h"
#include "drivers/autopilot_flavour.h"
#include "drivers/autopilot_link.h"
#include "types/autopilot_semantics.h"

namespace wasp::tools {

struct BenchPlan {
  float roll_rad = 0, pitch_rad = 0;
  double seconds = 5;
  float height_m = 2;
  /// "pitch=-8,roll=6,seconds=5,height=2", degrees; throws std::runtime_error naming what is wrong.
  static BenchPlan parse(const std::string& text);
};

struct BenchSight {
  TimeNs now_ns = 0;
  bool armed = false, follows = false;
  std::optional<float> height_m;  ///< of the autopilot, above where it started counting
  float climb_mps = 0;
  float roll_rad = 0, pitch_rad = 0, yaw_rad = 0;
  float force_up_mps2 = 0;
};

/// What to send now.
struct BenchWish {
  drivers::AttitudeTargetCommand setpoint;
  bool send = false, ask_mode = false, ask_arm = false, ask_disarm = false;
};

class BenchFlight {
 public:
  BenchFlight(const BenchPlan& plan, drivers::Flavour flavour) : plan_(plan), flavour_(flavour) {}
  /// Every 50 ms.
  BenchWish step(const BenchSight& sight, const AutopilotSemantics& semantics);
  [[nodiscard]] bool over() const { return phase_ == Phase::kOver; }
  /// It is over, and the vehicle was landed and disarmed.
  [[nodiscard]] bool landed() const { return landed_; }
  /// A line about what happened since the last call; empty: nothing.
  std::string take_news();
  /// Attitude reached less attitude commanded, mean of the last second [rad]; none if it was never held.
  [[nodiscard]] std::optional<std::pair<float, float>> error() const;

 private:
  enum class Phase { kMode, kArm, kClimb, kHold, kLevel, kLand, kOver };
  void enter(Phase phase, TimeNs now_ns, std::string news);
  void advance(const BenchSight& sight, double in_phase_s);
  bool stands(const BenchSight& sight);
  float field(const BenchSight& sight, const AutopilotSemantics& semantics, float target_m);
  void note_error(const BenchSight& sight, double in_phase_s);

  BenchPlan plan_;
  drivers::Flavour flavour_;
  Phase phase_ = Phase::kMode;
  TimeNs since_ns_ = kNever, ask_due_ns_ = 0, resting_since_ns_ = kNever;
  float resting_m_ = 0;
  bool landed_ = false;
  float ground_m_ = 0, yaw_rad_ = 0, sent_field_ = 0;
  control::AltitudeHoldState hold_;
  control::HoverShareState hover_;
  double roll_sum_ = 0, pitch_sum_ = 0;
  int samples_ = 0;
  std::string news_;
};

}  // namespace wasp::tools
