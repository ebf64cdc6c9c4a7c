#include "benchmarks/latency_observer.h"

#include "shm/topics.h"
#include "tools/latency_summary.h"

namespace wasp::bench {
namespace {

template <class T>
void drain(shm::RingReader& reader, std::vector<Published<T>>& seen) {
  for (std::uint32_t i = 0; i < 2 * reader.slots(); ++i) {
    const std::uint64_t lost = reader.lost();
    const shm::Sample sample = reader.next();
    if (!sample && reader.lost() == lost) break;
    if (!sample) continue;
    Published<T> p;
    rt::load_words(p.value, reinterpret_cast<const T*>(sample.data));
    p.at_ns = sample.published_at_ns;
    if (reader.intact(sample))
      seen.push_back(p);
    else
      reader.count_lost();
  }
}

}  // namespace

bool FlightObserver::attach() {
  if (region_) return true;
  try {
    auto region = std::make_unique<shm::Region>(shm::Region::attach(shm::flight_region(instance_)));
    const auto run = tools::read_run(*region);
    if (!run.present || run.behaviours.empty()) return false;
    commands_ = std::make_unique<shm::RingReader>(*region, shm::kCommand, "Command");
    for (const auto& name : run.behaviours) {
      if (!region->has(shm::cue_topic(name))) continue;  // not enabled
      cue_readers_.emplace_back(*region, shm::cue_topic(name), "Cue");
      behaviours_.push_back(name);
    }
    cues_.resize(behaviours_.size());
    region_ = std::move(region);
  } catch (const std::exception&) {
    return false;  // not there yet: look again later
  }
  return true;
}

void FlightObserver::look() {
  if (!attach()) return;
  drain(*commands_, ticks_);
  for (std::size_t i = 0; i < cue_readers_.size(); ++i) drain(cue_readers_[i], cues_[i]);
}

std::size_t FlightObserver::lost() const {
  std::size_t sum = commands_ ? commands_->lost() : 0;
  for (const auto& reader : cue_readers_) sum += reader.lost();
  return sum;
}

void FlightObserver::forget() {
  look();
  ticks_.clear();
  for (auto& c : cues_) c.clear();
  lost_before_ = lost();
}

void FlightObserver::hand_over(PairData& data) {
  look();
  data.lost = lost() - lost_before_;
  if (region_) data.run = tools::read_run(*region_);
  data.behaviours = behaviours_;
  data.ticks = std::move(ticks_);
  data.cues = std::move(cues_);
  ticks_.clear();
  cues_.assign(behaviours_.size(), {});
}

}  // namespace wasp::bench
