#include "drivers/sample_judge.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "drivers/autopilot_samples.h"

namespace wasp::drivers {
namespace {

template <std::size_t N>
bool finite(const std::array<float, N>& v) noexcept {
  return std::all_of(v.begin(), v.end(), [](float x) noexcept { return std::isfinite(x); });
}

template <std::size_t N>
bool within(const std::array<float, N>& v, float most) noexcept {
  return std::all_of(v.begin(), v.end(), [most](float x) noexcept { return std::fabs(x) <= most; });
}

template <std::size_t N>
bool same_bits(const std::array<float, N>& a, const std::array<float, N>& b) noexcept {
  return std::memcmp(a.data(), b.data(), sizeof a) == 0;
}

float fastest(const AttitudeSample& s) noexcept {
  const auto& r = s.rate_body_radps;
  return std::sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]);
}

/// True if the vehicle can have turned from one to the other in the time between.
bool follows(const AttitudeSample& from, const AttitudeSample& to) noexcept {
  const DurationNs gap_ns = to.exposed_at_ns - from.exposed_at_ns;
  if (gap_ns > AttitudeJudge::kLongGap) return true;
  const auto &a = from.q_ned_body, &b = to.q_ned_body;
  const float dot = std::fabs(a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]);
  const float turned_rad = 2.f * std::acos(std::min(1.f, dot));
  const auto gap_s = static_cast<float>(to_seconds(std::max<DurationNs>(gap_ns, 0)));
  float spun_radps = 0;
  for (std::size_t k = 0; k < 3; ++k)
    spun_radps = std::max(spun_radps, std::fabs(to.rate_body_radps[k] - from.rate_body_radps[k]));
  return spun_radps <= AttitudeJudge::kRateJump_radps + AttitudeJudge::kMostSpin_radps2 * gap_s &&
         turned_rad <=
             AttitudeJudge::kJump_rad + AttitudeJudge::kRateTrust * std::max(fastest(from), fastest(to)) * gap_s;
}

}  // namespace

const char* name_of(SampleFault fault) noexcept {
  constexpr std::array kNames = {"none", "not finite", "out of a sensor's range", "a jump", "frozen", "misdated"};
  const auto i = static_cast<std::size_t>(fault);
  return i < kNames.size() ? kNames[i] : "unknown";
}

SampleFault ImuJudge::judge(const ImuSample& s, TimeNs received_at_ns) noexcept {
  const bool same =
      same_bits(s.accel_body_mps2, before_.accel_body_mps2) && same_bits(s.gyro_body_radps, before_.gyro_body_radps);
  const bool coarse = (s.fields & kFieldCoarse) != 0;
  const bool frozen =
      freeze_.frozen(same, received_at_ns, coarse ? FreezeWatch::kCoarseFrozenFor : FreezeWatch::kFrozenFor);
  before_ = s;
  if (!finite(s.accel_body_mps2) || !finite(s.gyro_body_radps)) return SampleFault::kNotFinite;
  if (!within(s.accel_body_mps2, kMostAccel_mps2) || !within(s.gyro_body_radps, kMostRate_radps))
    return SampleFault::kOutOfRange;
  if (frozen) return SampleFault::kFrozen;
  if (s.exposed_at_ns > received_at_ns || s.exposed_at_ns < used_at_ns_) return SampleFault::kMisdated;
  used_at_ns_ = s.exposed_at_ns;
  return SampleFault::kNone;
}

SampleFault AttitudeJudge::judge(const AttitudeSample& s, TimeNs received_at_ns) noexcept {
  const bool same =
      any_ && same_bits(s.q_ned_body, before_.q_ned_body) && same_bits(s.rate_body_radps, before_.rate_body_radps);
  const bool frozen = freeze_.frozen(same, received_at_ns);
  before_ = s;
  any_ = true;
  if (!finite(s.q_ned_body) || !finite(s.rate_body_radps)) return SampleFault::kNotFinite;
  const auto& q = s.q_ned_body;
  const float squared = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
  if (!within(s.rate_body_radps, kMostRate_radps) || std::fabs(squared - 1.f) > 0.02f) return SampleFault::kOutOfRange;
  if (frozen) return SampleFault::kFrozen;
  if (s.exposed_at_ns > received_at_ns || (used_any_ && s.exposed_at_ns < used_.exposed_at_ns))
    return SampleFault::kMisdated;
  return look(s);
}

/// Against the last one used; then against those doubted just before.
SampleFault AttitudeJudge::look(const AttitudeSample& s) noexcept {
  if (used_any_ && !follows(used_, s)) {
    agreeing_ = agreeing_ > 0 && follows(doubted_, s) ? agreeing_ + 1 : 1;
    doubted_ = s;
    if (agreeing_ < kAgree) return SampleFault::kJump;
  }
  agreeing_ = 0;
  used_ = s;
  used_any_ = true;
  return SampleFault::kNone;
}

}  // namespace wasp::drivers
