#include "control/arbiter.h"

#include <algorithm>
#include <cmath>

namespace wasp::control {
namespace {

constexpr DurationNs kClockSlack = 50 * kMillisecond;  // a cue from further ahead carries a wrong clock, and never ages

constexpr int kOverdueRank = 100;  // more than any configured rank

void note_evidence(Intention& intention, const Cue& cue, const ArbiterRow& row) noexcept {
  intention.usable_until_ns = std::min(intention.usable_until_ns, cue.exposed_at_ns + row.age_limit_ns);
  if (intention.oldest_exposed_at_ns == kNever || cue.exposed_at_ns < intention.oldest_exposed_at_ns)
    intention.oldest_exposed_at_ns = cue.exposed_at_ns;
}

}  // namespace

bool usable(const Cue& cue, const ArbiterRow& row, TimeNs now_ns) noexcept {
  const CueBody& b = cue.body;
  const bool finite = std::isfinite(b.height_m) && std::isfinite(b.height_sigma_m) &&
                      std::isfinite(b.heading_rate_radps) && std::isfinite(b.pitch_rad);
  return finite && b.validity == Validity::kValid && cue.over_budget == 0 &&
         cue.exposed_at_ns <= now_ns + kClockSlack && now_ns - cue.exposed_at_ns <= row.age_limit_ns;
}

Intention arbitrate(const ArbiterParams& params, const CueSet& set, TimeNs now_ns) noexcept {
  Intention out;
  int best_rank = -1;  // of those asked so far; an overdue one stands behind every punctual one
  for (int i = 0; i < std::min(params.behaviour_count, kMaxBehaviours); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const ArbiterRow& row = params.rows[k];
    const Cue& cue = set.cues[k];
    if (!set.present[k] || !usable(cue, row, now_ns)) continue;
    const int rank = row.height_rank + (set.overdue[k] ? kOverdueRank : 0);
    if (cue.body.has_height != 0 && row.height_rank >= 0 && (best_rank < 0 || rank < best_rank)) {
      best_rank = rank;
      out.height_source = i;
      out.height_m = cue.body.height_m;
      out.height_sigma_m = cue.body.height_sigma_m;
      out.height_exposed_at_ns = cue.exposed_at_ns;
    }
    if (cue.body.avoid != 0) out.avoid = true;
    if (cue.body.has_heading_rate != 0) out.heading_rate_radps += row.heading_weight * cue.body.heading_rate_radps;
    if (cue.body.has_pitch != 0) out.pitch_rad += row.pitch_weight * cue.body.pitch_rad;
    if (cue.body.avoid != 0 || row.heading_weight > 0 || row.pitch_weight > 0) note_evidence(out, cue, row);
  }
  if (out.height_source >= 0) {
    const auto k = static_cast<std::size_t>(out.height_source);
    note_evidence(out, set.cues[k], params.rows[k]);
  }
  if (out.avoid) out.pitch_rad = std::max(out.pitch_rad, 0.f);  // never forward while something is ahead
  return out;
}

}  // namespace wasp::control
