// The switches: when a point is on, for whom, and that without a board none is.
#include "scheduling/fault_points.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

namespace wasp::scheduling {
namespace {

TEST(FaultPoints, EveryNameIsItsOwnAndFindsItsPoint) {
  std::set<std::string_view> names;
  for (std::size_t i = 0; i < kFaultPoints; ++i) {
    const auto point = static_cast<FaultPoint>(i);
    EXPECT_TRUE(names.insert(name_of(point)).second) << name_of(point);
    EXPECT_EQ(fault_point_named(name_of(point)), point);
  }
  EXPECT_EQ(name_of(FaultPoint::kCameraFreeze), "camera.freeze");
  EXPECT_EQ(name_of(FaultPoint::kAttitudeNan), "attitude.nan");
  EXPECT_EQ(name_of(FaultPoint::kProcessDescriptors), "process.descriptors");
  EXPECT_FALSE(fault_point_named("camera.frozen"));
  EXPECT_FALSE(fault_point_named(""));
}

TEST(FaultPoints, WithoutABoardNothingIsOn) { EXPECT_FALSE(fault_on(nullptr, FaultPoint::kCameraFreeze, 1)); }

TEST(FaultPoints, APointIsOnFromItsStartToBeforeItsEnd) {
  FaultBoard board;
  EXPECT_FALSE(fault_on(&board, FaultPoint::kImuNan, 0));
  board.set(FaultPoint::kImuNan, 100, 200, 7.f);
  EXPECT_FALSE(board.on(FaultPoint::kImuNan, 99));
  EXPECT_TRUE(board.on(FaultPoint::kImuNan, 100));
  EXPECT_TRUE(fault_on(&board, FaultPoint::kImuNan, 199));
  EXPECT_FALSE(board.on(FaultPoint::kImuNan, 200));
  EXPECT_FALSE(board.on(FaultPoint::kImuBias, 150));
  EXPECT_FLOAT_EQ(board.value(FaultPoint::kImuNan), 7.f);
  board.clear(FaultPoint::kImuNan);
  EXPECT_FALSE(board.on(FaultPoint::kImuNan, 150));
}

TEST(FaultPoints, ATargetIsMetAloneAndNoTargetMeansAll) {
  FaultBoard board;
  board.set(FaultPoint::kBehaviourSilent, 0, 100, 0, 3);
  EXPECT_TRUE(board.on(FaultPoint::kBehaviourSilent, 50, 3));
  EXPECT_FALSE(board.on(FaultPoint::kBehaviourSilent, 50, 2));
  board.set(FaultPoint::kBehaviourSilent, 0, 100, 0);
  EXPECT_TRUE(board.on(FaultPoint::kBehaviourSilent, 50, 2));
}

}  // namespace
}  // namespace wasp::scheduling
