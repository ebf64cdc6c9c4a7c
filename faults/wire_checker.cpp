#include "faults/wire_checker.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace wasp::faults {
namespace {

constexpr std::size_t kResendMemory = 200;       // setpoints; the sequence number runs through in 256 frames
constexpr DurationNs kJoinWindow = 3 * kSecond;  // a line may hold a setpoint back

class Checker {
 public:
  Checker(const WireReader& wire, const WireLimits& limits, const WireEvidence& evidence)
      : wire_(wire), limits_(limits), evidence_(evidence) {}

  std::vector<Violation> run() {
    joined_ = join(wire_.setpoints, evidence_.commands);
    for (const Setpoint& s : wire_.setpoints) numbers(s);
    resends();
    gaps();
    rearming();
    if (!evidence_.commands.empty()) evidence();
    std::ranges::stable_sort(found_, {}, &Violation::at_ns);
    return std::move(found_);
  }

 private:
  void report(Offence offence, TimeNs at_ns, double value, const Setpoint* s = nullptr) {
    found_.push_back({offence, at_ns, value, s == nullptr ? "" : fmt::format("{:02x}", fmt::join(s->wire, "")),
                      s == nullptr ? 0 : held_ms(*s)});
  }
  [[nodiscard]] double held_ms(const Setpoint& s) const {
    const int command = joined_[static_cast<std::size_t>(&s - wire_.setpoints.data())];
    if (command < 0) return 0;
    const TimeNs written_ns = evidence_.commands[static_cast<std::size_t>(command)].written_at_ns;
    return written_ns == 0 ? 0 : std::max(0.0, to_seconds(s.at_ns - written_ns) * 1e3);
  }

  void numbers(const Setpoint& s) {
    const auto finite = [](float x) { return std::isfinite(x); };
    if (!std::ranges::all_of(s.q, finite) || !finite(s.yaw_rate_radps) || !finite(s.thrust))
      return report(Offence::kNotFinite, s.at_ns, 0, &s);
    const float norm = std::sqrt(s.q[0] * s.q[0] + s.q[1] * s.q[1] + s.q[2] * s.q[2] + s.q[3] * s.q[3]);
    if (std::abs(norm - 1) > 1e-3f) return report(Offence::kNoRotation, s.at_ns, static_cast<double>(norm), &s);
    const auto [roll, pitch] = roll_pitch(s.q);
    const float tilt = std::max(std::abs(roll), std::abs(pitch));
    if (tilt > limits_.max_tilt_rad + 1e-3f) report(Offence::kTilt, s.at_ns, static_cast<double>(tilt), &s);
    if (std::abs(s.yaw_rate_radps) > limits_.max_yaw_rate_radps + 1e-3f)
      report(Offence::kYawRate, s.at_ns, static_cast<double>(s.yaw_rate_radps), &s);
    if (s.thrust < 0 || s.thrust > 1) report(Offence::kThrust, s.at_ns, static_cast<double>(s.thrust), &s);
  }

  void resends() {
    const auto& all = wire_.setpoints;
    for (std::size_t i = 1; i < all.size(); ++i)
      for (std::size_t j = i > kResendMemory ? i - kResendMemory : 0; j < i; ++j)
        if (all[i].sequence == all[j].sequence && all[i].wire == all[j].wire) {
          report(Offence::kResent, all[i].at_ns, to_seconds(all[i].at_ns - all[j].at_ns) * 1e3, &all[i]);
          break;
        }
  }

  /// Was the vehicle armed at that time, as it said last?
  [[nodiscard]] bool armed_at(TimeNs t_ns) const {
    const auto& beats = wire_.autopilot_beats;
    const auto after = std::ranges::upper_bound(beats, t_ns, {}, &AutopilotBeat::at_ns);
    return after != beats.begin() && std::prev(after)->armed;
  }

  void gaps() {
    const auto& all = wire_.setpoints;
    for (std::size_t i = 1; i < all.size(); ++i) {
      const TimeNs from_ns = all[i - 1].at_ns, until_ns = all[i].at_ns;
      if (until_ns - from_ns <= limits_.longest_gap_ns || !armed_at(from_ns) || !armed_at(until_ns)) continue;
      const auto excuses = [&](const Stretch& s) { return s.from_ns < until_ns && s.until_ns > from_ns; };
      if (std::ranges::any_of(evidence_.gaps_excused, excuses)) continue;
      report(Offence::kGap, until_ns, to_seconds(until_ns - from_ns) * 1e3, &all[i]);
    }
  }

