#include "tools/camera_rings.h"

#include <cstring>

#include "rt/clock.h"
#include "shm/topics.h"

namespace wasp::tools {
namespace {

constexpr std::uint32_t kHalf = 1u << 31;  // a count that jumps further ahead has begun anew

drivers::CameraStatus* status_block(const shm::Region& region, const char* topic) {
  return reinterpret_cast<drivers::CameraStatus*>(region.at(region.topic(topic, drivers::kCameraStatusType).offset));
}

}  // namespace

std::vector<shm::TopicSpec> CameraTopics::specs(int width_px, int height_px) const {
  const std::uint64_t pixels = static_cast<std::uint64_t>(width_px) * static_cast<std::uint64_t>(height_px);
  std::vector<shm::TopicSpec> specs{
      {gray, "Frame", shm::TopicKind::kRing, shm::kFrameSlots, kFramePixelOffset + pixels}};
  if (depth != nullptr)
    specs.push_back({depth, "Frame", shm::TopicKind::kRing, shm::kFrameSlots, kFramePixelOffset + 2 * pixels});
  specs.push_back({status, drivers::kCameraStatusType, shm::TopicKind::kBlock, 1, sizeof(drivers::CameraStatus)});
  return specs;
}

CameraTopics front_topics(bool depth) { return {shm::kGray, depth ? shm::kDepth : nullptr, shm::kCamera}; }
CameraTopics down_topics() { return {shm::kGrayDown, nullptr, shm::kCameraDown}; }

CameraRings::CameraRings(const shm::Region& region, const CameraTopics& topics, int width_px, int height_px)
    : width_px_(static_cast<std::uint32_t>(width_px)),
      height_px_(static_cast<std::uint32_t>(height_px)),
      gray_(region, topics.gray, "Frame"),
      status_(status_block(region, topics.status)),
      sequence_(static_cast<std::uint32_t>(gray_.published())) {
  if (topics.depth != nullptr) depth_.emplace(region, topics.depth, "Frame");
}

drivers::FrameSlot CameraRings::slot() {
  if (gray_slot_ == nullptr) gray_slot_ = gray_.loan();
  if (depth_ && depth_slot_ == nullptr) depth_slot_ = depth_->loan();
  return {reinterpret_cast<std::uint8_t*>(gray_slot_ + kFramePixelOffset),
          depth_ ? reinterpret_cast<std::uint16_t*>(depth_slot_ + kFramePixelOffset) : nullptr};
}

void CameraRings::announce() {
  if (depth_) depth_->announce();
  gray_.announce();
}

void CameraRings::publish(const drivers::FrameStamp& stamp) {
  slot();
  const bool second_half = depth_alone_ && stamp.sequence == device_sequence_;
  depth_alone_ = !stamp.gray;
  if (!second_half) begin(stamp);
  if (depth_ && stamp.depth) {
    write_header(depth_slot_, PixelFormat::kDepth16Mm, 2, stamp.exposed_at_ns);
    depth_->publish(rt::now());
    depth_slot_ = nullptr;
  }
  const TimeNs now_ns = rt::now();
  if (stamp.gray) {
    write_header(gray_slot_, PixelFormat::kMono8, 1, stamp.exposed_at_ns);
    gray_.publish(now_ns);
    gray_slot_ = nullptr;
  }
  if (!second_half) status_->latency.record(now_ns - stamp.exposed_at_ns);
}

/// A new exposure: its number, its account.
void CameraRings::begin(const drivers::FrameStamp& stamp) {
  const bool first = first_;
  const std::uint32_t before = sequence_;
  sequence_ = place(stamp.sequence);
  drivers::count(status_->frames);
  if (stamp.estimated) drivers::count(status_->estimated);
  if (!first && sequence_ == before + 1) status_->interval.record(stamp.exposed_at_ns - last_exposed_ns_);
  last_exposed_ns_ = stamp.exposed_at_ns;
}

void CameraRings::note_corrupt() {
  ++corrupt_since_;
  drivers::count(status_->corrupt);
}

/// Our number for the device's: rising by as much, from wherever ours stands when the device begins anew. Damaged
/// frames have numbers of their own and are counted apart.
std::uint32_t CameraRings::place(std::uint32_t device_sequence) {
  const std::uint32_t ahead = device_sequence - device_sequence_;
  const bool anew = first_ || ahead == 0 || ahead >= kHalf;
  const std::uint32_t missing = anew ? 0 : ahead - 1;
  if (missing > corrupt_since_) drivers::count(status_->dropped, missing - corrupt_since_);
  corrupt_since_ = 0;
  first_ = false;
  device_sequence_ = device_sequence;
  return sequence_ + missing + 1;
}

void CameraRings::write_header(std::byte* slot, PixelFormat format, std::uint32_t pixel_bytes,
                               TimeNs exposed_at_ns) const {
  FrameHeader header;
  header.exposed_at_ns = exposed_at_ns;
  header.sequence = sequence_;
  header.format = format;
  header.width_px = width_px_;
  header.height_px = height_px_;
  header.stride_bytes = width_px_ * pixel_bytes;
  std::memcpy(slot, &header, sizeof header);
}

}  // namespace wasp::tools
