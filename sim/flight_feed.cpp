#include "sim/flight_feed.h"

#include <optional>

#include "rt/clock.h"
#include "shm/broadcast_ring.h"
#include "shm/topics.h"
#include "types/messages.h"
#include "types/position_sample.h"

namespace wasp::sim {
namespace {

constexpr DurationNs kTurn = 2 * kMillisecond, kLook = 100 * kMillisecond, kCheck = kSecond;

class FlightFeed : public PoseFeed {
 public:
  FlightFeed(std::string instance, FollowedPose& pose) : name_(shm::flight_region(instance)), pose_(pose) {}

  void run(const std::atomic<bool>& stop) override {
    while (!stop.load(std::memory_order_relaxed)) {
      if (auto region = attach()) follow(*region, stop);
      rt::sleep_until(rt::now() + kLook);
    }
  }

 private:
  [[nodiscard]] std::optional<shm::Region> attach() const {
    try {
      auto region = shm::Region::attach(name_);
      if (region.writer_alive()) return region;
    } catch (const std::exception&) {  // none yet
    }
    return std::nullopt;
  }

  /// Until the flight has ended: its region then belongs to nobody, or to the next one.
  void follow(const shm::Region& region, const std::atomic<bool>& stop) {
    shm::RingReader attitudes(region, shm::kAttitude, "Attitude"), positions(region, shm::kPosition, "Position");
    pose_.say("following " + name_);
    TimeNs check_at_ns = rt::now() + kCheck;
    while (!stop.load(std::memory_order_relaxed)) {
      take(attitudes, positions);
      if (rt::now() >= check_at_ns) {
        if (!region.writer_alive()) break;
        check_at_ns = rt::now() + kCheck;
      }
      rt::sleep_until(rt::now() + kTurn);
    }
    pose_.restarted();
  }

  void take(shm::RingReader& attitudes, shm::RingReader& positions) {
    AttitudeSample a;
    while (attitudes.read(a)) {
      const auto& q = a.q_ned_body;
      const auto& r = a.rate_body_radps;
      pose_.attitude({a.exposed_at_ns, Quat(q[0], q[1], q[2], q[3]), {r[0], r[1], r[2]}}, rt::now());
    }
    PositionSample p;
    while (positions.read(p)) {
      const auto& x = p.position_ned_m;
      const auto& v = p.velocity_ned_mps;
      pose_.armed(p.armed != 0);
      pose_.position({Eigen::Vector3f(x[0], x[1], x[2]).cast<double>(), {v[0], v[1], v[2]}}, p.exposed_at_ns,
                     rt::now());
    }
  }

  std::string name_;
  FollowedPose& pose_;
};

}  // namespace

std::unique_ptr<PoseFeed> make_flight_feed(const std::string& instance, FollowedPose& pose) {
  return std::make_unique<FlightFeed>(instance, pose);
}

}  // namespace wasp::sim
