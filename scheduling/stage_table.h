// Latency of every stage, in shared memory: written wait-free by the thread that owns the row, read while flying.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <string_view>

#include "rt/histogram.h"

namespace wasp::scheduling {

/// One row: e.g. owner "ground_altitude", stage "compute".
struct Stage {
  std::array<char, 32> owner{};
  std::array<char, 32> stage{};
  std::int64_t budget_ns = 0;            ///< 0: no bound stated
  std::atomic<std::uint64_t> misses{0};  ///< samples above the budget
  rt::Histogram histogram;

  /// One writer. Realtime-safe: yes, wait-free.
  void record(DurationNs duration_ns) WASP_REALTIME {
    histogram.record(duration_ns);
    if (budget_ns > 0 && duration_ns > budget_ns)
      misses.store(misses.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }
  [[nodiscard]] std::string_view owner_view() const { return view(owner); }
  [[nodiscard]] std::string_view stage_view() const { return view(stage); }

 private:
  static std::string_view view(const std::array<char, 32>& text) {
    return {text.data(), static_cast<std::size_t>(std::find(text.begin(), text.end(), '\0') - text.begin())};
  }
};

/// Block topic "stages" (type StageTable) of the flight region. Rows are added before arming and never removed.
struct StageTable {
  static constexpr std::size_t kMaxStages = 128;
  std::atomic<std::uint32_t> count{0};
  std::array<Stage, kMaxStages> stages;

  /// Adds a row, or finds it again after a restart. nullptr when the table is full. Realtime-safe: no.
  Stage* add(std::string_view owner, std::string_view stage, DurationNs budget_ns) {
    const std::uint32_t n = count.load();
    Stage* row = nullptr;
    for (std::uint32_t i = 0; i < n && row == nullptr; ++i)
      if (stages[i].owner_view() == owner && stages[i].stage_view() == stage) row = &stages[i];
    if (row == nullptr) {
      if (n == kMaxStages) return nullptr;
      row = &stages[n];
      std::copy_n(owner.begin(), std::min<std::size_t>(owner.size(), 31), row->owner.begin());
      std::copy_n(stage.begin(), std::min<std::size_t>(stage.size(), 31), row->stage.begin());
      count.store(n + 1, std::memory_order_release);
    }
    row->budget_ns = budget_ns;
    return row;
  }
};

/// How a mission stands or ended.
enum class MissionResult : std::uint32_t { kUnderWay = 0, kFlown = 1, kBrokenOff = 2, kStoppedEarly = 3 };

/// How punctual a behaviour is.
enum class BehaviourState : std::uint32_t {
  kPunctual = 0,
  kOverBudget = 1,  ///< its last step was over its budget, or the one under way is: the cue is stale
  kDemoted = 2,     ///< taken out of SCHED_FIFO for this flight
  kOff = 3          ///< not enabled: no thread, no cue ring
};

/// Block topic "run" (type RunStatus): the state of the flight in single words. One writer a word.
struct RunStatus {
  std::atomic<std::uint32_t> real_time{0};   ///< 1: policies and memory lock in force; 0: "not real time"
  std::atomic<std::uint32_t> preempt_rt{0};  ///< 1: PREEMPT_RT kernel
  std::atomic<std::uint32_t> armed{0};
  std::atomic<std::uint32_t> finished{0};         ///< 1: the flight process has ended in order
  std::atomic<std::uint64_t> ticks{0};            ///< control releases served
  std::atomic<std::uint64_t> skipped{0};          ///< control releases skipped
  std::atomic<std::uint64_t> deadline_misses{0};  ///< ticks whose last byte was late or was not written
  std::atomic<std::uint64_t> minor_faults{0};     ///< of real-time threads since arming
  std::atomic<std::uint64_t> major_faults{0};
  std::atomic<std::uint64_t> frames_lost{0};  ///< overwritten while or before a behaviour used them
  std::atomic<std::uint64_t> bad_frames{0};   ///< link frames with a bad checksum
  std::atomic<std::uint64_t> link_reconnects{0};
  std::atomic<std::uint32_t> behaviour_count{0};
  std::array<std::array<char, 32>, 24> behaviours{};  ///< names by Cue::behaviour index
  std::atomic<std::uint32_t> mission_result{0};       ///< MissionResult
  std::atomic<std::uint32_t> incidents{0};            ///< misses of which a file was to be written
  std::atomic<std::uint64_t> commands_refused{0};     ///< too old at the moment they were to go out
  std::atomic<std::uint64_t> setpoints_flushed{0};    ///< times an old setpoint was thrown out of a stalled line
  std::atomic<std::uint64_t> behaviour_ticks{0};      ///< control ticks commanded by behaviours
  std::array<std::atomic<std::uint32_t>, 24> behaviour_state{};  ///< BehaviourState by Cue::behaviour index
  std::atomic<std::uint32_t> faults_armed{0};                    ///< 1: fault points exist in this flight (--faults)
  std::atomic<std::uint32_t> incarnation{0};       ///< 0: first flying process of this flight, n: started again n times
  std::atomic<std::uint64_t> frames_duplicate{0};  ///< the same image, or the same sequence or exposure, once more
  std::atomic<std::uint64_t> frames_stuck{0};      ///< of those, the ones after which the camera counts as frozen
  std::atomic<std::uint64_t> frames_disordered{0};  ///< older than one already used
  std::atomic<std::uint64_t> frames_malformed{0};   ///< of another size or format than the camera promised
  std::atomic<std::uint64_t> frames_misdated{0};    ///< exposed in the future, or too old to be of use
  std::atomic<std::uint64_t> samples_refused{0};    ///< of the autopilot: not finite, implausible, frozen
  std::atomic<std::uint64_t> schedule_thefts{0};    ///< times a thread was found with another policy, priority or core
  std::atomic<std::uint64_t> pages_lost{0};         ///< of shared memory whose file was cut short
  std::array<std::atomic<char>, 128> autopilot{};   ///< what the check before arming found, a line of text
};

}  // namespace wasp::scheduling
