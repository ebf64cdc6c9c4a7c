#include "scheduling/own_messages.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "scheduling/flight_regions.h"
#include "scheduling/flow_ring.h"
#include "shm/topics.h"

namespace wasp::scheduling {
namespace {

using namespace mavlink;  // NOLINT: message names

constexpr float kPixelsPerCount = 1.f / 64.f;
constexpr std::int16_t kNoFlow = std::numeric_limits<std::int16_t>::min();
constexpr std::uint8_t kControlRow = 255;
constexpr std::uint32_t kNoEvidence = 0xffffffffu;

std::uint32_t short_microseconds(DurationNs ns) noexcept {
  return static_cast<std::uint32_t>(std::clamp<DurationNs>(ns / kMicrosecond, 0, kNoEvidence - 1));
}

std::array<char, 20> name_field(std::string_view name) noexcept {
  std::array<char, 20> field{};
  std::copy_n(name.begin(), std::min(name.size(), field.size()), field.begin());
  return field;
}

std::uint8_t fields_of(const CueBody& body) noexcept {
  using namespace wasp_cue_has;
  return static_cast<std::uint8_t>((body.has_height != 0 ? kHeight : 0) |
                                   (body.has_heading_rate != 0 ? kHeadingRate : 0) |
                                   (body.has_pitch != 0 ? kPitch : 0) | (body.has_velocity != 0 ? kVelocity : 0) |
                                   (body.has_climb != 0 ? kClimb : 0) | (body.avoid != 0 ? kAvoid : 0));
}

/// Median, 99th percentile and worst [us]; zero where nothing was measured.
void tell(const Stage* stage, float& p50, float& p99, float& worst) noexcept {
  if (stage == nullptr) return;
  const auto us = [](DurationNs ns) noexcept { return 1e-3f * static_cast<float>(ns); };
  p50 = us(stage->histogram.quantile_ns(0.5));
  p99 = us(stage->histogram.quantile_ns(0.99));
  worst = us(stage->histogram.max_ns());
}

std::int16_t count_of(float px) noexcept {
  constexpr float kMost = std::numeric_limits<std::int16_t>::max();
  return static_cast<std::int16_t>(std::lround(std::clamp(px / kPixelsPerCount, -kMost, kMost)));
}

}  // namespace

TimeNs told_time(const drivers::AutopilotLink& link, TimeNs local_ns) WASP_REALTIME {
  return link.clock().synced() ? link.clock().to_remote(local_ns) : local_ns;
}

std::uint64_t told_us(const drivers::AutopilotLink& link, TimeNs local_ns) WASP_REALTIME {
  return static_cast<std::uint64_t>(std::max<TimeNs>(told_time(link, local_ns), 0) / kMicrosecond);
}

OwnMessages::OwnMessages(const Config& c, const shm::Region& flight, drivers::AutopilotLink& link)
    : link_(link), stages_(stage_table(flight)), commands_(flight, shm::kCommand, "Command") {
  for (std::size_t i = 0; i < c.behaviours.size(); ++i)
    if (c.behaviours[i].enabled)
      voices_.push_back(
          {i, name_field(c.behaviours[i].name), shm::RingReader(flight, shm::cue_topic(c.behaviours[i].name), "Cue")});
  if (flight.has(shm::kFlow)) fields_.emplace(flight, shm::kFlow, "Flow");
  part_.scale = kPixelsPerCount;
  part_.width = static_cast<std::uint16_t>(c.camera.intrinsics.width_px);
  part_.height = static_cast<std::uint16_t>(c.camera.intrinsics.height_px);
}

std::size_t OwnMessages::cue(std::span<std::uint8_t> out) WASP_REALTIME {
  for (std::size_t tried = 0; tried < voices_.size(); ++tried) {
    Voice& voice = voices_[next_voice_];
    next_voice_ = (next_voice_ + 1) % voices_.size();
    Cue cue;
    if (!voice.ring.copy_newest(cue) || cue.step_index + 1 == voice.told) continue;
    voice.told = cue.step_index + 1;
    const CueBody& body = cue.body;
    WaspCue m;
    m.time_usec = told_us(link_, cue.exposed_at_ns);
    m.frame_sequence = cue.frame_sequence;
    m.latency_us = short_microseconds(cue.finished_at_ns - cue.exposed_at_ns);
    m.quality = body.quality;
    m.height = body.height_m, m.height_sigma = body.height_sigma_m;
    m.heading_rate = body.heading_rate_radps;
    m.pitch = body.pitch_rad;
    m.velocity_forward = body.velocity_forward_mps, m.velocity_right = body.velocity_right_mps;
    m.velocity_sigma = body.velocity_sigma_mps;
    m.climb = body.climb_mps, m.climb_slope = body.climb_1ps;
    m.behaviour = static_cast<std::uint8_t>(voice.behaviour);
    m.valid = body.validity == Validity::kValid ? 1 : 0;
    m.has = fields_of(body);
    m.name = voice.name;
    return link_.encode(m, out);
  }
  return 0;
}

OwnMessages::Stages OwnMessages::stages_of(std::string_view owner, std::string_view last) const WASP_REALTIME {
  Stages found;
  const std::uint32_t n = stages_.count.load(std::memory_order_acquire);
  for (std::uint32_t i = 0; i < n && i < StageTable::kMaxStages; ++i) {
    const Stage& stage = stages_.stages[i];
    if (stage.owner_view() != owner) continue;
    if (stage.stage_view() == "wake-up") found.wake = &stage;
    if (stage.stage_view() == "compute") found.compute = &stage;
    if (stage.stage_view() == last) found.end_to_end = &stage;
  }
  return found;
}

std::size_t OwnMessages::latency(TimeNs now_ns, std::span<std::uint8_t> out) WASP_REALTIME {
  const std::size_t threads = voices_.size() + 1;
  for (std::size_t tried = 0; tried < threads; ++tried) {
    const std::size_t thread = next_thread_;
    next_thread_ = (next_thread_ + 1) % threads;
    WaspLatency m;
    const bool control = thread == voices_.size();
    m.name = control ? name_field("control") : voices_[thread].name;
    m.behaviour = control ? kControlRow : static_cast<std::uint8_t>(voices_[thread].behaviour);
    const std::string_view owner(m.name.data(), std::find(m.name.begin(), m.name.end(), '\0') - m.name.begin());
    const Stages stages = stages_of(owner, control ? "tick to byte" : "end to end");
    if (stages.compute == nullptr || stages.compute->histogram.count() == 0) continue;
    m.time_usec = told_us(link_, now_ns);
    m.samples = static_cast<std::uint32_t>(stages.compute->histogram.count());
    m.over_budget = static_cast<std::uint32_t>(stages.compute->misses.load(std::memory_order_relaxed));
    tell(stages.wake, m.wake_p50, m.wake_p99, m.wake_max);
    tell(stages.compute, m.compute_p50, m.compute_p99, m.compute_max);
    tell(stages.end_to_end, m.end_to_end_p50, m.end_to_end_p99, m.end_to_end_max);
    return link_.encode(m, out);
  }
  return 0;
}

std::size_t OwnMessages::state(std::span<std::uint8_t> out) WASP_REALTIME {
  Command c;
  if (!commands_.copy_newest(c) || c.tick + 1 == tick_told_) return 0;
  tick_told_ = c.tick + 1;
  WaspState m;
  m.time_usec = told_us(link_, c.released_at_ns);
  m.tick = c.tick;
  m.evidence_age_us = c.exposed_at_ns == kNever ? kNoEvidence : short_microseconds(c.released_at_ns - c.exposed_at_ns);
  m.q = c.q_ned_body;
  m.yaw_rate = c.yaw_rate_radps;
  m.thrust = c.thrust;
  m.height_setpoint = c.height_setpoint_m, m.height = c.height_m, m.climb_rate = c.climb_rate_mps;
  m.velocity_forward = c.velocity_forward_mps, m.velocity_right = c.velocity_right_mps;
  m.cue_source = static_cast<std::int8_t>(c.cue_source);
  m.mode = static_cast<std::uint8_t>(c.mode);
  m.reason = static_cast<std::uint8_t>(c.reason);
  m.mission_phase = c.mission_phase;
  m.refused = c.refused;
  m.flags = static_cast<std::uint8_t>((c.sent != 0 ? wasp_state_flags::kSent : 0) |
                                      (c.avoid != 0 ? wasp_state_flags::kAvoid : 0) |
                                      (c.velocity_held != 0 ? wasp_state_flags::kVelocityHeld : 0));
  return link_.encode(m, out);
}

/// Takes the newest field down as counts, so that its parts are of one field whatever is published meanwhile.
bool OwnMessages::begin_field() WASP_REALTIME {
  const shm::Sample sample = fields_->look(fields_->newest());
  if (!sample || sample.number == field_told_) return false;
  const auto* slot = reinterpret_cast<const FlowSlot*>(sample.data);
  const FlowMessage& message = slot->message;
  const bool still = message.derotated != 0;
  const FlowField& field = still ? message.still : message.seen;
  if (!believable(field)) return false;
  part_.columns = static_cast<std::uint8_t>(field.columns);
  part_.rows = static_cast<std::uint8_t>(field.rows);
  const std::size_t cells = std::size_t{part_.columns} * part_.rows;
  for (std::size_t i = 0; i < std::min(cells, kMostCells); ++i) {
    const FlowCell& cell = field.cells[i];
    u_[i] = cell.valid != 0 ? count_of(cell.u_px) : kNoFlow;
    v_[i] = cell.valid != 0 ? count_of(cell.v_px) : kNoFlow;
  }
  part_.time_usec = told_us(link_, slot->shown_at_ns);
  part_.interval_us = short_microseconds(message.exposed_at_ns - message.first_exposed_at_ns);
  part_.frame_sequence = message.frame_sequence;
  part_.flags = still ? wasp_flow_flags::kStill : 0;
  if (!fields_->intact(sample) || cells > kMostCells) return false;
  field_told_ = sample.number;
  first_ = 0, cells_ = cells;
  return true;
}

std::size_t OwnMessages::flow(TimeNs now_ns, std::span<std::uint8_t> out) WASP_REALTIME {
  if (!fields_) return 0;
  if (!field_begun() || now_ns - begun_at_ns_ > kSecond) {
    first_ = cells_ = 0;
    if (!begin_field()) return 0;
    begun_at_ns_ = now_ns;
  }
  const std::size_t count = std::min(part_.u.size(), cells_ - first_);
  part_.first = static_cast<std::uint16_t>(first_);
  part_.count = static_cast<std::uint8_t>(count);
  part_.u.fill(kNoFlow), part_.v.fill(kNoFlow);
  std::copy_n(u_.begin() + static_cast<std::ptrdiff_t>(first_), count, part_.u.begin());
  std::copy_n(v_.begin() + static_cast<std::ptrdiff_t>(first_), count, part_.v.begin());
  first_ += count;
  return link_.encode(part_, out);
}

}  // namespace wasp::scheduling
