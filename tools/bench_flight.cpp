#include "tools/bench_flight.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "types/frames.h"

namespace wasp::tools {
namespace {

constexpr float kSpoolDown = 0.02f;  ///< of the thrust field, a step
constexpr float kPeriod_s = 0.05f, kDegree = 0.017453293f, kGravity_mps2 = 9.80665f;
constexpr double kLongestMode_s = 60, kLongestArm_s = 120, kLongestClimb_s = 30, kLongestLanding_s = 60;
constexpr double kMostTilt_deg = 20, kMostHeight_m = 20;

double number(const std::string& text, const std::string& whole) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size())
    throw std::runtime_error("--attitude \"" + whole + "\": \"" + text + "\" is not a number");
  return value;
}

}  // namespace

BenchPlan BenchPlan::parse(const std::string& text) {
  BenchPlan plan;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t comma = std::min(text.find(',', at), text.size());
    const std::string item = text.substr(at, comma - at);
    at = comma + 1;
    const std::size_t equals = item.find('=');
    const std::string key = item.substr(0, equals);
    const double value = equals == std::string::npos ? 0 : number(item.substr(equals + 1), text);
    if (key == "roll" && std::abs(value) <= kMostTilt_deg)
      plan.roll_rad = static_cast<float>(value) * kDegree;
    else if (key == "pitch" && std::abs(value) <= kMostTilt_deg)
      plan.pitch_rad = static_cast<float>(value) * kDegree;
    else if (key == "seconds" && value > 0 && value <= 60)
      plan.seconds = value;
    else if (key == "height" && value >= 0.5 && value <= kMostHeight_m)
      plan.height_m = static_cast<float>(value);
    else
      throw std::runtime_error(
          "--attitude \"" + text + "\": \"" + item +
          "\"; expected roll=, pitch= (degrees, at most 20), seconds= (60), height= (0.5 ... 20 m)");
  }
  return plan;
}

void BenchFlight::enter(Phase phase, TimeNs now_ns, std::string news) {
  phase_ = phase;
  since_ns_ = now_ns;
  news_ = std::move(news);
}

std::string BenchFlight::take_news() { return std::exchange(news_, {}); }

std::optional<std::pair<float, float>> BenchFlight::error() const {
  if (samples_ == 0) return std::nullopt;
  return std::pair(static_cast<float>(roll_sum_ / samples_), static_cast<float>(pitch_sum_ / samples_));
}

void BenchFlight::note_error(const BenchSight& s, double in_phase_s) {
  if (in_phase_s < plan_.seconds - 1) return;
  roll_sum_ += static_cast<double>(s.roll_rad - plan_.roll_rad);
  pitch_sum_ += static_cast<double>(s.pitch_rad - plan_.pitch_rad);
  ++samples_;
}

void BenchFlight::advance(const BenchSight& s, double in_phase_s) {
  const float height_m = s.height_m.value_or(0.f) - ground_m_;
  const bool flying = phase_ == Phase::kClimb || phase_ == Phase::kHold || phase_ == Phase::kLevel;
  if ((flying || phase_ == Phase::kLand) && s.armed && !s.follows)
    return enter(Phase::kOver, s.now_ns, "the autopilot left the mode: nothing is sent any more");
  if (flying && !s.armed) return enter(Phase::kOver, s.now_ns, "disarmed in flight");
  switch (phase_) {
    case Phase::kMode:
      if (s.follows) return enter(Phase::kArm, s.now_ns, "in the mode; arming");
      if (in_phase_s > kLongestMode_s) enter(Phase::kOver, s.now_ns, "it does not enter the mode");
      return;
    case Phase::kArm:
      ground_m_ = s.height_m.value_or(0.f);
      yaw_rad_ = s.yaw_rad;
      if (s.armed && s.height_m)
        return enter(Phase::kClimb, s.now_ns, fmt::format("armed; up to {} m", plan_.height_m));
      if (in_phase_s > kLongestArm_s)
        enter(Phase::kOver, s.now_ns, s.height_m ? "it does not arm" : "no LOCAL_POSITION_NED: no height to fly at");
      return;
    case Phase::kClimb:
      if (std::abs(height_m - plan_.height_m) < 0.3f && in_phase_s > 3)
        return enter(Phase::kHold, s.now_ns,
                     fmt::format("at {:.2f} m; roll {:.1f}, pitch {:.1f} degrees for {} s", height_m,
                                 plan_.roll_rad / kDegree, plan_.pitch_rad / kDegree, plan_.seconds));
      if (in_phase_s > kLongestClimb_s) enter(Phase::kLand, s.now_ns, "it does not reach the height; landing");
      return;
    case Phase::kHold:
      note_error(s, in_phase_s);
      if (in_phase_s > plan_.seconds) enter(Phase::kLevel, s.now_ns, "level");
      return;
    case Phase::kLevel:
      if (in_phase_s > 3) enter(Phase::kLand, s.now_ns, "landing");
      return;
    case Phase::kLand:
      landed_ = !s.armed;
      if (landed_) return enter(Phase::kOver, s.now_ns, "landed and disarmed");
      if (in_phase_s > kLongestLanding_s) enter(Phase::kOver, s.now_ns, "it does not disarm; nothing is sent any more");
      return;
    case Phase::kOver:
      return;
  }
}

