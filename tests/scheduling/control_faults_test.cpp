// A tick is held up while its fault is on, for as long as it says, and never beyond the end of the flight.
#include "scheduling/control_faults.h"

#include <gtest/gtest.h>

#include <thread>

#include "rt/clock.h"

namespace wasp::scheduling {
namespace {

class ControlFaultsTest : public ::testing::Test {
 protected:
  ControlFaultsTest() { control_.faults = &board_; }
  DurationNs held_up() {
    const ControlHook hook = control_fault_hook(control_);
    const TimeNs before_ns = rt::now();
    hook.before_write(hook.context, 1);
    return rt::now() - before_ns;
  }
  FaultBoard board_;
  LoopControl control_;
};

TEST_F(ControlFaultsTest, EachHoldsATickUpForItsValue) {
  for (const FaultPoint point : {FaultPoint::kControlStall, FaultPoint::kControlSpin}) {
    board_.set(point, 0, INT64_MAX, 35);
    EXPECT_GE(held_up(), 35 * kMillisecond) << name_of(point);
    board_.clear(point);
  }
}

TEST_F(ControlFaultsTest, TheEndOfTheFlightLetsTheTickGo) {
  for (const FaultPoint point : {FaultPoint::kControlStall, FaultPoint::kControlSpin}) {
    board_.set(point, 0, INT64_MAX, row_of(point).high);
    control_.stop = false;
    std::thread ends([this] {
      rt::sleep_until(rt::now() + 20 * kMillisecond);
      control_.stop = true;
    });
    EXPECT_LT(held_up(), static_cast<DurationNs>(row_of(point).high) * kMillisecond) << name_of(point);
    ends.join();
    board_.clear(point);
  }
}

}  // namespace
}  // namespace wasp::scheduling
