// A row's two factories: the stepper gives what the step gives, without threads, with a state of its own.
#include "scheduling/behaviour_row.h"

#include <gtest/gtest.h>

#include <sstream>

namespace wasp::scheduling {
namespace {

/// Counts its steps; a flow source whose memory is of the camera's size.
struct Counter {
  static constexpr std::string_view kName = "counter";
  static constexpr DurationNs kBudgetNs = 3 * kMillisecond;
  static constexpr Stream kStream = Stream::kDown;
  static constexpr Stream kPublishes = Stream::kFlowDown;
  struct Params {
    CameraGeometry camera;
    float gain = 1;
  };
  template <class Visitor>
  static void visit_params(Params& p, Visitor&& visit) {
    visit("gain", p.gain, 0.0, 10.0);
  }
  struct State {
    explicit State(const Params& p) : row(static_cast<std::size_t>(p.camera.intrinsics.width_px)) {}
    std::vector<float> row;
    FlowMessage flow;
    int steps = 0;
  };
  static CueBody step(const Params& p, const BehaviourInput& in, State& state) noexcept {
    CueBody body;
    body.detail[0] = p.gain * static_cast<float>(++state.steps);
    body.detail[1] = static_cast<float>(state.row.size());
    state.flow.frame_sequence = in.frame_sequence;
    return body;
  }
  static const FlowMessage* flow(const State& state) noexcept { return state.steps > 1 ? &state.flow : nullptr; }
};
static_assert(FlowSource<Counter>);

TomlTable table(const std::string& text) {
  std::istringstream stream(text);
  return TomlTable::parse(stream, "test");
}

TEST(BehaviourRow, SaysWhatReleasesItAndWhatItMakes) {
  const BehaviourRow row = behaviour_row<Counter>();
  EXPECT_EQ(row.name, "counter");
  EXPECT_EQ(row.stream, Stream::kDown);
  EXPECT_EQ(row.publishes, Stream::kFlowDown);
  EXPECT_EQ(row.budget_ns, 3 * kMillisecond);
}

TEST(BehaviourRow, ASteppersStateIsOfItsCamerasSizeAndItsOwn) {
  const BehaviourRow row = behaviour_row<Counter>();
  CameraGeometry camera;
  camera.intrinsics.width_px = 96;
  const Stepper one = row.make_stepper(camera, table("gain = 2.0")), other = row.make_stepper(camera, table(""));
  BehaviourInput input;
  input.frame_sequence = 7;
  const SteppedCue first = one(input);
  EXPECT_EQ(first.body.detail[0], 2.f);
  EXPECT_EQ(first.body.detail[1], 96.f);
  EXPECT_EQ(first.flow, nullptr);
  input.frame_sequence = 8;
  const SteppedCue second = one(input);
  EXPECT_EQ(second.body.detail[0], 4.f);
  ASSERT_NE(second.flow, nullptr);
  EXPECT_EQ(second.flow->frame_sequence, 8u);
  EXPECT_EQ(other(input).body.detail[0], 1.f);
}

TEST(BehaviourRow, ParametersNobodyKnowsOrOutOfRangeAreRefused) {
  const BehaviourRow row = behaviour_row<Counter>();
  EXPECT_THROW(row.make_stepper({}, table("gian = 2.0")), ConfigError);
  EXPECT_THROW(row.make_stepper({}, table("gain = 20.0")), ConfigError);
}

}  // namespace
}  // namespace wasp::scheduling
