#include "benchmarks/observers_killed.h"

#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <deque>
#include <new>
#include <random>

#include "benchmarks/child.h"
#include "benchmarks/ipc_run.h"
#include "benchmarks/tormentor.h"
#include "rt/clock.h"
#include "rt/periodic.h"
#include "scheduling/flight_regions.h"
#include "shm/broadcast_ring.h"
#include "shm/topics.h"

namespace wasp::bench {
namespace {

constexpr std::size_t kKept = 1 << 19;  ///< times of a block; later ones are left out

/// A ring, and how many ticks of the writer pass between its messages. Ten of the flight's, two of the camera's.
struct Topic {
  bool of_camera;
  const char* name;
  std::uint32_t every;
};
constexpr std::array<Topic, 8> kTopics = {{{false, shm::kImu, 1},
                                           {false, shm::kAttitude, 2},
                                           {false, shm::kCommand, 10},
                                           {false, "cue.one", 7},
                                           {false, "cue.two", 7},
                                           {false, "cue.three", 11},
                                           {true, shm::kDepth, 20},
                                           {true, shm::kGray, 20}}};

/// Between parent, writer and observers.
struct Shared {
  std::atomic<std::uint32_t> ready, stop;
  bool careful;
  std::atomic<std::uint64_t> accepted, dropped, torn, backwards;
  std::atomic<std::size_t> messages, frames, ticks;
  std::array<std::int64_t, kKept> message_ns, frame_ns, late_ns;
};

Shared* shared_page() {
  void* page = mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  return page == MAP_FAILED ? nullptr : new (page) Shared;
}

constexpr std::uint64_t first_word(std::size_t topic, std::uint64_t n) {
  return n * 0x9E3779B97F4A7C15ull + topic * 0xC2B2AE3D27D4EB4Full;
}
constexpr std::uint64_t kStep = 0x165667B19E3779F9ull;  ///< from word to word

void fill(std::byte* loan, std::uint64_t bytes, std::uint64_t word) {
  auto* words = reinterpret_cast<std::uint64_t*>(loan);
  for (std::uint64_t i = 0; i < bytes / 8; ++i, word += kStep) __atomic_store_n(words + i, word, __ATOMIC_RELAXED);
}

/// The writer's regions, as a flight and a camera make them.
struct Regions {
  shm::Region flight, camera;

