#include "sim/pose_feed.h"

#include <array>
#include <optional>
#include <stdexcept>
#include <vector>

#include "drivers/line_port.h"
#include "rt/clock.h"
#include "sim/flight_feed.h"

namespace wasp::sim {
namespace {

constexpr DurationNs kTurn = 20 * kMillisecond, kReopen = 200 * kMillisecond, kDeaf = 5 * kSecond;

/// On a line. One that is not there yet, or is lost, is looked for until it is.
class LineFeed : public PoseFeed {
 public:
  LineFeed(const std::string& endpoint, const PoseLinkParams& params, FollowedPose& pose)
      : pose_(pose), link_(params, pose), endpoint_(drivers::Endpoint::parse(endpoint)), name_(endpoint) {}

  void run(const std::atomic<bool>& stop) override {
    open(stop);
    while (line_ && !stop.load(std::memory_order_relaxed)) {
      out_.clear();
      link_.speak(rt::now(), out_);
      if (!out_.empty()) line_->write(out_);  // what finds no room is said again later
      if (line_->wait_readable(rt::now() + kTurn)) read(stop);
      if (rt::now() - heard_at_ns_ > kDeaf) line_->forget_peer();
      complain();
    }
  }

 private:
  void open(const std::atomic<bool>& stop) {
    bool told = false;
    while (!line_ && !stop.load(std::memory_order_relaxed)) {
      try {
        line_.emplace(endpoint_);
      } catch (const std::runtime_error& error) {
        if (!told) pose_.say(std::string("waiting for the autopilot: ") + error.what());
        told = true;
        rt::sleep_until(rt::now() + kReopen);
      }
    }
    opened_at_ns_ = heard_at_ns_ = rt::now();
  }
  void read(const std::atomic<bool>& stop) {
    for (int i = 0; i < 64; ++i) {
      const drivers::IoResult got = line_->read(buffer_);
      if (got.status == drivers::IoStatus::kGone) return reopen(stop);
      if (got.bytes == 0) return;
      link_.receive({buffer_.data(), got.bytes}, rt::now());
      if (!link_.heard()) continue;
      heard_at_ns_ = rt::now();
      line_->adopt_peer();
    }
  }
  void reopen(const std::atomic<bool>& stop) {
    pose_.say("the line " + name_ + " is gone");
    while (!stop.load(std::memory_order_relaxed) && !line_->try_reopen()) rt::sleep_until(rt::now() + kReopen);
    link_.restart();
    opened_at_ns_ = heard_at_ns_ = rt::now();
    complained_ = false;
    pose_.say("the line " + name_ + " is open again");
  }
  /// Once: nobody there, or nothing that is a frame.
  void complain() {
    if (complained_ || link_.heard() || rt::now() - opened_at_ns_ < kDeaf) return;
    complained_ = true;
    const auto& counts = link_.counts();
    pose_.say("no autopilot on " + name_ + " for 5 s: " + std::to_string(counts.bytes) + " bytes, " +
              std::to_string(counts.good) + " frames" +
              (counts.bytes > 0 && counts.good == 0 ? ": wrong baud rate?" : ""));
  }

  FollowedPose& pose_;
  PoseLink link_;
  drivers::Endpoint endpoint_;
  std::optional<drivers::LinePort> line_;
  std::string name_;
  std::vector<std::uint8_t> out_;
  std::array<std::uint8_t, 4096> buffer_{};
  TimeNs opened_at_ns_ = 0, heard_at_ns_ = 0;
  bool complained_ = false;
};

}  // namespace

std::unique_ptr<PoseFeed> make_pose_feed(const std::string& source, const std::string& instance,
                                         const PoseLinkParams& params, FollowedPose& pose) {
  if (source == "flight") return make_flight_feed(instance, pose);
  return std::make_unique<LineFeed>(source, params, pose);
}

}  // namespace wasp::sim
