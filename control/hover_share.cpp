#include "control/hover_share.h"

#include <algorithm>

namespace wasp::control {
namespace {

constexpr float kGravity_mps2 = 9.80665f;
constexpr float kLeast = 0.1f, kMost = 0.95f;
constexpr float kTimeConstant_s = 0.8f;
constexpr float kGrowth_1ps = 0.08f;                             // on the ground: from 0.5 to 0.8 in four seconds
constexpr float kLeastForce_mps2 = 5.f, kMostForce_mps2 = 20.f;  // beyond: a bump, or free fall
constexpr float kLeastThrust = 0.05f;

}  // namespace

float hover_share_step(const HoverShareInput& in, float dt_s, HoverShareState& s) noexcept {
  if (s.share <= 0.f || s.first_guess != in.guess) s = {in.guess, in.guess};
  const bool told = in.airborne && in.sent_thrust > kLeastThrust && in.force_up_mps2 > kLeastForce_mps2 &&
                    in.force_up_mps2 < kMostForce_mps2;
  if (told)
    s.share += std::min(1.f, dt_s / kTimeConstant_s) * (in.sent_thrust * kGravity_mps2 / in.force_up_mps2 - s.share);
  else if (!in.airborne && in.asked_up)
    s.share += kGrowth_1ps * dt_s;
  s.share = std::clamp(s.share, kLeast, kMost);
  return s.share;
}

}  // namespace wasp::control
