// The behaviours that live on flow, on rendered frames with the noise of a real camera: from pixels to cue.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "sim/renderer.h"
#include "sim/scene.h"
#include "sim/sensor_model.h"
#include "vision/flow_field.h"
#include "vision/ground_flow.h"
#include "vision/heading_rate.h"
#include "vision/kernels/obstacle_bins.h"
#include "vision/odometry.h"
#include "vision/time_to_contact.h"

namespace wasp::sim {
namespace {

using namespace wasp::vision;

constexpr float kFrame_s = 1.f / 30.f;

CameraGeometry camera_of(float hfov_rad, double pitch_down_rad) {
  CameraGeometry camera;
  Intrinsics& k = camera.intrinsics;
  k.width_px = 320, k.height_px = 240;
  k.fx_px = k.fy_px = 160.f / std::tan(hfov_rad / 2);
  k.cx_px = 159.5f, k.cy_px = 119.5f;
  camera.R_body_cam = R_body_cam_from_pitch_down(Radians{pitch_down_rad});
  camera.position_body_m = Vec3(0.05f, 0, 0);
  return camera;
}

/// One kind of flow over rendered frames.
template <class Source>
class Eye {
 public:
  Eye(const char* kind, std::uint32_t seed, const CameraGeometry& camera)
      : renderer_(placed_at_start(make_scene(kind, seed)), camera.intrinsics),
        sensor_({}, camera.intrinsics.width_px, camera.intrinsics.fx_px, seed),
        luminance_(static_cast<std::size_t>(320 * Renderer::kBandRows)),
        depth_m_(luminance_.size()),
        gray_(320 * 240),
        depth_mm_(gray_.size()) {
    params_.camera = camera;
    state_ = std::make_unique<FlowFieldState>(params_);
  }

  /// The input of a behaviour after the frame from this pose.
  BehaviourInput look(const Vec3& position_ned_m, const Euler& attitude) {
    const Quat q = quat_from_euler(attitude);
    const CameraPose pose{position_ned_m + q * params_.camera.position_body_m,
                          q.toRotationMatrix() * params_.camera.R_body_cam};
    for (int band = 0; band < 240; band += Renderer::kBandRows) {
      renderer_.render_band(pose, band, luminance_.data(), depth_m_.data());
      for (int i = 0; i < Renderer::kBandRows; ++i) {
        const int from = i * 320, to = (band + i) * 320;
        sensor_.gray_row(frame_, band + i, luminance_.data() + from, gray_.data() + to);
        sensor_.depth_row(frame_, band + i, depth_m_.data() + from, depth_mm_.data() + to);
      }
    }
    BehaviourInput in;
    in.exposed_at_ns = static_cast<TimeNs>(frame_ + 1) * kSecond / 30;
    in.frame_sequence = frame_++;
    in.gray = {gray_.data(), 320, 240, 320};
    if (Source::kStream == Stream::kGrayDepth) in.depth = {depth_mm_.data(), 320, 240, 320};
    in.attitude_valid = true;
    in.attitude.q_ned_body = {q.w(), q.x(), q.y(), q.z()};
    Source::step(params_, in, *state_);
    BehaviourInput out;
    out.exposed_at_ns = in.exposed_at_ns;
    out.flow = Source::flow(*state_);
    return out;
  }