  static Regions create(const std::string& instance) {
    const std::vector<shm::TopicSpec> camera{
        {shm::kGray, "Frame", shm::TopicKind::kRing, shm::kFrameSlots, kFrameBytes},
        {shm::kDepth, "Frame", shm::TopicKind::kRing, shm::kFrameSlots, kFramePixelOffset + 2 * kPixels}};
    return {scheduling::create_flight_region(instance, {.names = {"one", "two", "three"}}, false),
            shm::Region::create(shm::camera_region(instance), camera)};
  }
  static Regions attach(const std::string& instance, bool with_bells) {
    const auto open = with_bells ? &shm::Region::attach_with_bells : &shm::Region::attach;
    return {open(shm::flight_region(instance)), open(shm::camera_region(instance))};
  }
  [[nodiscard]] const shm::Region& of(const Topic& topic) const { return topic.of_camera ? camera : flight; }
};

void keep(std::array<std::int64_t, kKept>& times, std::atomic<std::size_t>& count, std::int64_t time_ns) {
  if (const std::size_t i = count.load(std::memory_order_relaxed); i < kKept) {
    times[i] = time_ns;
    count.store(i + 1, std::memory_order_relaxed);
  }
}

int write_until_told(const std::string& instance, DurationNs tick_ns, Shared& shared) {
  const Regions regions = Regions::create(instance);
  std::deque<shm::RingWriter> rings;
  for (const Topic& topic : kTopics) rings.emplace_back(regions.of(topic), topic.name);
  shared.ready = 1;
  rt::PeriodicGrid grid(rt::now() + 10 * kMillisecond, tick_ns);
  for (std::uint64_t tick = 1; shared.stop.load(std::memory_order_relaxed) == 0; ++tick) {
    const rt::Release release = grid.next(rt::now());
    rt::sleep_until(release.due_at_ns);
    keep(shared.late_ns, shared.ticks, rt::now() - release.due_at_ns);
    for (std::size_t t = 0; t < kTopics.size(); ++t) {
      if (tick % kTopics[t].every != 0) continue;
      shm::RingWriter& ring = rings[t];
      const TimeNs began = rt::now();
      fill(ring.loan(), ring.payload_bytes(), first_word(t, ring.published() + 1));
      ring.publish(began);
      const DurationNs took_ns = rt::now() - began;
      if (!kTopics[t].of_camera) keep(shared.message_ns, shared.messages, took_ns);
      if (kTopics[t].name == std::string_view(shm::kGray)) keep(shared.frame_ns, shared.frames, took_ns);
    }
  }
  return 0;
}

/// Woken by the bell of the grey image; looks now and then; or takes the oldest there is, under the writer's pen.
enum class Habit { kSleeps, kLooks, kLooksBack };
constexpr std::array kHabits = {Habit::kSleeps, Habit::kLooks, Habit::kLooksBack};

/// Copies every message it can get of every ring, as a recorder does, and judges what it accepted.
class Observer {
 public:
  Observer(const std::string& instance, bool with_bells, Shared& shared)
      : regions_(Regions::attach(instance, with_bells)), shared_(shared) {
    for (const Topic& topic : kTopics) readers_.emplace_back(regions_.of(topic), topic.name);
    copy_.resize(kFramePixelOffset + 2 * kPixels);
  }
  [[noreturn]] void observe(Habit habit) {
    for (;;) {
      for (std::size_t t = 0; t < readers_.size(); ++t) {
        if (habit == Habit::kLooksBack) readers_[t].rewind(), last_[t] = 0;
        for (int i = 0; i < 8 && take(t); ++i) {
        }
      }
      if (habit == Habit::kSleeps)
        readers_.back().wait(rt::now() + 50 * kMillisecond);
      else
        rt::sleep_until(rt::now() + kMillisecond / 2);
    }
  }

 private:
  bool take(std::size_t t) {
    shm::RingReader& reader = readers_[t];
    const shm::Sample sample = reader.next();
    if (!sample) return false;
    const std::size_t words = reader.payload_bytes() / 8;
    const auto* from = reinterpret_cast<const std::uint64_t*>(sample.data);
    for (std::size_t i = 0; i < words; ++i) copy_[i] = __atomic_load_n(from + i, __ATOMIC_RELAXED);
    if (shared_.careful && !reader.intact(sample)) {
      reader.count_lost();
      shared_.dropped.fetch_add(1, std::memory_order_relaxed);
      return true;
    }
    std::uint64_t word = first_word(t, sample.number);
    bool whole = true;
    for (std::size_t i = 0; i < words; ++i, word += kStep) whole &= copy_[i] == word;
    shared_.accepted.fetch_add(1, std::memory_order_relaxed);
    if (!whole) shared_.torn.fetch_add(1);
    if (sample.number <= last_[t]) shared_.backwards.fetch_add(1);
    last_[t] = sample.number;
    return true;
  }

