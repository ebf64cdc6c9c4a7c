#include "scheduling/guard_policy.h"

#include <algorithm>

namespace wasp::scheduling {
namespace {

constexpr DurationNs kIdleLook = 100 * kMillisecond;  // nothing falls due
constexpr DurationNs kSecondLook = 2 * kMillisecond;

bool silent_for(const GuardSight& s, DurationNs patience_ns) noexcept {
  return s.next_due_ns != 0 && s.now_ns >= s.next_due_ns + patience_ns;
}

/// True if this look came so late itself that the host may have held up both: the beat gets one more look.
bool forgive(const GuardTimes& t, const GuardSight& s, GuardState& state) noexcept {
  if (!s.alive || s.woken_late_ns < t.late_ns || state.forgiven_due_ns == s.next_due_ns) return false;
  state.forgiven_due_ns = s.next_due_ns;
  return true;
}

void take(const GuardSight& s, GuardState& state, GuardDeed& deed) noexcept {
  state.ours = deed.take = true;
  state.taken_at_ns = state.speak_at_ns = s.now_ns;
  state.beat_at_taking_ns = s.beat_at_ns;
}

/// While the line is ours: back to a control thread that beats again, or on with neutral.
void hold(const GuardTimes& t, const GuardSight& s, GuardState& state, GuardDeed& deed) noexcept {
  const bool over = s.now_ns - state.taken_at_ns >= t.neutral_ns;
  const bool beats = s.alive && s.beat_at_ns > state.beat_at_taking_ns && !silent_for(s, t.patience_ns);
  if (beats && (!state.restarted || over)) {
    state.ours = false;
    deed.give_back = true;
    return;
  }
  if (over || s.now_ns < state.speak_at_ns) return;
  deed.speak = true;
  while (state.speak_at_ns <= s.now_ns) state.speak_at_ns += t.period_ns;
}

TimeNs next_look(const GuardTimes& t, const GuardSight& s, const GuardState& state) noexcept {
  TimeNs at = s.now_ns + kIdleLook;
  if (state.ours) {
    if (s.now_ns - state.taken_at_ns < t.neutral_ns) at = std::min(at, state.speak_at_ns);
    if (s.alive) at = std::min(at, s.now_ns + kSecondLook);  // a beat may come back any time
  } else if (s.alive && s.next_due_ns != 0) {
    at = std::min(at, std::max(s.next_due_ns + t.patience_ns, s.now_ns + kSecondLook));
  }
  return at;
}

}  // namespace

GuardDeed guard_step(const GuardTimes& t, const GuardSight& s, GuardState& state) noexcept {
  GuardDeed deed;
  const bool silent = !s.alive || silent_for(s, t.patience_ns);
  if (!state.ours && s.commanding && silent && !forgive(t, s, state)) take(s, state, deed);
  if (state.ours) hold(t, s, state, deed);
  deed.kill = s.alive && silent_for(s, t.kill_after_ns);
  deed.look_again_at_ns = next_look(t, s, state);
  return deed;
}

}  // namespace wasp::scheduling
