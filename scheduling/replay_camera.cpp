#include "scheduling/replay_camera.h"

#include <cstring>

#include "rt/clock.h"
#include "shm/topics.h"
#include "types/messages.h"

namespace wasp::scheduling {
namespace {

// Messages that may lie unread when the next frame is published. Frames: the slot under a reader is never the next to
// be written. Flow fields: those of the frames that lie unread before the source come on top, so twice as many.
constexpr std::uint64_t kMaxBehind = 4;
static_assert(kMaxBehind + 2 <= shm::kFrameSlots && 2 * kMaxBehind + 2 <= shm::kFlowSlots);
constexpr DurationNs kPatience = 20 * kSecond;

void write_frame(shm::RingWriter& ring, const void* pixels, drivers::Recording::Size size, std::uint32_t pixel_bytes,
                 PixelFormat format, std::uint32_t sequence, TimeNs exposed_at_ns) WASP_REALTIME {
  std::byte* slot = ring.loan();
  ring.announce();
  FrameHeader header;
  header.exposed_at_ns = exposed_at_ns;
  header.sequence = sequence;
  header.format = format;
  header.width_px = static_cast<std::uint32_t>(size.width_px);
  header.height_px = static_cast<std::uint32_t>(size.height_px);
  header.stride_bytes = header.width_px * pixel_bytes;
  std::memcpy(slot, &header, sizeof header);
  std::memcpy(slot + kFramePixelOffset, pixels, size.pixels() * pixel_bytes);
  ring.publish(rt::now());
}

std::unique_ptr<shm::RingWriter> writer_of(const shm::Region& camera, const char* topic) {
  return camera.has(topic) ? std::make_unique<shm::RingWriter>(camera, topic, "Frame") : nullptr;
}

}  // namespace

std::vector<shm::TopicSpec> ReplayCamera::topics(const drivers::Recording& r) {
  std::vector<shm::TopicSpec> specs;
  const auto bytes = [](drivers::Recording::Size size, std::size_t pixel_bytes) {
    return kFramePixelOffset + std::max<std::size_t>(64, size.pixels() * pixel_bytes);
  };
  if (r.depth_size().pixels() > 0)
    specs.push_back({shm::kDepth, "Frame", shm::TopicKind::kRing, shm::kFrameSlots, bytes(r.depth_size(), 2)});
  if (r.gray_size().pixels() > 0)
    specs.push_back({shm::kGray, "Frame", shm::TopicKind::kRing, shm::kFrameSlots, bytes(r.gray_size(), 1)});
  return specs;
}

ReplayCamera::ReplayCamera(drivers::Recording recording, const shm::Region& camera, DurationNs length_ns,
                           StageTable& stages, ThreadWatch& watch, rt::OverrunPolicy overrun)
    : recording_(std::move(recording)),
      length_ns_(length_ns),
      depth_(writer_of(camera, shm::kDepth)),
      gray_(writer_of(camera, shm::kGray)),
      pool_(recording_.depth_size().pixels(), recording_.gray_size().pixels()),
      release_(stages.add("camera", "release", 0)),
      compute_(stages.add("camera", "compute", watch.budget_ns)),
      watch_(watch),
      overrun_(overrun),
      frame_period_ns_(from_seconds(1.0 / recording_.nominal_rate_hz())) {}

std::atomic<std::uint64_t>* ReplayCamera::add_reader(shm::RingReader ring) {
  readers_.push_back(std::make_unique<Reader>(std::move(ring)));
  return &readers_.back()->done;
}

/// Pixels of one entry into `frame`; false, counted, if they cannot be decoded.
bool ReplayCamera::load(std::size_t index, DecodedFrame& frame) {
  const auto& entry = recording_.entries()[index];
  try {
    frame.has_depth = entry.has_depth();
    frame.has_gray = entry.has_gray();
    if (frame.has_depth) recording_.load_depth(index, frame.depth_mm);
    if (frame.has_gray) recording_.load_gray(index, frame.gray);
  } catch (const std::exception&) {
    decode_errors_.fetch_add(1);
    return false;
  }
  return true;
}

void ReplayCamera::preload() {
  std::vector<DecodedFrame> frames(recording_.entries().size());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    frames[i].depth_mm.resize(recording_.depth_size().pixels());
    frames[i].gray.resize(recording_.gray_size().pixels());
    if (!load(i, frames[i])) frames[i].has_depth = frames[i].has_gray = false;
  }
  preloaded_ = std::move(frames);
}

