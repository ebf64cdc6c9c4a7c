#include "control/arbiter.h"

#include <algorithm>
#include <cmath>

namespace wasp::control {
namespace {

constexpr DurationNs kClockSlack = 1 * kMillisecond;  // a cue from further ahead carries a wrong clock, and ages late

constexpr int kOverdueRank = 100;  // more than any configured rank

void note_evidence(Intention& intention, const Cue& cue, const ArbiterRow& row) noexcept {
  intention.usable_until_ns = std::min(intention.usable_until_ns, cue.exposed_at_ns + row.age_limit_ns);
  if (intention.oldest_exposed_at_ns == kNever || cue.exposed_at_ns < intention.oldest_exposed_at_ns)
    intention.oldest_exposed_at_ns = cue.exposed_at_ns;
}

/// Keeps the first source in rank order; one over its budget stands behind every punctual one.
struct Choice {
  int source = -1, rank = 0;
  void offer(int behaviour, int its_rank, bool overdue) noexcept {
    const int r = its_rank + (overdue ? kOverdueRank : 0);
    if (its_rank >= 0 && (source < 0 || r < rank)) source = behaviour, rank = r;
  }
};

/// Neither too old nor from ahead of the clock.
bool recent(const Cue& cue, const ArbiterRow& row, TimeNs now_ns) noexcept {
  return cue.exposed_at_ns <= now_ns + kClockSlack && cue.exposed_at_ns >= now_ns - row.age_limit_ns;
}

/// Finite, and no more than a small vehicle near the ground can mean.
bool credible(const CueBody& b) noexcept {
  constexpr float kMost_m = 1000.f, kMost_mps = 100.f, kMost_1ps = 100.f, kMost_rad = 10.f;
  const auto within = [](float most, auto... values) noexcept {
    return ((std::fabs(values) <= most) && ...);  // NaN fails
  };
  return within(kMost_m, b.height_m, b.height_sigma_m) && within(kMost_rad, b.pitch_rad) &&
         within(kMost_1ps, b.heading_rate_radps, b.climb_1ps) &&
         within(kMost_mps, b.velocity_forward_mps, b.velocity_right_mps, b.velocity_sigma_mps, b.climb_mps);
}

void add_wishes(const Cue& cue, const ArbiterRow& row, Intention& out) noexcept {
  const CueBody& b = cue.body;
  const bool heading = b.has_heading_rate != 0 && row.heading_weight > 0;
  const bool pitch = b.has_pitch != 0 && row.pitch_weight > 0;
  if (heading) out.heading_rate_radps += row.heading_weight * b.heading_rate_radps;
  if (pitch) out.pitch_rad += row.pitch_weight * b.pitch_rad;
  out.steered = out.steered || heading;
  if (row.heading_weight > 0 || row.pitch_weight > 0) note_evidence(out, cue, row);
}

}  // namespace

bool usable(const Cue& cue, const ArbiterRow& row, TimeNs now_ns) noexcept {
  return credible(cue.body) && cue.body.validity == Validity::kValid && cue.over_budget == 0 &&
         recent(cue, row, now_ns);
}

Intention arbitrate(const ArbiterParams& params, const CueSet& set, TimeNs now_ns) noexcept {
  Intention out;
  Choice height, velocity, climb;
  for (int i = 0; i < std::min(params.behaviour_count, kMaxBehaviours); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const ArbiterRow& row = params.rows[k];
    const Cue& cue = set.cues[k];
    if (!set.present[k] || !recent(cue, row, now_ns)) continue;
    out.images = true;
    if (cue.body.avoid != 0) out.avoid = true, note_evidence(out, cue, row);
    if (set.off[k] || !usable(cue, row, now_ns)) continue;
    if (cue.body.has_height != 0) height.offer(i, row.height_rank, set.overdue[k]);
    if (cue.body.has_velocity != 0) velocity.offer(i, row.velocity_rank, set.overdue[k]);
    if (cue.body.has_climb != 0) climb.offer(i, row.climb_rank, set.overdue[k]);
    add_wishes(cue, row, out);
  }
  for (const int source : {height.source, velocity.source, climb.source})
    if (source >= 0)
      note_evidence(out, set.cues[static_cast<std::size_t>(source)], params.rows[static_cast<std::size_t>(source)]);
  if ((out.height_source = height.source) >= 0) {
    const Cue& cue = set.cues[static_cast<std::size_t>(height.source)];
    out.height_m = cue.body.height_m, out.height_sigma_m = cue.body.height_sigma_m;
    out.height_exposed_at_ns = cue.exposed_at_ns;
  }
  if ((out.velocity_source = velocity.source) >= 0) {
    const Cue& cue = set.cues[static_cast<std::size_t>(velocity.source)];
    out.velocity_forward_mps = cue.body.velocity_forward_mps, out.velocity_right_mps = cue.body.velocity_right_mps;
    out.velocity_exposed_at_ns = cue.exposed_at_ns;
  }
  if ((out.climb_source = climb.source) >= 0) {
    const CueBody& body = set.cues[static_cast<std::size_t>(climb.source)].body;
    out.climb_mps = body.climb_mps, out.climb_1ps = body.climb_1ps;
  }
  if (out.avoid) out.pitch_rad = std::max(out.pitch_rad, 0.f);  // never forward while something is ahead
  return out;
}

}  // namespace wasp::control
