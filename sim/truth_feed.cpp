#include "sim/truth_feed.h"

#include <stdexcept>

#include "rt/clock.h"
#include "shm/topics.h"

namespace wasp::sim {
namespace {

Vec3 to_vec(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

shm::Region attach_truth(const std::string& instance, double patience_s) {
  const TimeNs deadline_ns = rt::now() + from_seconds(patience_s);
  for (;;) {
    try {
      return shm::Region::attach_with_bells(shm::truth_region(instance));
    } catch (const std::exception& error) {
      if (rt::now() > deadline_ns)
        throw std::runtime_error(std::string("no vehicle to look from (start wasp-sim --no-camera): ") + error.what());
    }
    rt::sleep_until(rt::now() + 20 * kMillisecond);
  }
}

}  // namespace

BodyPose pose_of(const Truth& t) {
  return {t.exposed_at_ns,
          to_vec(t.position_ned_m),
          Quat(t.q_ned_body[0], t.q_ned_body[1], t.q_ned_body[2], t.q_ned_body[3]),
          to_vec(t.velocity_ned_mps),
          to_vec(t.rate_body_radps),
          static_cast<double>(t.flight_time_s)};
}

TruthFeed::TruthFeed(const std::string& instance, double patience_s)
    : region_(attach_truth(instance, patience_s)), truth_(region_, shm::kTruth, "Truth") {}

void TruthFeed::run(PoseQueue& poses, const std::atomic<bool>& stop) {
  while (!stop.load(std::memory_order_relaxed)) {
    truth_.wait(rt::now() + 50 * kMillisecond);
    Truth truth;
    while (truth_.read(truth)) poses.push(pose_of(truth));
  }
}

}  // namespace wasp::sim
