// The path of a followed vehicle: what lies between samples against the motion they were taken from, what is not known,
// and where it stands in our world.
#include "sim/pose_track.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sim/arrival_lag.h"
#include "sim/pose_placement.h"
#include "sim/sample_dating.h"

namespace wasp::sim {
namespace {

/// A vehicle that swings sideways by 0.5 m every 4 s, and rolls and yaws as it goes.
struct Swing {
  static constexpr float kOmega = 1.57f;
  static Vec3 position(float t) { return {0.3f * t, 0.5f * std::sin(kOmega * t), -1.f - 0.1f * std::cos(kOmega * t)}; }
  static Vec3 velocity(float t) {
    return {0.3f, 0.5f * kOmega * std::cos(kOmega * t), 0.1f * kOmega * std::sin(kOmega * t)};
  }
  static Quat attitude(float t) { return quat_from_euler({0.15f * std::sin(kOmega * t), -0.1f, 0.4f * t}); }
  static Vec3 rate(float t) {
    constexpr float h = 1e-2f;
    const Eigen::AngleAxisf turn(attitude(t - h).conjugate() * attitude(t + h));
    return turn.axis() * (turn.angle() / (2 * h));
  }
};

PoseTrack track_at(double rate_hz, double seconds = 8) {
  PoseTrack track;
  for (int i = 0; i <= static_cast<int>(seconds * rate_hz); ++i) {
    const double t = i / rate_hz;
    const auto s = static_cast<float>(t);
    track.add(AttitudeFix{from_seconds(t), Swing::attitude(s), Swing::rate(s)});
    track.add(PositionFix{from_seconds(t), Swing::position(s), Swing::velocity(s)});
  }
  return track;
}

struct WorstError {
  float metres = 0, radians = 0;
};
WorstError worst_error(double rate_hz) {
  const PoseTrack track = track_at(rate_hz);
  WorstError worst;
  for (double t = 7; t < 7.9; t += 0.0137) {
    const auto pose = track.at(from_seconds(t));
    EXPECT_TRUE(pose.has_value()) << t;
    if (!pose) continue;
    const auto s = static_cast<float>(t);
    worst.metres = std::max(worst.metres, (pose->position_ned_m - Swing::position(s)).norm());
    worst.radians = std::max(worst.radians, pose->q_ned_body.angularDistance(Swing::attitude(s)));
  }
  std::printf("%5.0f Hz: %.5f m, %.6f rad\n", rate_hz, static_cast<double>(worst.metres),
              static_cast<double>(worst.radians));
  return worst;
}

TEST(PoseTrack, BetweenSamplesItIsNearTheTrueMotionFrom4To100Hz) {
  for (const double rate_hz : {4.0, 10.0, 50.0, 100.0}) {
    const WorstError worst = worst_error(rate_hz);
    EXPECT_LT(worst.metres, 0.004f) << rate_hz;
    EXPECT_LT(worst.radians, 0.006f) << rate_hz;
  }
}

TEST(PoseTrack, NothingIsSaidBeyondTheLastSampleNorAcrossAGap) {
  PoseTrack track = track_at(50, 2);
  EXPECT_TRUE(track.at(2 * kSecond));
  EXPECT_FALSE(track.at(2 * kSecond + 1));
  const TimeNs later = 2 * kSecond + PoseTrack::kLongestGap + kMillisecond;
  track.add(AttitudeFix{later, Quat::Identity(), Vec3::Zero()});
  track.add(PositionFix{later, Swing::position(2), Vec3::Zero()});
  EXPECT_FALSE(track.at(2 * kSecond + 100 * kMillisecond));
  EXPECT_FALSE(PoseTrack().at(kSecond));
}

TEST(PoseTrack, AJumpIsNotSwept) {
  PoseTrack track;
  for (int i = 0; i <= 20; ++i) {
    const TimeNs at_ns = i * 20 * kMillisecond;
    track.add(AttitudeFix{at_ns, Quat::Identity(), Vec3::Zero()});
    const bool jumped = track.add(PositionFix{at_ns, Vec3(i < 10 ? 0.f : 5.f, 0, -1), Vec3::Zero()});
    EXPECT_EQ(jumped, i == 10);
  }
  EXPECT_FALSE(track.at(190 * kMillisecond));
  EXPECT_FLOAT_EQ(track.at(170 * kMillisecond)->position_ned_m.x(), 0.f);
  EXPECT_FLOAT_EQ(track.at(210 * kMillisecond)->position_ned_m.x(), 5.f);
}

TEST(PoseTrack, TimesThatDoNotRiseAreNotTaken) {
  PoseTrack track = track_at(50, 1);
  track.add(PositionFix{500 * kMillisecond, Vec3(100, 0, 0), Vec3::Zero()});
  EXPECT_LT(track.at(kSecond)->position_ned_m.norm(), 3.f);
}

ReportedPosition at(double n, double e, double d) { return {{n, e, d}, Vec3::Zero()}; }

TEST(PosePlacement, UntilItIsArmedItStandsAtTheStartFacingNorthWhateverItSays) {
  PosePlacement placement({});
  placement.place(AttitudeFix{1, quat_from_euler({0.02f, 0, 2.5f}), Vec3::Zero()});
  for (const double drift : {0.0, 0.7, 1.9}) {
    const PositionFix fix = placement.place(at(100 + drift, -40, 584 - drift), 1);
    EXPECT_LT((fix.position_ned_m - Vec3(0, 0, -0.2f)).norm(), 1e-4f);
  }
  EXPECT_NEAR(
      euler_from_quat(placement.place(AttitudeFix{2, quat_from_euler({0.02f, 0, 2.5f}), {}}).q_ned_body).yaw_rad, 0.f,
      1e-5f);
  placement.armed(true);
  // A metre up and two metres to where it looks; its frame lies 584 m above sea level, or anywhere.
  const PositionFix up = placement.place(at(101.9 + 2 * std::cos(2.5), -40 + 2 * std::sin(2.5), 584 - 1.9 - 1), 3);
  EXPECT_LT((up.position_ned_m - Vec3(2, 0, -1.2f)).norm(), 2e-3f) << up.position_ned_m.transpose();
  EXPECT_EQ(placement.flight_time_s(3 + kSecond), 1.0);
  placement.armed(false);  // landed elsewhere: it stays there
  const PositionFix landed = placement.place(at(101.9 + 2 * std::cos(2.5), -40 + 2 * std::sin(2.5), 584 - 1.9), 4);
  EXPECT_LT((landed.position_ned_m - Vec3(2, 0, -0.2f)).norm(), 2e-3f);
}

TEST(PosePlacement, OneThatFliesWhenItIsFirstHeardIsPlacedByItsOwnZero) {
  PosePlacement placement({});
  placement.armed(true);
  placement.place(AttitudeFix{1, Quat::Identity(), {}});
  EXPECT_LT((placement.place(at(3, 1, -1.5), 1).position_ned_m - Vec3(3, 1, -1.7f)).norm(), 1e-4f);
}

TEST(PosePlacement, AnOriginAndAHeadingThatAreGivenAreKept) {
  PosePlacement placement({.standing_m = 0.3f, .keep_heading = true, .origin_ned_m = Vec3(10, 0, 2)});
  placement.place(AttitudeFix{1, quat_from_euler({0, 0, 1.f}), {}});
  EXPECT_LT((placement.place(at(11, 2, 0), 1).position_ned_m - Vec3(1, 2, -2)).norm(), 1e-4f);
  EXPECT_NEAR(euler_from_quat(placement.place(AttitudeFix{2, quat_from_euler({0, 0, 1.f}), {}}).q_ned_body).yaw_rad,
              1.f, 1e-5f);
}

TEST(PosePlacement, ItIsNeverBelowTheGround) {
  PosePlacement placement({});
  placement.place(at(0, 0, 0), 1);
  placement.armed(true);
  EXPECT_FLOAT_EQ(placement.place(at(0, 0, 0.8), 2).position_ned_m.z(), -0.2f);
}

TEST(PosePlacement, AnotherSourceGoesOnWhereTheLastOneWasLeft) {
  PosePlacement placement({});
  placement.place(at(0, 0, 0), 1);
  placement.armed(true);
  placement.place(at(4, 1, -2), 2);
  placement.source_changed();
  EXPECT_LT((placement.place(at(1000, 0, -600), 3).position_ned_m - Vec3(4, 1, -2.2f)).norm(), 1e-3f);
  EXPECT_LT((placement.place(at(1001, 0, -600), 4).position_ned_m - Vec3(5, 1, -2.2f)).norm(), 1e-3f);
}

TEST(PosePlacement, AfterARestartItStandsAtTheStartUnlessItIsWhereItWas) {
  PosePlacement placement({});
  placement.place(at(0, 0, 0), 1);
  placement.armed(true);
  placement.place(at(4, 1, -1), 2);
  placement.restarted();
  EXPECT_LT((placement.place(at(4, 1, 0), 3).position_ned_m - Vec3(4, 1, -0.2f)).norm(), 1e-3f) << "it fell";
  placement.restarted();
  EXPECT_LT((placement.place(at(0, 0, 0), 4).position_ned_m - Vec3(0, 0, -0.2f)).norm(), 1e-3f) << "home again";
}

TEST(SampleDating, AClockThatDoesNotKeepTimeIsNotBelieved) {
  drivers::ClockMap clock;
  for (int i = 0; i < 5; ++i) {
    const TimeNs sent = i * 100 * kMillisecond;
    clock.add({sent, sent + kMillisecond + 1000 * kSecond, sent + 2 * kMillisecond});
  }
  SampleDating dating;
  const TimeNs remote = 1000 * kSecond + 490 * kMillisecond;
  EXPECT_EQ(dating.date(remote, 500 * kMillisecond, clock), 490 * kMillisecond);
  EXPECT_EQ(dating.date(remote - kSecond, 500 * kMillisecond, clock), 500 * kMillisecond) << "too old to be true";
  EXPECT_EQ(dating.date(remote + kSecond, 500 * kMillisecond, clock), 500 * kMillisecond) << "not yet";
  auto news = SampleDating::News::kNone;
  for (int i = 0; i < 300 && news == SampleDating::News::kNone; ++i)
    news = dating.note(1000 * kSecond + i * 16 * kMillisecond, i * 20 * kMillisecond);  // at 0.8 of real time
  EXPECT_EQ(news, SampleDating::News::kNotRealTime);
  EXPECT_NEAR(dating.rate(), 0.8, 0.01);
  EXPECT_EQ(dating.date(remote, 500 * kMillisecond, clock), 500 * kMillisecond);
  EXPECT_EQ(dating.note(kSecond, 7 * kSecond), SampleDating::News::kRestarted);
}

TEST(ArrivalLag, IsTheAgeOfTheSampleBeforeWhenTheNextOneArrives) {
  ArrivalLag lag;
  for (int i = 0; i < 40; ++i)  // 4 Hz, 10 ms on the way
    lag.add(i * 250 * kMillisecond, i * 250 * kMillisecond + 10 * kMillisecond);
  EXPECT_EQ(lag.usual_ns(), 260 * kMillisecond);
  EXPECT_EQ(lag.worst_ns(), 260 * kMillisecond);
  lag.add(10 * kSecond, 10 * kSecond + 90 * kMillisecond);  // one that was held up
  EXPECT_EQ(lag.worst_ns(), 340 * kMillisecond);
  EXPECT_LT(lag.usual_ns(), 270 * kMillisecond);
  EXPECT_NEAR(lag.rate_hz(10 * kSecond), 4, 0.6);
  EXPECT_EQ(lag.rate_hz(12 * kSecond), 0);
}

}  // namespace
}  // namespace wasp::sim
