// Chessboards as a camera of known lens sees them, through the project's own lens models, nine rays a pixel.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <vector>

#include "sim/random.h"
#include "types/camera.h"
#include "vision/kernels/derotate.h"

namespace wasp::test {

class BoardRenderer {
 public:
  BoardRenderer(const Lens& lens, cv::Size inner, double square_mm) : lens_(lens), inner_(inner), square_(square_mm) {
    const int w = lens.intrinsics.width_px, h = lens.intrinsics.height_px;
    for (int v = 0; v < h; ++v)
      for (int u = 0; u < w; ++u)
        for (int s = 0; s < kSamples * kSamples; ++s) {
          const float du = (static_cast<float>(s % kSamples) + 0.5f) / kSamples - 0.5f;
          const float dv = (static_cast<float>(s / kSamples) + 0.5f) / kSamples - 0.5f;
          Vec3 d = Vec3::Zero();
          if (!vision::direction_of(lens, {static_cast<float>(u) + du, static_cast<float>(v) + dv}, d)) d.setZero();
          rays_.push_back(d);
        }
  }

  /// `R`, `t` take board coordinates [mm] (x along the row, y down the columns, origin the first inner corner) to the
  /// camera's. Grey noise of standard deviation `noise`.
  [[nodiscard]] cv::Mat render(const Eigen::Matrix3d& R, const Eigen::Vector3d& t, double noise,
                               std::uint32_t seed) const {
    cv::Mat image(lens_.intrinsics.height_px, lens_.intrinsics.width_px, CV_8U);
    sim::Random random(seed);
    const Eigen::Matrix3f Rt = R.transpose().cast<float>();
    const Eigen::Vector3f origin = -(R.transpose() * t).cast<float>();  // camera centre in board coordinates
    std::size_t ray = 0;
    for (int v = 0; v < image.rows; ++v)
      for (int u = 0; u < image.cols; ++u) {
        float sum = 0;
        for (int s = 0; s < kSamples * kSamples; ++s) sum += shade(origin, Rt * rays_[ray++]);
        const double grey = static_cast<double>(sum) / (kSamples * kSamples) + noise * random.normal();
        image.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(std::clamp(grey, 0.0, 255.0));
      }
    return image;
  }

 private:
  static constexpr int kSamples = 3;

  /// White paper with black squares in a grey room.
  [[nodiscard]] float shade(const Vec3& from, const Vec3& d) const {
    if (std::fabs(d.z()) < 1e-6f) return 90;
    const float at = -from.z() / d.z();
    if (at <= 0) return 90;
    const auto square = static_cast<float>(square_);
    const float x = (from.x() + at * d.x()) / square, y = (from.y() + at * d.y()) / square;
    const float w = static_cast<float>(inner_.width), h = static_cast<float>(inner_.height);
    if (x < -1.8f || y < -1.8f || x > w + 0.8f || y > h + 0.8f) return 90;
    if (x < -1 || y < -1 || x > w || y > h) return 225;
    const int parity = static_cast<int>(std::floor(x)) + static_cast<int>(std::floor(y));
    return (parity & 1) == 0 ? 30.f : 225.f;
  }

  Lens lens_;
  cv::Size inner_;
  double square_;
  std::vector<Vec3> rays_;
};

/// A pose that puts the middle of the board at `centre_mm` in the camera, tilted about camera x and y, turned about z.
struct BoardPose {
  Eigen::Matrix3d R;
  Eigen::Vector3d t;
};
inline BoardPose board_pose(cv::Size inner, double square_mm, const Eigen::Vector3d& centre_mm, double tilt_x_rad,
                            double tilt_y_rad, double turn_rad) {
  const Eigen::Matrix3d R =
      (Eigen::AngleAxisd(tilt_x_rad, Eigen::Vector3d::UnitX()) *
       Eigen::AngleAxisd(tilt_y_rad, Eigen::Vector3d::UnitY()) * Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitZ()))
          .toRotationMatrix();
  const Eigen::Vector3d middle(0.5 * (inner.width - 1) * square_mm, 0.5 * (inner.height - 1) * square_mm, 0);
  return {R, centre_mm - R * middle};
}

}  // namespace wasp::test