float BenchFlight::field(const BenchSight& s, const AutopilotSemantics& semantics, float target_m) {
  const float height_m = s.height_m.value_or(0.f) - ground_m_;
  control::AltitudeHoldParams hold;
  hold.max_climb_mps = 0.6f;
  if (semantics.vertical == VerticalChannel::kClimbRate)
    return climb_field(semantics, control::climb_hold_step(hold, target_m, height_m, kPeriod_s, hold_));
  control::HoverShareInput seen{semantics.hover_share > 0 ? semantics.hover_share : 0.5f, sent_field_, s.force_up_mps2};
  seen.airborne = height_m > 0.15f;
  seen.asked_up = hold_.engaged && hold_.setpoint_m - height_m > 0.1f;
  const float share = control::hover_share_step(seen, kPeriod_s, hover_);
  hold.full_thrust_n = hold.mass_kg * kGravity_mps2 / share;
  const float cos_tilt = std::cos(s.roll_rad) * std::cos(s.pitch_rad);
  return control::altitude_hold_step(hold, target_m, height_m, s.climb_mps, cos_tilt, kPeriod_s, hold_);
}

/// While landing: at the height it started from, or for two seconds at one height though it is asked down.
bool BenchFlight::stands(const BenchSight& s) {
  constexpr float kNear_m = 0.15f, kUnmoved_m = 0.05f;
  const float height_m = s.height_m.value_or(0.f) - ground_m_;
  if (resting_since_ns_ == kNever || std::abs(height_m - resting_m_) > kUnmoved_m) {
    resting_since_ns_ = s.now_ns;
    resting_m_ = height_m;
  }
  return s.now_ns - since_ns_ > 2 * kSecond && (height_m < kNear_m || s.now_ns - resting_since_ns_ > 2 * kSecond);
}

BenchWish BenchFlight::step(const BenchSight& s, const AutopilotSemantics& semantics) {
  if (since_ns_ == kNever) since_ns_ = s.now_ns, yaw_rad_ = s.yaw_rad;
  const double in_phase_s = to_seconds(s.now_ns - since_ns_);
  advance(s, in_phase_s);
  BenchWish wish;
  if (phase_ == Phase::kOver) return wish;
  const bool up = phase_ == Phase::kClimb || phase_ == Phase::kHold || phase_ == Phase::kLevel;
  const bool tilt = phase_ == Phase::kHold;
  const bool standing = phase_ == Phase::kLand && stands(s);
  const float before = std::exchange(sent_field_, 0.f);
  if (up) sent_field_ = field(s, semantics, plan_.height_m);
  if (phase_ == Phase::kLand) sent_field_ = field(s, semantics, -1.f);
  // PX4 takes nothing for landed that is not without thrust, and disarms nothing else.
  if (standing && semantics.vertical == VerticalChannel::kThrust) sent_field_ = std::max(0.f, before - kSpoolDown);
  if (!up && phase_ != Phase::kLand) yaw_rad_ = s.yaw_rad;
  const Quat q = quat_from_euler({tilt ? plan_.roll_rad : 0.f, tilt ? plan_.pitch_rad : 0.f, yaw_rad_});
  wish.setpoint = {{q.w(), q.x(), q.y(), q.z()}, semantics.heading_rate_used, 0.f, sent_field_};
  wish.send = true;
  if (s.now_ns < ask_due_ns_) return wish;
  const double first_s = to_seconds(drivers::facts_of(flavour_).stream_first_ns);
  wish.ask_mode = phase_ == Phase::kMode && in_phase_s >= first_s;
  wish.ask_arm = phase_ == Phase::kArm && !s.armed;
  wish.ask_disarm = standing && s.armed;
  if (wish.ask_mode || wish.ask_arm || wish.ask_disarm) ask_due_ns_ = s.now_ns + kSecond;
  return wish;
}

}  // namespace wasp::tools
