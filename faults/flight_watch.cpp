#include "faults/flight_watch.h"

#include <cstring>
#include <optional>

#include "rt/clock.h"
#include "shm/topics.h"

namespace wasp::faults {
namespace {

constexpr DurationNs kLook = 10 * kMillisecond;
constexpr DurationNs kPause = 85 * kMillisecond;  // a tick and a step before cues of that exposure are too old

/// A region and one of its rings, found again while it is not there yet.
struct Attachment {
  std::optional<shm::Region> region;
  std::optional<shm::RingReader> ring;

  bool attach(const std::string& name, const char* topic, const char* type) {
    if (ring) return true;
    try {
      region.emplace(shm::Region::attach(name));
      ring.emplace(*region, topic, type);
      ring->rewind();
    } catch (const std::exception&) {
      region.reset();  // not there yet
    }
    return ring.has_value();
  }
};

FlightCounts counts_of(const shm::Region& region) {
  if (!region.has("run")) return {};
  const auto& entry = region.topic("run", "RunStatus");
  if (entry.payload_bytes < sizeof(scheduling::RunStatus)) return {};
  const auto& s = *reinterpret_cast<const scheduling::RunStatus*>(region.at(entry.offset));
  FlightCounts c;
  c.known = true;
  c.real_time = s.real_time != 0, c.finished = s.finished != 0;
  c.mission_result = s.mission_result, c.faults_armed = s.faults_armed, c.incarnation = s.incarnation;
  c.ticks = s.ticks, c.skipped = s.skipped, c.deadline_misses = s.deadline_misses, c.frames_lost = s.frames_lost;
  c.bad_frames = s.bad_frames, c.link_reconnects = s.link_reconnects, c.commands_refused = s.commands_refused;
  c.samples_refused = s.samples_refused, c.schedule_thefts = s.schedule_thefts, c.pages_lost = s.pages_lost;
  return c;
}

void note_loss(const shm::RingReader& ring, std::uint64_t& lost, Stretch meanwhile, std::vector<Stretch>& unseen) {
  if (ring.lost() != lost) unseen.push_back(meanwhile);
  lost = ring.lost();
}

}  // namespace

struct FlightWatch::Rings {
  Attachment flight, camera, truth;
};

FlightWatch::FlightWatch(std::string instance)
    : instance_(std::move(instance)),
      rings_(std::make_unique<Rings>()),
      thread_({.name = "watch"}, [this] { run(); }) {}

FlightWatch::~FlightWatch() { stop_ = true; }

void FlightWatch::stop() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
  const std::scoped_lock lock(mutex_);
  rings_ = std::make_unique<Rings>();
}

void FlightWatch::run() {
  while (!stop_.load()) {
    look();
    rt::sleep_until(rt::now() + kLook);
  }
}

void FlightWatch::look() {
  const std::scoped_lock lock(mutex_);
  if (rings_->flight.attach(shm::flight_region(instance_), shm::kCommand, "Command")) {
    Command command;
    while (rings_->flight.ring->read(command)) {
      if (commands_.empty() || commands_.back().mission_phase != command.mission_phase)
        phase_since_ns_ = command.due_at_ns;
      const TimeNs before_ns = commands_.empty() ? command.released_at_ns : commands_.back().released_at_ns;
      note_loss(*rings_->flight.ring, commands_lost_, {before_ns, command.released_at_ns + kSecond}, commands_unseen_);
      commands_.push_back(command);
    }
    counts_ = counts_of(*rings_->flight.region);
  }
  if (rings_->camera.attach(shm::camera_region(instance_), shm::kGray, "Frame")) {
    while (const shm::Sample sample = rings_->camera.ring->next()) {
      FrameHeader header;
      std::memcpy(&header, sample.data, sizeof header);
      if (!rings_->camera.ring->intact(sample)) rings_->camera.ring->count_lost();
      const TimeNs before_ns = exposures_.empty() ? header.exposed_at_ns : exposures_.back();
      note_loss(*rings_->camera.ring, exposures_lost_, {before_ns, header.exposed_at_ns}, exposures_unseen_);
      exposures_.push_back(header.exposed_at_ns);
      if (sample.published_at_ns - before_ns > kPause) camera_pauses_.push_back({before_ns, sample.published_at_ns});
    }
  }
  if (rings_->truth.attach(shm::truth_region(instance_), shm::kTruth, "Truth")) rings_->truth.ring->copy_newest(truth_);
}

Command FlightWatch::newest() const {
  const std::scoped_lock lock(mutex_);
  return commands_.empty() ? Command{} : commands_.back();
}

TimeNs FlightWatch::phase_since_ns() const {
  const std::scoped_lock lock(mutex_);
  return phase_since_ns_;
}

std::vector<Command> FlightWatch::commands() const {
  const std::scoped_lock lock(mutex_);
  return commands_;
}

std::vector<Stretch> FlightWatch::commands_unseen() const {
  const std::scoped_lock lock(mutex_);
  return commands_unseen_;
}

std::vector<Stretch> FlightWatch::exposures_unseen() const {
  const std::scoped_lock lock(mutex_);
  return exposures_unseen_;
}

std::vector<TimeNs> FlightWatch::exposures() const {
  const std::scoped_lock lock(mutex_);
  return exposures_;
}

std::vector<Stretch> FlightWatch::camera_pauses() const {
  const std::scoped_lock lock(mutex_);
  return camera_pauses_;
}

FlightCounts FlightWatch::counts() const {
  const std::scoped_lock lock(mutex_);
  return counts_;
}

Truth FlightWatch::truth() const {
  const std::scoped_lock lock(mutex_);
  return truth_;
}

}  // namespace wasp::faults
