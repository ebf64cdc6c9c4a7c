// The adaptor with a made-up behaviour: cues carry what the step was given and every part of its latency.
#include "scheduling/behaviour_loop.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <thread>

#include "rt/clock.h"
#include "scheduling/flight_regions.h"

namespace wasp::scheduling {
namespace {

/// Says the mean of the first row as a height; spins when told to.
struct Mean {
  static constexpr std::string_view kName = "mean";
  static constexpr DurationNs kBudgetNs = 50 * kMillisecond;
  static constexpr Stream kStream = Stream::kGray;
  struct Params {};
  struct State {
    std::uint32_t steps = 0;
  };
  static CueBody step(const Params&, const BehaviourInput& in, State& state) noexcept {
    CueBody body;
    int sum = 0;
    for (int u = 0; u < in.gray.width_px; ++u) sum += in.gray.row(0)[u];
    body.validity = Validity::kValid;
    body.has_height = 1;
    body.height_m = static_cast<float>(sum) / static_cast<float>(in.gray.width_px);
    body.detail[0] = in.attitude_valid ? in.attitude.q_ned_body[1] : -1.f;
    body.detail[1] = static_cast<float>(++state.steps);
    body.detail[2] = in.accel_valid ? in.accel_body_mps2[2] : -1.f;
    return body;
  }
};

class BehaviourLoopTest : public ::testing::Test {
 protected:
  static constexpr std::uint32_t kWidth = 32, kHeight = 16;
  BehaviourLoopTest()
      : instance_("test-loop-" + std::to_string(getpid())),
        camera_(shm::Region::create(shm::camera_region(instance_), camera_topics())),
        flight_(create_flight_region(instance_, {.names = {"mean"}}, false)),
        gray_(camera_, shm::kGray),
        attitude_(flight_, shm::kAttitude),
        cues_(flight_, shm::cue_topic("mean"), "Cue") {
    control_.status = &run_status(flight_);
  }
  ~BehaviourLoopTest() override {
    shm::Region::remove(shm::camera_region(instance_));
    shm::Region::remove(shm::flight_region(instance_));
  }
  static std::vector<shm::TopicSpec> camera_topics() {
    return {{shm::kGray, "Frame", shm::TopicKind::kRing, shm::kFrameSlots, kFramePixelOffset + kWidth * kHeight}};
  }
  BehaviourWiring wiring() {
    BehaviourWiring w;
    w.camera = &camera_;
    w.flight = &flight_;
    w.budget_ns = Mean::kBudgetNs;
    w.stages = &stage_table(flight_);
    w.watch = &board_.add({"mean", -1, 0, Mean::kBudgetNs});
    return w;
  }
  void publish_frame(std::uint32_t sequence, std::uint8_t value, TimeNs exposed_at_ns, std::uint32_t stride = kWidth) {
    std::byte* slot = gray_.loan();
    FrameHeader h;
    h.exposed_at_ns = exposed_at_ns;
    h.sequence = sequence;
    h.format = PixelFormat::kMono8;
    h.width_px = kWidth;
    h.height_px = kHeight;
    h.stride_bytes = stride;
    std::memcpy(slot, &h, sizeof h);
    std::memset(slot + kFramePixelOffset, value, kWidth * kHeight);
    gray_.publish(rt::now());
  }
  Cue wait_for_cue() {
    Cue cue;
    for (int i = 0; i < 60'000 && !cues_.read(cue); ++i) rt::sleep_until(rt::now() + kMillisecond);
    return cue;
  }
  template <class Body>
  void with_loop(const BehaviourWiring& w, Body&& body) {
    BehaviourLoop<Mean> loop({}, w);
    std::thread thread([&] { loop.run(control_); });
    body();
    control_.stop = true;
    thread.join();
  }

  std::string instance_;
  shm::Region camera_, flight_;
  shm::RingWriter gray_, attitude_;
  shm::RingReader cues_;
  LoopControl control_;
  WatchBoard board_;
};

TEST_F(BehaviourLoopTest, CueCarriesInputsAndTimes) {
  const TimeNs exposed = rt::now();
  AttitudeSample early, late;
  early.exposed_at_ns = exposed - 5 * kMillisecond;
  early.rate_body_radps = {2, 0, 0};
  late.exposed_at_ns = exposed + 5 * kMillisecond;  // gives its rates to the turn from the one before, no more
  late.q_ned_body = {0, 1, 0, 0};
  late.rate_body_radps = {4, 0, 0};
  attitude_.write(early, exposed);
  attitude_.write(late, exposed);
  with_loop(wiring(), [&] {
    publish_frame(9, 40, exposed);
    const Cue cue = wait_for_cue();
    EXPECT_EQ(cue.frame_sequence, 9u);
    EXPECT_EQ(cue.exposed_at_ns, exposed);
    EXPECT_FLOAT_EQ(cue.body.height_m, 40.f);
    EXPECT_EQ(cue.attitude_valid, 1u);
    EXPECT_NEAR(cue.body.detail[0], std::sin(0.5f * 0.005f * 2.5f), 1e-7f);
    EXPECT_FLOAT_EQ(cue.rate_body_radps[0], 3.f);
    EXPECT_LE(cue.exposed_at_ns, cue.released_at_ns);
    EXPECT_LE(cue.released_at_ns, cue.started_at_ns);
    EXPECT_LE(cue.started_at_ns, cue.finished_at_ns);
  });
  const StageTable& stages = stage_table(flight_);
  ASSERT_EQ(stages.count.load(), 2u);
  EXPECT_EQ(stages.stages[0].histogram.count(), 1u);
  EXPECT_EQ(stages.stages[1].histogram.count(), 1u);
}

TEST_F(BehaviourLoopTest, SpecificForceIsTheMeanBetweenExposuresWithoutAGap) {
  shm::RingWriter imu(flight_, shm::kImu);
  const auto sense = [&](TimeNs at_ns, float accel_z_mps2) {
    ImuSample sample;
    sample.exposed_at_ns = at_ns;
    sample.accel_body_mps2 = {0, 0, accel_z_mps2};
    imu.write(sample, at_ns);
  };
  sense(5, 100);  // before the loop was made
  with_loop(wiring(), [&] {
    for (int i = 1; i <= 4; ++i) sense(10 * i, static_cast<float>(i));
    publish_frame(1, 0, 20);
    const Cue first = wait_for_cue();
    EXPECT_EQ(first.accel_valid, 0u);  // nothing says since when
    EXPECT_FLOAT_EQ(first.body.detail[2], -1.f);
    sense(50, 5);
    publish_frame(2, 0, 45);
    const Cue second = wait_for_cue();
    EXPECT_EQ(second.accel_valid, 1u);
    EXPECT_FLOAT_EQ(second.body.detail[2], 3.5f);  // of 30 and 40
    EXPECT_FLOAT_EQ(second.accel_body_mps2[2], 3.5f);
    publish_frame(3, 0, 60);
    EXPECT_FLOAT_EQ(wait_for_cue().body.detail[2], 5.f);
    publish_frame(4, 0, 70);
    EXPECT_EQ(wait_for_cue().accel_valid, 0u);  // nothing new
  });
}

TEST_F(BehaviourLoopTest, AHeaderThatLiesIsNotFollowed) {
  with_loop(wiring(), [&] {
    publish_frame(1, 40, rt::now(), 1u << 20);  // a stride beyond the slot
    publish_frame(2, 50, rt::now());
    EXPECT_EQ(wait_for_cue().frame_sequence, 2u);
  });
}

TEST_F(BehaviourLoopTest, NoStepIsMadeFromARefusedFrameAndEveryKindIsCounted) {
  BehaviourWiring w = wiring();
  w.rules = {.live = true, .width_px = kWidth, .height_px = kHeight, .age_limit_ns = 10 * kSecond, .stuck_frames = 2};
  w.frames_in_order = true;
  const RunStatus& status = run_status(flight_);
  const auto until = [](const std::atomic<std::uint64_t>& word, std::uint64_t wanted) {
    for (int i = 0; i < 60'000 && word.load() < wanted; ++i) rt::sleep_until(rt::now() + kMillisecond);
    EXPECT_EQ(word.load(), wanted);
  };
  with_loop(w, [&] {
    const TimeNs start_ns = rt::now() - kSecond;
    publish_frame(1, 10, start_ns + 10);
    EXPECT_EQ(wait_for_cue().frame_sequence, 1u);
    publish_frame(2, 10, start_ns + 20);  // the image once more ...
    until(status.frames_duplicate, 1);
    EXPECT_EQ(status.frames_stuck.load(), 0u);
    publish_frame(3, 10, start_ns + 30);  // ... and again
    until(status.frames_stuck, 1);
    publish_frame(4, 20, start_ns + 5);
    until(status.frames_disordered, 1);
    publish_frame(5, 30, start_ns + 100 * kSecond);
    publish_frame(6, 40, start_ns - 100 * kSecond);
    until(status.frames_misdated, 2);
    publish_frame(7, 50, start_ns + 40, kWidth + 2);
    until(status.frames_malformed, 1);
    publish_frame(0, 60, start_ns + 50);  // the camera was started again
    const Cue cue = wait_for_cue();
    EXPECT_EQ(cue.frame_sequence, 0u);
    EXPECT_FLOAT_EQ(cue.body.detail[1], 2.f);  // the second step
  });
  EXPECT_EQ(status.frames_duplicate.load(), 2u);
  EXPECT_EQ(status.frames_lost.load(), 0u);
}

TEST_F(BehaviourLoopTest, ScriptSkipsFramesAndSuppliesAttitude) {
  BehaviourScript script(2);
  script[0].frame_sequence = 1;
  script[1].frame_sequence = 3;
  script[1].attitude_valid = true;
  script[1].attitude.q_ned_body = {1, 0.5f, 0, 0};
  script[1].accel_valid = true;
  script[1].accel_body_mps2 = {0, 0, -9.5f};
  std::atomic<std::uint64_t> done{0};
  BehaviourWiring w = wiring();
  w.script = &script;
  w.script_ends_at = 4;
  w.frames_done = &done;
  with_loop(w, [&] {
    for (std::uint32_t n = 1; n <= 3; ++n) publish_frame(n, static_cast<std::uint8_t>(n), rt::now());
    const Cue first = wait_for_cue(), second = wait_for_cue();
    EXPECT_EQ(first.frame_sequence, 1u);
    EXPECT_EQ(first.attitude_valid, 0u);
    EXPECT_EQ(second.frame_sequence, 3u);
    EXPECT_FLOAT_EQ(second.body.detail[0], 0.5f);
    EXPECT_FLOAT_EQ(second.body.detail[1], 2.f);
    EXPECT_FLOAT_EQ(first.body.detail[2], -1.f);
    EXPECT_FLOAT_EQ(second.body.detail[2], -9.5f);
  });
  EXPECT_EQ(done.load(), 3u);
}

/// The cue of a frame of grey level `value` while `point` is on.
class BehaviourFaultsTest : public BehaviourLoopTest {
 protected:
  BehaviourFaultsTest() { control_.faults = &faults_; }
  void set(FaultPoint point, float value, std::int32_t target = FaultBoard::kAnyTarget) {
    faults_.set(point, 0, INT64_MAX, value, target);
  }
  void set(FaultPoint point) { set(point, row_of(point).value); }
  Cue cue_of(std::uint32_t sequence, std::uint8_t value) {
    shown_at_ns_ = rt::now();
    publish_frame(sequence, value, shown_at_ns_);
    return wait_for_cue();
  }
  FaultBoard faults_;
  TimeNs shown_at_ns_ = 0;
};

TEST_F(BehaviourFaultsTest, ABoardWithNothingOnChangesNothing) {
  with_loop(wiring(), [&] {
    const Cue cue = cue_of(1, 40);
    EXPECT_FLOAT_EQ(cue.body.height_m, 40.f);
    EXPECT_EQ(cue.exposed_at_ns, shown_at_ns_);
  });
}

TEST_F(BehaviourFaultsTest, SpinningTakesTheStepOverItsBudgetInRealTime) {
  set(FaultPoint::kBehaviourSpin, 60);  // budget: 50 ms
  with_loop(wiring(), [&] {
    const Cue cue = cue_of(1, 40);
    EXPECT_GE(cue.finished_at_ns - cue.started_at_ns, 60 * kMillisecond);
    EXPECT_EQ(cue.over_budget, 1u);
    faults_.clear(FaultPoint::kBehaviourSpin);
    EXPECT_FLOAT_EQ(cue_of(2, 41).body.height_m, 41.f);
  });
}

TEST_F(BehaviourFaultsTest, AnEndlessStepEndsWithItsFaultAndNotBefore) {
  set(FaultPoint::kBehaviourEndless);
  BehaviourWiring w = wiring();
  with_loop(w, [&] {
    publish_frame(1, 40, rt::now());
    while (w.watch->busy_since_ns.load() == 0) rt::sleep_until(rt::now() + kMillisecond);
    rt::sleep_until(rt::now() + 100 * kMillisecond);
    EXPECT_NE(w.watch->busy_since_ns.load(), 0);
    EXPECT_EQ(cues_.newest(), 0u);
    faults_.clear(FaultPoint::kBehaviourEndless);
    const Cue cue = wait_for_cue();
    EXPECT_GE(cue.finished_at_ns - cue.started_at_ns, 100 * kMillisecond);
  });
}

TEST_F(BehaviourFaultsTest, AnEndlessStepDoesNotHoldUpTheEndOfTheFlight) {
  set(FaultPoint::kBehaviourEndless);
  BehaviourWiring w = wiring();
  with_loop(w, [&] {
    publish_frame(1, 40, rt::now());
    while (w.watch->busy_since_ns.load() == 0) rt::sleep_until(rt::now() + kMillisecond);
  });
}

TEST_F(BehaviourFaultsTest, CuesAreNanOrHugeOrStuckUnderNewStamps) {
  with_loop(wiring(), [&] {
    set(FaultPoint::kBehaviourNanCue);
    Cue cue = cue_of(1, 40);
    EXPECT_TRUE(std::isnan(cue.body.height_m) && std::isnan(cue.body.climb_1ps) && std::isnan(cue.body.detail[7]));
    EXPECT_EQ(cue.body.has_height, 1);
    EXPECT_EQ(cue.body.validity, Validity::kValid);
    faults_.clear(FaultPoint::kBehaviourNanCue);
    set(FaultPoint::kBehaviourHugeCue, -1e30f);
    EXPECT_FLOAT_EQ(cue_of(2, 40).body.height_m, -1e30f);
    faults_.clear(FaultPoint::kBehaviourHugeCue);
    set(FaultPoint::kBehaviourStuckCue);
    EXPECT_FLOAT_EQ(cue_of(3, 50).body.height_m, 50.f);
    cue = cue_of(4, 60);
    EXPECT_FLOAT_EQ(cue.body.height_m, 50.f);
    EXPECT_EQ(cue.exposed_at_ns, shown_at_ns_);
    EXPECT_EQ(cue.frame_sequence, 4u);
    faults_.clear(FaultPoint::kBehaviourStuckCue);
    EXPECT_FLOAT_EQ(cue_of(5, 70).body.height_m, 70.f);
  });
}

TEST_F(BehaviourFaultsTest, InputsAreDenormalOrNan) {
  AttitudeSample level;
  level.exposed_at_ns = rt::now();
  attitude_.write(level, rt::now());
  with_loop(wiring(), [&] {
    set(FaultPoint::kBehaviourDenormal, 0);
    EXPECT_EQ(std::fpclassify(cue_of(1, 40).body.detail[0]), FP_SUBNORMAL);
    set(FaultPoint::kBehaviourDenormal, 1);
    EXPECT_TRUE(std::isnan(cue_of(2, 40).body.detail[0]));
  });
}

TEST_F(BehaviourFaultsTest, CuesOfTheFutureAndNoCues) {
  with_loop(wiring(), [&] {
    set(FaultPoint::kBehaviourFutureCue, 300);
    const Cue cue = cue_of(1, 40);
    EXPECT_EQ(cue.exposed_at_ns, shown_at_ns_ + 300 * kMillisecond);
    faults_.clear(FaultPoint::kBehaviourFutureCue);
    set(FaultPoint::kBehaviourSilent);
    const Stage& compute = stage_table(flight_).stages[1];
    publish_frame(2, 50, rt::now());
    while (compute.histogram.count() < 2) rt::sleep_until(rt::now() + kMillisecond);  // it has stepped
    faults_.clear(FaultPoint::kBehaviourSilent);
    EXPECT_EQ(cue_of(3, 60).frame_sequence, 3u);  // and the cue in between was kept back
  });
}

TEST_F(BehaviourFaultsTest, AFaultAimedAtAnotherBehaviourIsNotMet) {
  set(FaultPoint::kBehaviourNanCue, 0, 7);
  with_loop(wiring(), [&] {
    EXPECT_FLOAT_EQ(cue_of(1, 40).body.height_m, 40.f);
    set(FaultPoint::kBehaviourNanCue, 0, 0);
    EXPECT_TRUE(std::isnan(cue_of(2, 40).body.height_m));
  });
}

}  // namespace
}  // namespace wasp::scheduling