 private:
  Renderer renderer_;
  SensorModel sensor_;
  std::vector<float> luminance_, depth_m_;
  std::vector<std::uint8_t> gray_;
  std::vector<std::uint16_t> depth_mm_;
  FlowFieldParams params_;
  std::unique_ptr<FlowFieldState> state_;
  std::uint32_t frame_ = 0;
};

Euler wobble(float t_s) {
  return {0.04f * std::sin(4.4f * t_s), -0.05f + 0.03f * std::sin(3.8f * t_s), 0.03f * std::sin(2.f * t_s)};
}

TEST(FlowInWorlds, OdometryMeasuresVelocityInTheCorridor) {
  const CameraGeometry camera = camera_of(1.4f, 0.26);
  Odometry::Params params;
  params.camera = camera;
  for (const float speed_mps : {0.5f, 1.5f}) {
    Eye<FlowFieldFront> eye("corridor", 1, camera);
    Odometry::State state;
    float squares = 0;
    for (int i = 0; i < 45; ++i) {
      const float t_s = static_cast<float>(i) * kFrame_s;
      const BehaviourInput in = eye.look(Vec3(speed_mps * t_s, 0.1f, -1.f), wobble(t_s));
      const CueBody cue = Odometry::step(params, in, state);
      ASSERT_EQ(cue.validity == Validity::kValid, i > 0) << i;
      if (i == 0) continue;
      const float yaw_rad = wobble(t_s).yaw_rad;
      const float forward = cue.velocity_forward_mps - speed_mps * std::cos(yaw_rad);
      const float right = cue.velocity_right_mps + speed_mps * std::sin(yaw_rad);
      squares += 0.5f * (forward * forward + right * right);
    }
    EXPECT_LT(std::sqrt(squares / 44.f), 0.03f) << speed_mps;  // measured over four worlds: 0.01 m/s
  }
}

/// The wall, the last face of its world.
struct Wall {
  Vec3 normal, corner_m;
  explicit Wall(std::uint32_t seed) {
    const World world = placed_at_start(make_scene("wall", seed));
    normal = world.surfaces.back().normal;
    corner_m = world.vertices_ned_m[world.quads.back()[0]];
  }
  /// From a place to the wall's plane along a level direction.
  [[nodiscard]] float distance_m(const Vec3& from_m, float azimuth_rad) const {
    return normal.dot(corner_m - from_m) / normal.dot(Vec3(std::cos(azimuth_rad), std::sin(azimuth_rad), 0));
  }
};

/// How far north of the start the wall stands.
float wall_ahead_m(std::uint32_t seed) { return Wall(seed).distance_m(Vec3::Zero(), 0); }

TEST(FlowInWorlds, AvoidIsRaisedFifteenFramesBeforeAWall) {
  const CameraGeometry camera = camera_of(1.4f, 0.2);
  TimeToContactFront::Params params;
  params.camera = camera;
  for (const std::uint32_t seed : {1u, 2u, 3u})
    for (const float speed_mps : {0.7f, 1.5f}) {
      Eye<FlowFieldFront> eye("wall", seed, camera);
      TimeToContactFront::State state(params);
      const float start_m = wall_ahead_m(seed) - 2.f * speed_mps - 0.05f;  // 60 frames before contact of the camera
      float left = 60.f;
      for (bool raised = false; !raised; left -= 1.f) {
        ASSERT_GE(left, 15.f) << seed << " " << speed_mps;
        const float t_s = (60.f - left) * kFrame_s;
        const BehaviourInput in = eye.look(Vec3(start_m + speed_mps * t_s, 0.f, -1.f), wobble(t_s));
        raised = TimeToContactFront::step(params, in, state).avoid != 0;
      }
      EXPECT_LT(left, 50.f);
    }
}

TEST(FlowInWorlds, AvoidIsNotRaisedAlongACorridor) {
  const CameraGeometry camera = camera_of(1.4f, 0.2);
  TimeToContactFront::Params params;
  params.camera = camera;
  Eye<FlowFieldFront> eye("corridor", 2, camera);
  TimeToContactFront::State state(params);
  for (int i = 0; i < 200; ++i) {
    const float t_s = static_cast<float>(i) * kFrame_s;
    const BehaviourInput in = eye.look(Vec3(1.5f * t_s, 0.3f * std::sin(t_s), -1.f), wobble(t_s));
    ASSERT_EQ(TimeToContactFront::step(params, in, state).avoid, 0) << i;
  }
}

TEST(FlowInWorlds, HeadingRateFollowsTheTurnOverTheLaboratoryFloor) {
  const CameraGeometry camera = camera_of(1.5f, 1.5707963);
  HeadingRateDown::Params params;
  params.camera = camera;
  Eye<FlowFieldDown> eye("laboratory", 1, camera);
  HeadingRateDown::State state;
  float squares = 0;
  for (int i = 0; i < 40; ++i) {
    const float t_s = static_cast<float>(i) * kFrame_s;
    Euler attitude = wobble(t_s);
    attitude.yaw_rad = 0.5f * t_s;
    const BehaviourInput in = eye.look(Vec3(0.3f * t_s, 0.f, -1.f - 0.2f * t_s), attitude);
    const CueBody cue = HeadingRateDown::step(params, in, state);
    ASSERT_EQ(cue.validity == Validity::kValid, i > 0) << i;
    if (i == 0) continue;
    squares += std::pow(cue.detail[HeadingRateDown::kYawRate_radps] - 0.5f, 2.f);
    const float height_m = 1.f + 0.2f * t_s;
    EXPECT_NEAR(cue.detail[HeadingRateDown::kHeightRatio], height_m / (height_m - 0.2f * kFrame_s), 0.003f);
  }
  EXPECT_LT(std::sqrt(squares / 39.f), 0.05f);
  EXPECT_NEAR(static_cast<float>(state.heading_rad), 0.5f * 39.f * kFrame_s, 0.01f);
}

/// Angle by which the point of level ground straight below the body turns past it, rotation and translation together,
/// from true poses; x about the body's x axis, y about its y axis.
struct TrueFlow {
  float x_rad = 0, y_rad = 0;
};
TrueFlow true_flow(const Vec3& from_m, const Quat& from, const Vec3& to_m, const Quat& to, const Vec3& camera_body_m) {
  const Vec3 a = from_m + from * camera_body_m, b = to_m + to * camera_body_m;
  const Vec3 turn = Eigen::AngleAxisf(from.conjugate() * to).axis() * Eigen::AngleAxisf(from.conjugate() * to).angle();
  const Vec3 way_body = to.conjugate() * (b - a);
  const float along_m = -b.z() / (to * Vec3::UnitZ()).z();  // to the ground, down the body's own axis
  return {turn.x() - way_body.y() / along_m, turn.y() + way_body.x() / along_m};
}

// The OPTICAL_FLOW_RAD that an autopilot is told, over a second at a time, against the true motion.
TEST(FlowInWorlds, TheGroundFlowOfOpticalFlowRadIsTheTrueOne) {
  const CameraGeometry camera = camera_of(1.5f, 1.5707963);
  GroundFlow::Params params;
  params.camera = camera;
  float worst = 0, worst_still = 0;
  for (const std::uint32_t seed : {1u, 2u}) {
    Eye<FlowFieldDown> eye("laboratory", seed, camera);
    GroundFlow::State state;
    Vec3 last_m = Vec3::Zero();
    Quat last = Quat::Identity();
    for (int second = 0; second < 4; ++second) {
      TrueFlow truth, told, turned;
      for (int i = 0; i < 30; ++i) {
        const float t_s = static_cast<float>(30 * second + i) * kFrame_s;
        Euler attitude = wobble(t_s);
        attitude.yaw_rad = 0.4f * t_s;
        const Vec3 place_m(0.4f * std::sin(0.9f * t_s), -0.3f * t_s, -1.f - 0.15f * std::sin(t_s));
        const Quat q = quat_from_euler(attitude);
        const BehaviourInput in = eye.look(place_m, attitude);
        const CueBody cue = GroundFlow::step(params, in, state);
        const bool first = second == 0 && i == 0;
        ASSERT_EQ(cue.validity == Validity::kValid, !first) << second << ' ' << i;
        if (!first) {
          const TrueFlow step = true_flow(last_m, last, place_m, q, camera.position_body_m);
          truth.x_rad += step.x_rad, truth.y_rad += step.y_rad;
          told.x_rad += cue.detail[GroundFlow::kFlowX_rad], told.y_rad += cue.detail[GroundFlow::kFlowY_rad];
          turned.x_rad += cue.detail[GroundFlow::kTurnX_rad], turned.y_rad += cue.detail[GroundFlow::kTurnY_rad];
        }
        last_m = place_m, last = q;
      }
      const float error = std::hypot(told.x_rad - truth.x_rad, told.y_rad - truth.y_rad);
      const float still = std::hypot(truth.x_rad - turned.x_rad, truth.y_rad - turned.y_rad);
      std::printf("seed %u, second %d: told %+.4f %+.4f rad, true %+.4f %+.4f, of which the way %.4f: error %.4f\n",
                  seed, second, static_cast<double>(told.x_rad), static_cast<double>(told.y_rad),
                  static_cast<double>(truth.x_rad), static_cast<double>(truth.y_rad), static_cast<double>(still),
                  static_cast<double>(error));
      worst = std::max(worst, error / still);
      worst_still = std::max(worst_still, error);
    }
  }
  std::printf("worst error: %.1f %% of the way over height in a second\n", 100 * static_cast<double>(worst));
  EXPECT_LT(worst, 0.05f);
}

// Signs alone, each motion by itself.
TEST(FlowInWorlds, GroundFlowHasTheSignsOfTheProtocol) {
  const CameraGeometry camera = camera_of(1.5f, 1.5707963);
  GroundFlow::Params params;
  params.camera = camera;
  const auto flow_of = [&](const Vec3& way_m, const Euler& turn) {
    Eye<FlowFieldDown> eye("laboratory", 1, camera);
    GroundFlow::State state;
    eye.look(Vec3(0, 0, -1), {});
    const CueBody cue = GroundFlow::step(params, eye.look(Vec3(0, 0, -1) + way_m, turn), state);
    EXPECT_EQ(cue.validity, Validity::kValid);
    return std::pair(cue.detail[GroundFlow::kFlowX_rad], cue.detail[GroundFlow::kFlowY_rad]);
  };
  const float way = 0.02f, turn = 0.02f, rest = 0.002f;
  EXPECT_NEAR(flow_of({way, 0, 0}, {}).second, way, rest);  // along +X: positive y
  EXPECT_NEAR(flow_of({way, 0, 0}, {}).first, 0, rest);
  EXPECT_NEAR(flow_of({0, way, 0}, {}).first, -way, rest);  // along +Y: negative x
  EXPECT_NEAR(flow_of({0, 0, 0}, {turn, 0, 0}).first, turn, rest);
  EXPECT_NEAR(flow_of({0, 0, 0}, {0, turn, 0}).second, turn * (1 - 0.05f),
              rest);  // the camera 5 cm ahead rises with it
}

// OBSTACLE_DISTANCE before a wall: each bin the camera sees against the true distance to that wall.
TEST(FlowInWorlds, ObstacleBinsAreTheTrueDistances) {
  const CameraGeometry camera = camera_of(1.4f, 0.1);
  ObstacleBinsParams params;
  params.camera = camera;
  float worst = 0;
  for (const std::uint32_t seed : {1u, 2u}) {
    const Wall wall(seed);
    Eye<FlowFieldFront> eye("wall", seed, camera);
    for (const float ahead_m : {1.f, 2.f, 3.f}) {
      const float wall_m = wall.distance_m(Vec3::Zero(), 0);
      const float north_m = wall_m - ahead_m - camera.position_body_m.x();
      eye.look(Vec3(north_m, 0, -1), {});
      const BehaviourInput in = eye.look(Vec3(north_m, 0, -1), {0.02f, 0, 0});
      ASSERT_NE(in.flow, nullptr);
      const ObstacleBins bins = obstacle_bins(params, *in.flow);
      ASSERT_TRUE(bins.valid);
      int seen = 0;
      for (int bin = -7; bin <= 7; ++bin) {
        const auto told_cm = bins.distance_cm[static_cast<std::size_t>((bin + 72) % 72)];
        if (told_cm == kBinUnknown || told_cm > 400) continue;
        const float azimuth = static_cast<float>(bin) * 5 * static_cast<float>(M_PI) / 180;
        const float truth_m = wall.distance_m(Vec3(wall_m - ahead_m, 0, -1), azimuth);
        const float error_m = std::abs(0.01f * told_cm - truth_m);
        worst = std::max(worst, error_m / truth_m);
        EXPECT_LT(error_m, 0.01f + 0.06f * truth_m) << "bin " << bin << " of a wall at " << ahead_m;
        ++seen;
      }
      EXPECT_GE(seen, 11) << ahead_m;
      for (int bin = 10; bin <= 62; ++bin) EXPECT_EQ(bins.distance_cm[static_cast<std::size_t>(bin)], kBinUnknown);
    }
  }
  std::printf("obstacle bins: worst error %.1f %% of the distance\n", 100 * static_cast<double>(worst));
}

}  // namespace
}  // namespace wasp::sim
