#include "sim/camera_loop.h"

#include <cstring>

#include "shm/topics.h"
#include "types/messages.h"

namespace wasp::sim {
namespace {

FrameHeader header_of(const SimCamera& camera, PixelFormat format, std::uint32_t bytes_per_pixel, TimeNs exposed_at_ns,
                      std::uint32_t sequence) {
  FrameHeader header;
  header.exposed_at_ns = exposed_at_ns;
  header.sequence = sequence;
  header.format = format;
  header.width_px = static_cast<std::uint32_t>(camera.width_px());
  header.height_px = static_cast<std::uint32_t>(camera.height_px());
  header.stride_bytes = header.width_px * bytes_per_pixel;
  return header;
}

std::uint64_t pixels_of(const SimCamera& camera) {
  return static_cast<std::uint64_t>(camera.width_px()) * static_cast<std::uint64_t>(camera.height_px());
}

}  // namespace

CameraEye::CameraEye(CameraView view, TimeNs start_ns, rt::OverrunPolicy policy, const shm::Region& region,
                     const char* gray_topic, const char* depth_topic)
    : camera_(*view.camera),
      period_ns_(from_seconds(1 / view.rate_hz)),
      grid_(start_ns, period_ns_, policy),
      next_due_ns_(start_ns),
      gray_(region, gray_topic, "Frame") {
  if (depth_topic != nullptr) depth_.emplace(region, depth_topic, "Frame");
}

rt::Release CameraEye::wait_next() {
  const rt::Release release = rt::wait_next(grid_);
  skipped_ += release.skipped;
  next_due_ns_ = release.due_at_ns + period_ns_;
  return release;
}

void CameraEye::publish(const BodyPose& pose, std::uint32_t sequence) {
  const TimeNs began_ns = rt::now();
  std::byte* gray = gray_.loan();
  const FrameHeader gray_header = header_of(camera_, PixelFormat::kMono8, 1, pose.at_ns, sequence);
  std::memcpy(gray, &gray_header, sizeof gray_header);
  std::uint16_t* depth_mm = nullptr;
  if (depth_) {
    std::byte* depth = depth_->loan();
    const FrameHeader depth_header = header_of(camera_, PixelFormat::kDepth16Mm, 2, pose.at_ns, sequence);
    std::memcpy(depth, &depth_header, sizeof depth_header);
    depth_mm = reinterpret_cast<std::uint16_t*>(depth + kFramePixelOffset);
  }
  const auto announce = [this] {
    if (depth_) depth_->announce();
    gray_.announce();
    announced_at_ns_ = rt::now();
  };
  camera_.render(pose, sequence, reinterpret_cast<std::uint8_t*>(gray + kFramePixelOffset), depth_mm, announce);
  if (depth_) depth_->publish(rt::now());
  gray_.publish(rt::now());
  lead_.record(rt::now() - announced_at_ns_);
  render_time_.record(rt::now() - began_ns);
}

std::vector<shm::TopicSpec> CameraLoop::topics(const SimCamera& front, const SimCamera* down) {
  using shm::TopicKind;
  std::vector<shm::TopicSpec> specs{
      {shm::kGray, "Frame", TopicKind::kRing, shm::kFrameSlots, kFramePixelOffset + pixels_of(front)},
      {shm::kDepth, "Frame", TopicKind::kRing, shm::kFrameSlots, kFramePixelOffset + 2 * pixels_of(front)}};
  if (down != nullptr)
    specs.push_back(
        {shm::kGrayDown, "Frame", TopicKind::kRing, shm::kFrameSlots, kFramePixelOffset + pixels_of(*down)});
  return specs;
}

/// Alone, the front camera passes over what it cannot make in time; two in one thread are late for each other, not
/// slow.
CameraLoop::CameraLoop(CameraView front, std::optional<CameraView> down, TimeNs start_ns, const shm::Region& region,
                       PoseQueue& poses)
    : front_(front, start_ns, down ? rt::OverrunPolicy::kCatchUp : rt::OverrunPolicy::kSkip, region, shm::kGray,
             shm::kDepth),
      poses_(poses) {
  if (down)
    down_.emplace(*down, start_ns + from_seconds(0.5 / down->rate_hz), rt::OverrunPolicy::kCatchUp, region,
                  shm::kGrayDown, nullptr);
}

/// Waits for the vehicle to pass the exposure's instant, at most 50 ms.
bool CameraLoop::pose_at(TimeNs exposure_ns, const std::atomic<bool>& stop, BodyPose& pose) {
  const TimeNs give_up_ns = exposure_ns + 50 * kMillisecond;
  while (!stop.load(std::memory_order_relaxed)) {
    BodyPose next;
    while (after_.at_ns < exposure_ns && poses_.pop(next)) {
      before_ = after_.at_ns == 0 ? next : after_;
      after_ = next;
    }
    if (after_.at_ns >= exposure_ns || rt::now() > give_up_ns) break;
    rt::sleep_until(rt::now() + kMillisecond / 2);
  }
  pose = interpolate(before_, after_, exposure_ns);
  return after_.at_ns >= exposure_ns;
}

void CameraLoop::run(const std::atomic<bool>& stop) {
  while (!stop.load(std::memory_order_relaxed)) {
    CameraEye& eye = down_ && down_->next_due_ns() < front_.next_due_ns() ? *down_ : front_;
    const rt::Release release = eye.wait_next();
    BodyPose pose;
    if (pose_at(release.due_at_ns, stop, pose))
      eye.publish(pose, static_cast<std::uint32_t>(release.index));
    else if (!stop.load(std::memory_order_relaxed))
      eye.count_skipped(1);
  }
}

}  // namespace wasp::sim
