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

}  // namespace

std::vector<shm::TopicSpec> CameraLoop::topics(int width_px, int height_px) {
  const auto pixels = static_cast<std::uint64_t>(width_px) * static_cast<std::uint64_t>(height_px);
  return {{shm::kGray, "Frame", shm::TopicKind::kRing, shm::kFrameSlots, kFramePixelOffset + pixels},
          {shm::kDepth, "Frame", shm::TopicKind::kRing, shm::kFrameSlots, kFramePixelOffset + 2 * pixels}};
}

CameraLoop::CameraLoop(SimCamera& camera, TimeNs start_ns, double rate_hz, const shm::Region& region, PoseQueue& poses)
    : camera_(camera),
      grid_(start_ns, from_seconds(1 / rate_hz)),
      gray_(region, shm::kGray, "Frame"),
      depth_(region, shm::kDepth, "Frame"),
      poses_(poses) {}

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

void CameraLoop::publish(const BodyPose& pose, std::uint32_t sequence) {
  std::byte* gray = gray_.loan();
  std::byte* depth = depth_.loan();
  const FrameHeader gray_header = header_of(camera_, PixelFormat::kMono8, 1, pose.at_ns, sequence);
  const FrameHeader depth_header = header_of(camera_, PixelFormat::kDepth16Mm, 2, pose.at_ns, sequence);
  std::memcpy(gray, &gray_header, sizeof gray_header);
  std::memcpy(depth, &depth_header, sizeof depth_header);
  const auto announce = [this] {
    gray_.announce();
    depth_.announce();
    announced_at_ns_ = rt::now();
  };
  camera_.render(pose, sequence, reinterpret_cast<std::uint8_t*>(gray + kFramePixelOffset),
                 reinterpret_cast<std::uint16_t*>(depth + kFramePixelOffset), announce);
  gray_.publish(rt::now());
  depth_.publish(rt::now());
  lead_.record(rt::now() - announced_at_ns_);
}

void CameraLoop::run(const std::atomic<bool>& stop) {
  while (!stop.load(std::memory_order_relaxed)) {
    const rt::Release release = rt::wait_next(grid_);
    skipped_ += release.skipped;
    BodyPose pose;
    if (!pose_at(release.due_at_ns, stop, pose)) {
      if (!stop.load(std::memory_order_relaxed)) ++skipped_;
      continue;
    }
    const TimeNs began_ns = rt::now();
    publish(pose, static_cast<std::uint32_t>(release.index));
    render_time_.record(rt::now() - began_ns);
  }
}

}  // namespace wasp::sim
