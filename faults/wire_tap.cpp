#include "faults/wire_tap.h"

#include <poll.h>

#include <algorithm>
#include <array>
#include <mutex>
#include <system_error>

#include "rt/clock.h"

namespace wasp::faults {
namespace {

constexpr int kPriority = 90;  // above all of the flight: what it times is the line
constexpr DurationNs kTurn = 2 * kMillisecond;
constexpr DurationNs kStall = 5 * kMillisecond;

rt::Thread start(std::function<void()> body) {
  rt::ThreadSpec spec{.name = "tap", .policy = rt::Policy::kFifo, .priority = kPriority, .core = 0};
  spec.core = rt::nearest_usable_core(0);
  try {
    return rt::Thread(spec, body);
  } catch (const std::system_error&) {
    return rt::Thread({.name = "tap"}, body);
  }
}

}  // namespace

WireTap::WireTap(const std::string& autopilot_path, std::string link_path)
    : link_path_(std::move(link_path)),
      autopilot_(drivers::Endpoint{autopilot_path, 921600}),
      flight_(std::make_unique<sim::Pty>(link_path_)),
      thread_(start([this] { run(); })) {}

WireTap::~WireTap() { stop_ = true; }

int WireTap::add(const WireFault& fault) {
  const std::scoped_lock lock(mutex_);
  stages_.push_back({next_number_, WireMangler(fault)});
  return next_number_++;
}

void WireTap::remove(int number) {
  const std::scoped_lock lock(mutex_);
  std::erase_if(stages_, [number](const Stage& s) { return s.number == number; });
}

void WireTap::hang_up() {
  const std::scoped_lock lock(mutex_);
  flight_.reset();
}

void WireTap::come_back() {
  const std::scoped_lock lock(mutex_);
  if (!flight_) flight_ = std::make_unique<sim::Pty>(link_path_);
}

void WireTap::inject(Direction direction, std::vector<std::uint8_t> bytes) {
  const std::scoped_lock lock(mutex_);
  write(direction, bytes);
}

std::vector<Stretch> WireTap::stalls() const {
  const std::scoped_lock lock(mutex_);
  return stalls_;
}

void WireTap::run() {
  while (!stop_.load(std::memory_order_relaxed)) turn();
}

void WireTap::turn() {
  std::array<pollfd, 2> fds{{{autopilot_gone_ ? -1 : autopilot_.fd(), POLLIN, 0}, {-1, POLLIN, 0}}};
  {
    const std::scoped_lock lock(mutex_);
    if (flight_) fds[1].fd = flight_->fd();
  }
  const TimeNs from_ns = rt::now();
  const timespec patience = rt::to_timespec(kTurn);
  ppoll(fds.data(), fds.size(), &patience, nullptr);
  const TimeNs now_ns = rt::now();
  const std::scoped_lock lock(mutex_);
  if (now_ns - from_ns > kStall) stalls_.push_back({from_ns, now_ns});
  if ((fds[1].revents & POLLIN) != 0 && flight_)
    if (const auto bytes = flight_->read(); !bytes.empty()) pass(Direction::kToAutopilot, bytes, now_ns);
  if (fds[0].revents != 0) {
    std::array<std::uint8_t, 4096> buffer;
    const auto got = autopilot_.read(buffer);
    if (got.bytes > 0) pass(Direction::kToFlight, std::span(buffer).first(got.bytes), now_ns);
    autopilot_gone_ = got.status == drivers::IoStatus::kGone;  // a dead line is always "ready": not asked again
  }
  if (!stages_.empty()) {
    pass(Direction::kToAutopilot, {}, now_ns);
    pass(Direction::kToFlight, {}, now_ns);
  }
}

void WireTap::pass(Direction direction, std::span<const std::uint8_t> bytes, TimeNs now_ns) {
  if (!bytes.empty()) log_.add(now_ns, direction, bytes);
  std::vector<std::uint8_t> now(bytes.begin(), bytes.end());
  for (Stage& stage : stages_) {
    if (stage.mangler.fault().direction != direction) continue;
    std::vector<std::uint8_t> next;
    if (!now.empty()) stage.mangler.feed(now, now_ns, next);
    stage.mangler.due(now_ns, next);
    now = std::move(next);
  }
  write(direction, now);
}

void WireTap::write(Direction direction, std::span<const std::uint8_t> bytes) {
  if (bytes.empty()) return;
  if (direction == Direction::kToAutopilot)
    autopilot_.write(bytes);
  else if (flight_)
    flight_->write(bytes);
}

}  // namespace wasp::faults
