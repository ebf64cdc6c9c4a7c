// The behaviours that live on flow, on rendered frames with the noise of a real camera: from pixels to cue.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "sim/renderer.h"
#include "sim/scene.h"
#include "sim/sensor_model.h"
#include "vision/flow_field.h"
#include "vision/heading_rate.h"
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

/// How far north of the start the wall stands; it is the last face of its world.
float wall_ahead_m(std::uint32_t seed) {
  const World world = placed_at_start(make_scene("wall", seed));
  const Vec3 normal = world.surfaces.back().normal, corner = world.vertices_ned_m[world.quads.back()[0]];
  return normal.dot(corner) / normal.x();
}

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

}  // namespace
}  // namespace wasp::sim