  /// Requests to arm may be repeated until the vehicle is armed; after that none may come, whatever happens.
  void rearming() {
    const TimeNs armed_ns = wire_.first_armed_ns();
    constexpr DurationNs kUnderWay = 600 * kMillisecond;  // a repetition already due when the answer came
    for (const ArmRequest& request : wire_.arm_requests)
      if (request.arm && armed_ns != kForever && request.at_ns > armed_ns + kUnderWay)
        report(Offence::kRearmed, request.at_ns, to_seconds(request.at_ns - armed_ns) * 1e3);
  }

  void evidence() {
    const std::vector<int>& commands = joined_;
    const TimeNs first_ns = evidence_.commands.front().released_at_ns,
                 last_ns = evidence_.commands.back().released_at_ns;
    for (std::size_t i = 0; i < commands.size(); ++i) {
      const Setpoint& s = wire_.setpoints[i];
      if (s.at_ns < first_ns || s.at_ns > last_ns + limits_.period_ns / 2) continue;
      if (within(evidence_.not_joined, s.at_ns)) continue;
      if (commands[i] < 0)
        report(Offence::kNotOurs, s.at_ns, 0, &s);
      else
        rests_on(s, evidence_.commands[static_cast<std::size_t>(commands[i])].exposed_at_ns);
    }
  }

  void rests_on(const Setpoint& s, TimeNs exposed_at_ns) {
    if (exposed_at_ns == kNever) return;
    const double age_ms = to_seconds(s.at_ns - exposed_at_ns) * 1e3;
    if (s.at_ns - exposed_at_ns > limits_.cue_age_ns + limits_.slack_ns)
      report(Offence::kOldEvidence, s.at_ns, age_ms, &s);
    if (within(evidence_.tainted, exposed_at_ns)) report(Offence::kTaintedFrame, s.at_ns, age_ms, &s);
    const auto& shown = evidence_.exposures;
    if (shown.empty() || exposed_at_ns < shown.front() || within(evidence_.unseen, exposed_at_ns)) return;
    if (std::ranges::find(shown, exposed_at_ns) == shown.end()) report(Offence::kNoSuchFrame, s.at_ns, age_ms, &s);
  }

  const WireReader& wire_;
  const WireLimits& limits_;
  const WireEvidence& evidence_;
  std::vector<int> joined_;
  std::vector<Violation> found_;
};

bool same(const Setpoint& s, const Command& c) {
  return std::memcmp(s.q.data(), c.q_ned_body.data(), sizeof s.q) == 0 &&
         std::memcmp(&s.yaw_rate_radps, &c.yaw_rate_radps, sizeof(float)) == 0 &&
         std::memcmp(&s.thrust, &c.thrust, sizeof(float)) == 0;
}

}  // namespace

const char* name_of(Offence offence) {
  constexpr std::array kNames = {"not finite", "no rotation",  "tilt",          "yaw rate",
                                 "thrust",     "resent",       "gap",           "asked to arm again",
                                 "no tick's",  "old evidence", "no such frame", "tainted frame"};
  static_assert(kNames.size() == static_cast<std::size_t>(Offence::kCount));
  return kNames[static_cast<std::size_t>(offence)];
}

std::vector<int> join(const std::vector<Setpoint>& setpoints, const std::vector<Command>& commands) {
  std::vector<int> joined(setpoints.size(), -1);
  std::size_t next = 0;  // commands before it are older than every setpoint still to come
  for (std::size_t i = 0; i < setpoints.size(); ++i) {
    const Setpoint& s = setpoints[i];
    while (next < commands.size() && commands[next].released_at_ns < s.at_ns - kJoinWindow) ++next;
    for (std::size_t k = next; k < commands.size() && commands[k].released_at_ns <= s.at_ns; ++k)
      if (commands[k].sent != 0 && same(s, commands[k])) joined[i] = static_cast<int>(k);  // the newest that fits
  }
  return joined;
}

std::vector<Violation> check_wire(const WireReader& wire, const WireLimits& limits, const WireEvidence& evidence) {
  return Checker(wire, limits, evidence).run();
}

}  // namespace wasp::faults
