#include "scheduling/camera_relay.h"

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "rt/clock.h"
#include "shm/topics.h"

namespace wasp::scheduling {
namespace {

using enum FaultPoint;

constexpr DurationNs kPatience =
    20 * kMillisecond;  // longest sleep: the stop flag and a reopened camera are seen by then

bool holds_frames(const shm::TopicEntry& entry) {
  return entry.kind == shm::TopicKind::kRing && entry.type_view() == "Frame";
}

/// Format, width, height and stride as noise.
void tear_header(FrameHeader& h, FaultRandom& random) WASP_REALTIME {
  const std::uint64_t a = random.next(), b = random.next();
  h.format = static_cast<PixelFormat>(static_cast<std::uint32_t>(a));
  h.width_px = static_cast<std::uint32_t>(a >> 32);
  h.height_px = static_cast<std::uint32_t>(b);
  h.stride_bytes = static_cast<std::uint32_t>(b >> 32);
}

/// What the header says after the faults of this exposure.
void change_header(std::byte* frame, const Fate& fate, const FaultBoard& board, FaultRandom& random) WASP_REALTIME {
  FrameHeader h;
  std::memcpy(&h, frame, sizeof h);
  h.sequence = fate.sequence_shown;
  h.exposed_at_ns = fate.exposed_shown_ns;
  if (fate.has(kCameraSize))
    h.width_px =
        static_cast<std::uint32_t>(std::clamp(static_cast<float>(h.width_px) * board.value(kCameraSize), 1.f, 1e9f));
  if (fate.has(kCameraTornHeader)) tear_header(h, random);
  std::memcpy(frame, &h, sizeof h);
}

}  // namespace

CameraRelay::Channel::Channel(const shm::Region& source, const shm::Region& relay, const shm::TopicEntry& entry)
    : in(source, entry.name_view(), "Frame"),
      out(relay, entry.name_view(), "Frame"),
      depth(entry.name_view() == shm::kDepth),
      down(entry.name_view() == shm::kGrayDown),
      faults(entry.payload_bytes),
      kept(kFramesKept) {
  for (Kept& frame : kept) frame.bytes.resize(entry.payload_bytes);
}

CameraRelay::CameraRelay(const shm::Region& source, const shm::Region& relay, StageTable& stages, EventQueue& events,
                         ThreadWatch& watch)
    : events_(events), watch_(watch), relay_(stages.add("camera", "relay", watch.budget_ns)) {
  for (const bool depth : {true, false})  // first the depth that its grey frame needs
    for (const auto& entry : source.topics())
      if (holds_frames(entry) && (entry.name_view() == shm::kDepth) == depth && channels_.size() < kChannels) {
        channels_.emplace_back(source, relay, entry);
        if (depth) depth_ = &channels_.back();
        if (rt::Bell* bell = source.bell(entry)) bells_.push_back(bell);
      }
}

std::vector<shm::TopicSpec> CameraRelay::topics(const shm::Region& source) {
  std::vector<shm::TopicSpec> specs;
  for (const auto& e : source.topics())
    if (holds_frames(e))
      specs.push_back({std::string(e.name_view()), std::string(e.type_view()), e.kind, e.slots, e.payload_bytes});
  if (specs.size() > kChannels) throw std::runtime_error("camera relay: more rings of frames than it knows");
  return specs;
}

void CameraRelay::run(LoopControl& control) {
  RealtimeLoop loop(control, watch_);
  board_ = control.faults;
  while (loop.tick()) cycle(control);
}

void CameraRelay::cycle(LoopControl& control) WASP_REALTIME {
  rt::Bell::wait_any(
      bells_, [this]() WASP_REALTIME { return unread(); }, next_due(rt::now()));
  watch_the_line(rt::now());
  for (Channel& channel : channels_) {
    take_all(channel);
    count_lost(channel, control);
  }
  release_due(rt::now());
}

TimeNs CameraRelay::next_due(TimeNs now_ns) const WASP_REALTIME {
  const TimeNs latest_ns = now_ns + kPatience;
  return waiting_ > 0 ? std::min(latest_ns, queue_[first_].due_ns) : latest_ns;
}

bool CameraRelay::unread() const WASP_REALTIME {
  for (const Channel& channel : channels_)
    if (channel.in.unread()) return true;
  return false;
}

/// What lies unread, oldest first. The depth of a grey frame was published before it: it goes ahead here too.
void CameraRelay::take_all(Channel& channel) WASP_REALTIME {
  for (std::uint32_t i = 0; i < channel.in.slots(); ++i) {
    const shm::Sample sample = channel.in.next();
    if (!sample) return;
    if (&channel != depth_ && !channel.down && depth_ != nullptr) {
      for (std::uint32_t k = 0; k < depth_->in.slots(); ++k)
        if (const shm::Sample depth = depth_->in.next()) take(*depth_, depth);
    }
    take(channel, sample);
  }
}

void CameraRelay::take(Channel& channel, const shm::Sample& sample) WASP_REALTIME {
  const TimeNs now_ns = rt::now();
  FrameHeader header;
  std::memcpy(&header, sample.data, sizeof header);
  if (!channel.in.intact(sample)) return channel.in.count_lost();
  const Fate& fate = (channel.down ? down_ : front_).of(header, board_, now_ns);
  if (comes_through(channel, fate, now_ns)) pass_on(channel, sample, fate, now_ns);
  const TimeNs done_ns = rt::now();
  relay_->record(done_ns - sample.published_at_ns);
  watch_.trace.record(done_ns, rt::TraceKind::kFrame, header.sequence, done_ns - now_ns);
}

bool CameraRelay::comes_through(const Channel& channel, const Fate& fate, TimeNs now_ns) WASP_REALTIME {
  if (read_fails(fate, now_ns) || fate.lost) return false;
  return !(channel.depth && fate.has(kDepthDrop) && random_.chance(board_->value(kDepthDrop)));
}

void CameraRelay::pass_on(Channel& channel, const shm::Sample& sample, const Fate& fate, TimeNs now_ns) WASP_REALTIME {
  const bool in_line =
      fate.held || fate.has(kCameraLate) || fate.has(kCameraDuplicate) || waiting_ > 0 || channel.held != kFramesKept;
  if (in_line)
    keep(channel, sample, fate, now_ns);
  else
    forward(channel, sample, fate);
}

/// A camera that is not there: nothing comes of it. Says when it goes.
bool CameraRelay::read_fails(const Fate& fate, TimeNs now_ns) WASP_REALTIME {
  if (!closed_ && fate.has(kCameraError)) {
    closed_ = true;
    closed_until_ns_ = now_ns + milliseconds_of(*board_, kCameraError);
    events_.say(now_ns, "camera: read error (EIO), closed");
  }
  return closed_;
}

/// Whether the camera is there at all.
void CameraRelay::watch_the_line(TimeNs now_ns) WASP_REALTIME {
  const bool gone = fault_on(board_, kCameraDisconnect, now_ns);
  if (gone && !closed_) events_.say(now_ns, "camera disconnected");
  if (!gone && closed_ && now_ns >= closed_until_ns_) events_.say(now_ns, "camera reopened");
  closed_ = gone || now_ns < closed_until_ns_;
}

/// The faults on a frame that has been copied to `frame`.
void CameraRelay::change(Channel& channel, const shm::Sample& sample, const Fate& fate,
                         std::byte* frame) WASP_REALTIME {
  if (board_ == nullptr) return;
  const shm::Sample before = channel.in.look(sample.number - 1);
  channel.faults.corrupt(frame, before ? before.data : nullptr, fate, *board_);
  change_header(frame, fate, *board_, random_);
}

/// Straight from ring to ring.
void CameraRelay::forward(Channel& channel, const shm::Sample& sample, const Fate& fate) WASP_REALTIME {
  std::byte* slot = channel.out.loan();
  std::memcpy(slot, sample.data, channel.out.payload_bytes());
  change(channel, sample, fate, slot);
  if (!channel.in.intact(sample)) return channel.in.count_lost();  // the loan is taken again
  channel.out.publish(rt::now());
}

/// By way of a copy: it waits, changes places or comes more than once.
void CameraRelay::keep(Channel& channel, const shm::Sample& sample, const Fate& fate, TimeNs now_ns) WASP_REALTIME {
  std::size_t n = 0;
  while (n < kFramesKept && channel.kept[n].used) ++n;
  if (n == kFramesKept) return channel.in.count_lost();
  Kept& frame = channel.kept[n];
  std::memcpy(frame.bytes.data(), sample.data, frame.bytes.size());
  change(channel, sample, fate, frame.bytes.data());
  if (!channel.in.intact(sample)) return channel.in.count_lost();
  frame.used = true;
  frame.copies = fate.has(kCameraDuplicate) ? 1 + static_cast<std::uint32_t>(board_->value(kCameraDuplicate)) : 1;
  const std::size_t overtaken = std::exchange(channel.held, fate.held ? n : kFramesKept);
  if (!fate.held) line_up(channel, n, fate, now_ns);
  if (overtaken != kFramesKept) line_up(channel, overtaken, fate, now_ns);
  release_due(rt::now());
}

/// Behind whatever waits already, so that frames of all rings stay in the order in which they came.
void CameraRelay::line_up(Channel& channel, std::size_t frame, const Fate& fate, TimeNs now_ns) WASP_REALTIME {
  const DurationNs delay_ns = fate.has(kCameraLate) ? milliseconds_of(*board_, kCameraLate) : 0;
  last_due_ns_ = std::max(last_due_ns_, now_ns + delay_ns);
  queue_[(first_ + waiting_++) % queue_.size()] = {&channel, frame, last_due_ns_};
}

void CameraRelay::release_due(TimeNs now_ns) WASP_REALTIME {
  while (waiting_ > 0 && queue_[first_].due_ns <= now_ns) {
    const Waiting next = queue_[first_];
    first_ = (first_ + 1) % queue_.size();
    --waiting_;
    Kept& frame = next.channel->kept[next.frame];
    for (std::uint32_t n = 0; n < frame.copies && !closed_; ++n) {
      std::memcpy(next.channel->out.loan(), frame.bytes.data(), frame.bytes.size());
      next.channel->out.publish(rt::now());
    }
    frame.used = false;
  }
}

void CameraRelay::count_lost(Channel& channel, LoopControl& control) WASP_REALTIME {
  if (channel.in.lost() == channel.lost_reported) return;
  control.status->frames_lost.fetch_add(channel.in.lost() - channel.lost_reported, std::memory_order_relaxed);
  channel.lost_reported = channel.in.lost();
}

}  // namespace wasp::scheduling
