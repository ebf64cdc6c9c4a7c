// A behaviour that never comes back, at SCHED_FIFO 50 on the control thread's core: control keeps every tick, and the
// supervisor takes the behaviour out of SCHED_FIFO before the kernel throttles that core's real-time threads. Beside it
// the negative control: the same above control's priority.
#include <gtest/gtest.h>
#include <sched.h>

#include "scheduling/behaviour_loop.h"
#include "scheduling/supervisor.h"
#include "tests/scheduling/control_bench.h"

namespace wasp::scheduling {
namespace {

std::atomic<bool> spin{false};

/// Spins for as long as it is told to, which a behaviour must not.
struct Spinner {
  static constexpr std::string_view kName = "spinner";
  static constexpr DurationNs kBudgetNs = 4 * kMillisecond;
  static constexpr Stream kStream = Stream::kGray;
  struct Params {};
  struct State {};
  static CueBody step(const Params&, const BehaviourInput&, State&) noexcept {
    while (spin.load(std::memory_order_relaxed)) {
    }
    return {};
  }
};

bool fifo_granted() {
  sched_param before{}, wanted{};
  sched_getparam(0, &before);
  wanted.sched_priority = 90;
  const int policy = sched_getscheduler(0);
  if (sched_setscheduler(0, SCHED_FIFO, &wanted) != 0) return false;
  return sched_setscheduler(0, policy, &before) == 0;
}

/// The highest thread of the core, on a grid of its own: what it overruns, the host has done.
class Reference {
 public:
  explicit Reference(int core)
      : thread_({.name = "reference", .policy = rt::Policy::kFifo, .priority = 95, .core = core}, [this] {
          rt::PeriodicGrid grid(rt::now(), 5 * kMillisecond);
          while (!stop_) {
            const rt::Release r = rt::wait_next(grid);
            if (r.skipped > 0 || r.released_at_ns - r.due_at_ns > kMillisecond) ++overruns_;
          }
        }) {}
  ~Reference() { stop_ = true; }
  Reference(const Reference&) = delete;
  Reference& operator=(const Reference&) = delete;
  [[nodiscard]] int overruns() const { return overruns_; }

 private:
  std::atomic<bool> stop_{false};
  std::atomic<int> overruns_{0};
  rt::Thread thread_;
};

/// A camera that shows one frame, a spinner that takes it, control on the same core.
class StarvationTest : public ::testing::Test {
 protected:
  StarvationTest()
      : camera_name_(shm::camera_region("test-starve-" + std::to_string(getpid()))),
        camera_(shm::Region::create(camera_name_, topics())) {}
  ~StarvationTest() override { shm::Region::remove(camera_name_); }
  static std::vector<shm::TopicSpec> topics() {
    return {{shm::kGray, "Frame", shm::TopicKind::kRing, 4, kFramePixelOffset + 64}};
  }

  void show_a_frame() {
    shm::RingWriter ring(camera_, shm::kGray);
    FrameHeader h;
    h.format = PixelFormat::kMono8;
    h.width_px = h.stride_bytes = 16;
    h.height_px = 4;
    std::memcpy(ring.loan(), &h, sizeof h);
    ring.publish(rt::now());
  }

  /// Flies with the spinner at `priority` for `seconds` of spinning; true if the host kept out of it.
  bool fly_beside_spinner(int priority, DurationNs spin_ns) {
    skipped_ = missed_ = demoted_ = 0;
    log_.clear();
    shm::RingWriter(camera_, shm::kGray);  // takes over: frames of the attempt before are history
    const int core = rt::nearest_usable_core(1);
    ControlBench bench(
        {.control_thread = {.name = "control", .policy = rt::Policy::kFifo, .priority = 80, .core = core}});
    ThreadWatch& watch = bench.board.add({"spinner", core, priority, Spinner::kBudgetNs, true});
    SupervisorOptions options;
    options.incidents = 0;
    Supervisor supervisor(bench.board, bench.status(), options, [this](const std::string& l) { log_ += l + "\n"; });
    BehaviourWiring wiring;
    wiring.camera = &camera_;
    wiring.flight = &bench.flight_region();
    wiring.budget_ns = Spinner::kBudgetNs;
    wiring.stages = &bench.stages();
    wiring.watch = &watch;
    BehaviourLoop<SpinnerAsMaker> loop({}, wiring);
    spin = true;
    Reference reference(core);
    rt::Thread behaviour({.name = "spinner", .policy = rt::Policy::kFifo, .priority = priority, .core = core},
                         [&] { loop.run(bench.control); });
    bench.start(&watch);
    EXPECT_TRUE(bench.wait_until_flying());
    const auto skipped_before = bench.status().skipped.load(), missed_before = bench.status().deadline_misses.load();
    const int overruns_before = reference.overruns();
    show_a_frame();
    for (const TimeNs until = rt::now() + spin_ns; rt::now() < until;) {
      rt::sleep_until(rt::now() + Supervisor::kPeriod);
      supervisor.look();
    }
    spin = false;
    const std::uint64_t now_at = bench.commands.empty() ? 0 : bench.commands.back().tick;
    EXPECT_TRUE(bench.wait_for_tick(now_at + 3));
    skipped_ = bench.status().skipped.load() - skipped_before;
    missed_ = bench.status().deadline_misses.load() - missed_before;
    demoted_ = watch.demoted.load();
    policy_ = sched_getscheduler(watch.tid.load());
    state_ = bench.status().behaviour_state[0].load();
    bench.end();
    return reference.overruns() == overruns_before;
  }

  /// The spinner under the name of the bench's one behaviour.
  struct SpinnerAsMaker : Spinner {
    static constexpr std::string_view kName = "maker";
  };

  std::string camera_name_;
  shm::Region camera_;
  std::uint64_t skipped_ = 0, missed_ = 0;
  std::uint32_t demoted_ = 0, state_ = 0;
  int policy_ = -1;
  std::string log_;
};

TEST_F(StarvationTest, ABehaviourThatSpinsForEverCannotStarveControl) {
  if (!fifo_granted()) GTEST_SKIP() << "SCHED_FIFO is not granted here";
  bool on_a_quiet_host = false;
  for (int attempt = 0; attempt < 5; ++attempt) {
    const bool quiet_host = fly_beside_spinner(50, 3 * kSecond);
    EXPECT_EQ(demoted_, 1u) << log_;
    EXPECT_EQ(policy_, SCHED_OTHER);
    EXPECT_EQ(state_, static_cast<std::uint32_t>(BehaviourState::kDemoted));
    EXPECT_NE(log_.find("demoted to SCHED_OTHER"), std::string::npos) << log_;
    if (skipped_ + missed_ == 0) return;
    // Until the spinner is demoted the kernel's fair server may take the core for threads it starved, control's with
    // it, and the more of them a busy machine runs the likelier; a control thread that is starved loses ticks every
    // time.
    on_a_quiet_host = on_a_quiet_host || quiet_host;
  }
  if (on_a_quiet_host)
    FAIL() << "ticks lost in every attempt; in the last " << skipped_ << " skipped, " << missed_ << " missed";
  GTEST_SKIP() << "the host stood still in every attempt: nothing can be said of missed ticks";
}

TEST_F(StarvationTest, AboveControlTheSameSpinnerDoesStarveIt) {
  if (!fifo_granted()) GTEST_SKIP() << "SCHED_FIFO is not granted here";
  fly_beside_spinner(90, 400 * kMillisecond);
  EXPECT_GT(skipped_ + missed_, 0u);  // the test above can fail
}

}  // namespace
}  // namespace wasp::scheduling