bool ReplayCamera::decode_one(std::size_t index, DurationNs offset_ns, std::uint32_t sequence, DecodedFrame& frame) {
  if (preloaded_.empty()) {
    if (!load(index, frame)) return false;
  } else {
    frame = preloaded_[index];  // of the same size: copied in place
    if (!frame.has_depth && !frame.has_gray) return false;
  }
  frame.offset_ns = offset_ns;
  frame.sequence = sequence;
  return true;
}

DurationNs ReplayCamera::lap_ns(const drivers::Recording& recording) {
  return recording.entries().back().offset_ns + from_seconds(1.0 / recording.nominal_rate_hz());
}

void ReplayCamera::decode(LoopControl& control) {
  const auto& entries = recording_.entries();
  std::uint32_t slot = 0;
  bool holding = false, any = true;
  for (std::uint32_t lap = 0; any && !control.stop; ++lap) {
    any = false;
    for (std::size_t i = 0; i < entries.size() && !control.stop; ++i) {
      const DurationNs offset_ns = lap * lap_ns(recording_) + entries[i].offset_ns;
      if (offset_ns >= length_ns_) {
        all_decoded_ = true;
        return;
      }
      while (!holding && !(holding = pool_.take_empty(slot)) && !control.stop)
        rt::sleep_until(rt::now() + 2 * kMillisecond);
      if (!holding ||
          !decode_one(i, offset_ns, lap * lap_sequence(recording_) + entries[i].sequence, pool_.frame(slot)))
        continue;
      pool_.give_full(slot);
      holding = false;
      any = true;
    }
  }
  all_decoded_ = true;
}

bool ReplayCamera::readers_keep_up() const noexcept {
  for (const auto& r : readers_)
    if (r->ring.newest() - r->done.load(std::memory_order_acquire) >= kMaxBehind) return false;
  return true;
}

void ReplayCamera::publish(const DecodedFrame& frame, TimeNs exposed_at_ns) WASP_REALTIME {
  if (frame.has_depth && depth_)
    write_frame(*depth_, frame.depth_mm.data(), recording_.depth_size(), 2, PixelFormat::kDepth16Mm, frame.sequence,
                exposed_at_ns);
  if (frame.has_gray && gray_)
    write_frame(*gray_, frame.gray.data(), recording_.gray_size(), 1, PixelFormat::kMono8, frame.sequence,
                exposed_at_ns);
}

void ReplayCamera::wait_for_readers(RealtimeLoop& loop) WASP_REALTIME {
  if (readers_keep_up()) return;
  held_back_.fetch_add(1, std::memory_order_relaxed);
  for (const TimeNs limit = rt::now() + kPatience; !readers_keep_up() && rt::now() < limit && loop.tick();)
    rt::sleep_until(rt::now() + kMillisecond);
}

/// The overrun policy, for a frame whose successor is due already. True: not to be published.
bool ReplayCamera::drop_late(DurationNs late_ns, LoopControl& control) WASP_REALTIME {
  if (late_ns <= frame_period_ns_ || overrun_ == rt::OverrunPolicy::kCatchUp) return false;
  dropped_.fetch_add(1, std::memory_order_relaxed);
  if (overrun_ == rt::OverrunPolicy::kStop && !control.overrun_stop.exchange(true)) control.stop_requested.store(true);
  return true;
}

void ReplayCamera::serve(const DecodedFrame& frame, TimeNs due_ns, RealtimeLoop& loop,
                         LoopControl& control) WASP_REALTIME {
  rt::sleep_until(due_ns);
  if (drop_late(rt::now() - due_ns, control)) return;
  wait_for_readers(loop);
  const TimeNs now_ns = rt::now();
  publish(frame, now_ns);
  const TimeNs done_ns = rt::now();
  release_->record(now_ns - due_ns);
  compute_->record(done_ns - now_ns);
  watch_.trace.record(done_ns, rt::TraceKind::kFrame, frame.sequence, now_ns - due_ns);
  published_.fetch_add(1, std::memory_order_relaxed);
}

void ReplayCamera::run(LoopControl& control) {
  RealtimeLoop loop(control, watch_);
  publish_all(loop, control);
  finished_ = true;
}

void ReplayCamera::publish_all(RealtimeLoop& loop, LoopControl& control) WASP_REALTIME {
  TimeNs start_ns = kNever;
  while (loop.tick()) {
    std::uint32_t slot = 0;
    if (!control.flying.load(std::memory_order_relaxed) || !pool_.take_full(slot)) {
      if (all_decoded_.load() && start_ns != kNever) break;
      rt::sleep_until(rt::now() + kMillisecond);
      continue;
    }
    if (start_ns == kNever) start_ns = rt::now() + 50 * kMillisecond;
    serve(pool_.frame(slot), start_ns + pool_.frame(slot).offset_ns, loop, control);
    pool_.give_empty(slot);
  }
}

}  // namespace wasp::scheduling
