// The arbiter turns the newest cue of every behaviour into one intention. A cue older than its age limit is absent, and
// so is one with a number that no vehicle of this kind can mean, or of a behaviour that was switched off in flight.
// Avoid wins over every wish to go forward, and needs no usable cue: one that is blind, late or broken in another field
// still brakes. Heading and pitch are weighted sums; height, velocity and the wish to climb each come from the first
// source in their fallback order that can see; one that is at this moment over its time budget is asked last. Above all
// of it stands manual control: see control/flight_mode.h. Why: docs/behaviours.md.
#pragma once

#include <array>

#include "types/messages.h"
#include "types/realtime.h"

namespace wasp::control {

inline constexpr int kMaxBehaviours = 24;

/// How the arbiter treats one behaviour; row i belongs to Cue::behaviour == i.
struct ArbiterRow {
  DurationNs age_limit_ns = 95 * kMillisecond;
  int height_rank = -1;        ///< 0 is asked first; -1: never a height source
  int velocity_rank = -1;      ///< likewise for the velocity over ground
  int climb_rank = -1;         ///< likewise for the wish to climb
  float heading_weight = 0.f;  ///< >= 0
  float pitch_weight = 0.f;    ///< >= 0
};

struct ArbiterParams {
  int behaviour_count = 0;
  std::array<ArbiterRow, kMaxBehaviours> rows{};
};

/// The newest cue of each behaviour; `present[i]` false until the first.
struct CueSet {
  std::array<Cue, kMaxBehaviours> cues{};
  std::array<bool, kMaxBehaviours> present{};
  std::array<bool, kMaxBehaviours> overdue{};  ///< its step is running longer than its budget at this moment
  std::array<bool, kMaxBehaviours> off{};      ///< taken out of real time for this flight: only an avoid is heard
};

struct Intention {
  int height_source = -1;  ///< behaviour index, -1: nobody can see the ground
  float height_m = 0;
  float height_sigma_m = 0;
  TimeNs height_exposed_at_ns = kNever;
  int velocity_source = -1;
  float velocity_forward_mps = 0, velocity_right_mps = 0;
  TimeNs velocity_exposed_at_ns = kNever;
  int climb_source = -1;
  float climb_mps = 0, climb_1ps = 0;
  bool images = false;   ///< a cue is recent, be it blind: frames come
  bool avoid = false;    ///< something is ahead: not forward; says nothing of heading, height or sideways
  bool steered = false;  ///< a behaviour with a weight says something of the heading
  float heading_rate_radps = 0;
  float pitch_rad = 0;
  TimeNs oldest_exposed_at_ns = kNever;  ///< oldest evidence in this intention
  TimeNs usable_until_ns = kForever;     ///< when the first of its evidence reaches its age limit
};

/// True if the cue may be used at `now_ns`: valid, credible in every number, made within its budget and its age limit.
/// Realtime-safe: yes.
bool usable(const Cue& cue, const ArbiterRow& row, TimeNs now_ns) WASP_REALTIME;

/// Realtime-safe: yes.
Intention arbitrate(const ArbiterParams& params, const CueSet& set, TimeNs now_ns) WASP_REALTIME;

}  // namespace wasp::control