  Regions regions_;
  Shared& shared_;
  std::deque<shm::RingReader> readers_;
  std::vector<std::uint64_t> copy_;
  std::array<std::uint64_t, kTopics.size()> last_{};
};

/// As much work as an observer's, on memory of its own.
[[noreturn]] void stand_by(const std::string& instance) {
  const Regions regions = Regions::attach(instance, false);
  const std::vector<std::uint64_t> own(kFramePixelOffset + 2 * kPixels, 1);
  std::vector<std::uint64_t> copy(own.size());
  for (;;) {
    for (std::size_t i = 0; i < own.size() / 8; ++i) copy[i] = __atomic_load_n(&own[i], __ATOMIC_RELAXED);
    rt::sleep_until(rt::now() + kMillisecond);
  }
}

void append(std::vector<std::int64_t>& to, const std::array<std::int64_t, kKept>& from, std::size_t count) {
  to.insert(to.end(), from.begin(), from.begin() + static_cast<std::ptrdiff_t>(count));
}

/// One writer's life, an observer of each habit, as many bystanders; those of one kind are tormented until so many have
/// died.
bool run_block(const std::string& instance, const KillOptions& options, bool torment_observers, unsigned seed,
               std::uint64_t kills, Shared& shared, Torments& torments, WriterTimes& times) {
  const Placement placement = choose_placement();
  shared.ready = shared.stop = 0;
  shared.messages = shared.frames = shared.ticks = 0;
  const pid_t writer =
      start(placement.writer_core, placement.fifo, [&] { return write_until_told(instance, options.tick_ns, shared); });
  const TimeNs patience = rt::now() + 60 * kSecond;
  while (shared.ready.load() == 0 && rt::now() < patience) rt::sleep_until(rt::now() + kMillisecond);
  const std::uint64_t enough = torments.deaths + kills;
  {
    Torments of_the_others;
    std::deque<Tormentor> observers, bystanders;
    for (const Habit habit : kHabits) {
      const unsigned own_seed = seed * 8 + static_cast<unsigned>(habit);
      observers.emplace_back(
          [&, habit] {
            return start(placement.reader_core, false,
                         [&]() -> int { Observer(instance, habit == Habit::kSleeps, shared).observe(habit); });
          },
          own_seed, torment_observers ? torments : of_the_others);
      bystanders.emplace_back([&] { return start(placement.reader_core, false, [&]() -> int { stand_by(instance); }); },
                              own_seed + 4, torment_observers ? of_the_others : torments);
    }
    std::mt19937 random(seed);
    while (torments.deaths < enough && !interrupted()) {
      rt::sleep_until(rt::now() + static_cast<DurationNs>(random() % 4000) * kMicrosecond);
      (torment_observers ? observers : bystanders)[random() % kHabits.size()].act();
    }
  }
  shared.stop = 1;
  const bool ok = finish(writer, 60);
  append(times.message_ns, shared.message_ns, shared.messages);
  append(times.frame_ns, shared.frame_ns, shared.frames);
  append(times.late_ns, shared.late_ns, shared.ticks);
  return ok && shared.ready.load() != 0 && !interrupted();
}

/// No slot may have fallen out of use: each holds one of the newest messages.
void count_slots(const std::string& instance, KillResult& result) {
  const Regions regions = Regions::attach(instance, false);
  for (const Topic& topic : kTopics) {
    const shm::RingReader ring(regions.of(topic), topic.name);
    const std::uint64_t newest = ring.newest();
    result.published += newest;
    result.slots += ring.slots();
    for (std::uint64_t i = 0; i < ring.slots(); ++i)
      result.slots_leaked += newest > i && !ring.look(newest - i) ? 1 : 0;
  }
}

}  // namespace

KillResult torment_observers(const KillOptions& options) {
  KillResult result;
  Shared* shared = shared_page();
  if (shared == nullptr) return result.trouble = "no shared memory", result;
  const std::string instance = "observed." + std::to_string(getpid());
  Torments torments, nobody;
  shared->careful = options.careful;
  unsigned seed = 0;
  while (torments.deaths < options.kills && result.trouble.empty()) {
    const std::uint64_t kills = std::min(options.kills - torments.deaths, options.kills_a_block);
    const bool ok = run_block(instance, options, false, seed, kills, *shared, nobody, result.spared) &&
                    run_block(instance, options, true, seed, kills, *shared, torments, result.tormented);
    if (!ok) result.trouble = interrupted() ? "interrupted" : "the writer failed";
    ++seed;
  }
  result.deaths = torments.deaths, result.freezes = torments.freezes;
  result.accepted = shared->accepted, result.dropped = shared->dropped;
  result.torn = shared->torn, result.backwards = shared->backwards;
  if (result.trouble.empty()) count_slots(instance, result);
  shm::Region::remove(shm::flight_region(instance));
  shm::Region::remove(shm::camera_region(instance));
  munmap(shared, sizeof(Shared));
  return result;
}

}  // namespace wasp::bench
