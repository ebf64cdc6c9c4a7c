// Frames are taken relative to the last one, so that the intercept is the line's value now and sums stay small.
#include "vision/kernels/avoid_decision.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace wasp::vision {

double student_t_two_sided(double t, int freedom) noexcept {
  if (freedom < 1 || freedom > 30 || std::isnan(t)) return 1.0;
  if (std::isinf(t)) return 0.0;
  const double angle = std::atan2(std::abs(t), std::sqrt(static_cast<double>(freedom)));
  const double s = std::sin(angle), c = std::cos(angle);
  double term = freedom % 2 == 0 ? 1.0 : c, sum = freedom == 1 ? 0.0 : term;
  for (int k = freedom % 2 == 0 ? 2 : 3; k <= freedom - 2; k += 2) {
    term *= c * c * (k - 1) / k;
    sum += term;
  }
  const double inside = freedom % 2 == 0 ? s * sum : (angle + s * sum) * 2 / std::numbers::pi;
  return std::clamp(1.0 - inside, 0.0, 1.0);
}

AvoidMonitor::AvoidMonitor(const AvoidParams& params) noexcept : params_(params) {
  params_.pairs = std::clamp(params_.pairs, 3, kMaxAvoidPairs);
}

Regression AvoidMonitor::regress() const noexcept {
  Regression line;
  const auto n = static_cast<std::size_t>(count_);
  const std::int64_t last = pairs_[n - 1].frame;
  double x = 0, y = 0;
  for (std::size_t i = 0; i < n; ++i) {
    x += static_cast<double>(pairs_[i].frame - last);
    y += static_cast<double>(pairs_[i].time_to_contact);
  }
  x /= count_, y /= count_;
  double xx = 0, xy = 0, yy = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double dx = static_cast<double>(pairs_[i].frame - last) - x;
    const double dy = static_cast<double>(pairs_[i].time_to_contact) - y;
    xx += dx * dx, xy += dx * dy, yy += dy * dy;
  }
  if (!(xx > 0)) return line;
  const double slope = xy / xx, left = std::max(yy - slope * xy, 0.0);
  line.slope = static_cast<float>(slope);
  line.intercept = static_cast<float>(y - slope * x);
  const double t = slope == 0.0 ? 0.0 : slope / std::sqrt(left / (count_ - 2) / xx);  // a perfect line: infinite
  line.p_value = static_cast<float>(student_t_two_sided(t, count_ - 2));
  line.valid = std::isfinite(line.slope) && std::isfinite(line.intercept);
  return line;
}

AvoidDecision AvoidMonitor::add(std::int64_t frame, float time_to_contact_frames) noexcept {
  AvoidDecision decision;
  const auto kept = static_cast<std::size_t>(count_);
  if (!std::isfinite(time_to_contact_frames) || (count_ > 0 && frame <= pairs_[kept - 1].frame)) return decision;
  if (count_ == params_.pairs) {
    std::copy(pairs_.begin() + 1, pairs_.begin() + count_, pairs_.begin());
    --count_;
  }
  pairs_[static_cast<std::size_t>(count_++)] = {frame, time_to_contact_frames};
  decision.ready = count_ == params_.pairs;
  if (!decision.ready) return decision;
  decision.line = regress();
  if (!decision.line.valid || !(decision.line.slope < 0.f)) return decision;
  decision.contact_in_frames = -decision.line.intercept / decision.line.slope;
  decision.avoid = decision.line.p_value < params_.max_p_value && decision.contact_in_frames >= 0.f &&
                   decision.contact_in_frames <= params_.frames_ahead;
  return decision;
}

}  // namespace wasp::vision
