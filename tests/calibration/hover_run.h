// A clip in the hover_mocap layout whose delay is known: a camera looks down through a lens with barrel distortion at a
// floor of chequered sheets, a motion capture of 120 Hz is logged at 500 Hz, and the logger hears of images unevenly.
#pragma once

#include <unistd.h>

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "drivers/image_file.h"

namespace wasp::test {

struct HoverOptions {
  double delay_s = 0.03;    ///< from exposure to the mean of when the logger hears of an image
  double jitter_s = 0.007;  ///< half range of that, below half a frame: none overtakes another
  double capture_hz = 120;
  unsigned seed = 1;
  int frames = 60;
};

struct HoverPose {
  Eigen::Vector3d position_m;
  Eigen::Quaterniond q_world_body;  ///< z up
};

/// A climb with sway, tilt and yaw about as large as those of the real clips.
class HoverPath {
 public:
  explicit HoverPath(unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(0, 1);
    for (auto& axis : sines_)
      for (Sine& s : axis) s = {0.4 + 0.6 * uniform(random), 2 + 10 * uniform(random), 6.28 * uniform(random)};
  }
  [[nodiscard]] HoverPose at(double t) const {
    const auto turn = [&](int axis, const Eigen::Vector3d& about) { return Eigen::AngleAxisd(sway(axis, t), about); };
    return {{0.6 * sway(3, t), 0.6 * sway(4, t), 0.5 + 0.3 * t + 0.3 * sway(5, t)},
            turn(2, Eigen::Vector3d::UnitZ()) * turn(1, Eigen::Vector3d::UnitY()) * turn(0, Eigen::Vector3d::UnitX())};
  }

 private:
  struct Sine {
    double size, rate, phase;
  };
  [[nodiscard]] double sway(int axis, double t) const {
    double sum = 0;
    for (const Sine& s : sines_[axis]) sum += 0.2 * s.size * std::sin(s.rate * t + s.phase) / s.rate;
    return sum;
  }
  Sine sines_[6][3];
};

class HoverRun {
 public:
  explicit HoverRun(const HoverOptions& o)
      : folder_(std::filesystem::temp_directory_path() /
                ("wasp_hover_" + std::to_string(o.seed) + "_" + std::to_string(::getpid()))),
        path_(o.seed),
        random_(o.seed) {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    write(o);
  }
  ~HoverRun() { std::filesystem::remove_all(folder_); }
  HoverRun(const HoverRun&) = delete;
  HoverRun& operator=(const HoverRun&) = delete;
  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }

 private:
  static constexpr int kWidth = 320, kHeight = 240, kFirst = 100;
  static constexpr double kFocal_px = 390, kDistortion = 0.25, kFloor_m = 0.013, kRow_s = 0.002, kMargin_s = 0.4;

  void write(const HoverOptions& o) {
    std::uniform_real_distribution<double> jitter(-o.jitter_s, o.jitter_s);
    std::ofstream table(folder_ / "gt_per_frame.csv");
    table << "frame,t_s\n";
    std::map<double, int> heard;
    double late_s = 0;
    for (int n = 0; n < o.frames; ++n) {
      late_s = n % 2 == 0 ? jitter(random_) : -late_s;  // of two images together none: the mean is the delay
      const double exposed_s = 1 + n / 60.0, heard_s = exposed_s + o.delay_s + late_s;
      const int number = kFirst + n;
      heard[heard_s] = number;
      table << number << "," << heard_s - 0.04 << "\n";
      save(number, path_.at(exposed_s));
    }
    write_capture(o, heard);
  }

  /// Each row holds the last pose and the last image the logger had by then.
  void write_capture(const HoverOptions& o, const std::map<double, int>& heard) {
    std::ofstream out(folder_ / "mocap_500hz_raw.csv");
    out << "time_s,latest_image_frame,X_m,Y_m,Z_m,qx,qy,qz\n";
    auto next = heard.begin();
    int newest = kFirst - 1;
    const auto mm = [](double v) { return std::round(2000 * v) / 2000; };
    for (int row = 0; row * kRow_s < 2 * kMargin_s + o.frames / 60.0 + o.delay_s; ++row) {
      const double t = 1 - kMargin_s + row * kRow_s;
      for (; next != heard.end() && next->first <= t; ++next) newest = std::max(newest, next->second);
      const HoverPose pose = path_.at(std::floor(t * o.capture_hz) / o.capture_hz);
      const Eigen::Vector3d q = pose.q_world_body.vec(), p = pose.position_m;
      out << t << "," << newest << "," << mm(p.x()) << "," << mm(p.y()) << "," << mm(p.z() + kFloor_m) << ","
          << mm(q.y()) << "," << mm(-q.x()) << "," << mm(-q.z()) << "\n";
    }
  }

  /// Sheets of 4 by 6 squares on white, none as the next.
  static double brightness(double x_m, double y_m) {
    constexpr double kSquare_m = 0.047, kSheetX = 4.3 * kSquare_m, kSheetY = 6.4 * kSquare_m;
    const double column = std::floor(x_m / kSheetX), row = std::floor((y_m + 0.37 * kSheetY * column) / kSheetY);
    const double x = x_m - column * kSheetX, y = y_m + 0.37 * kSheetY * column - row * kSheetY;
    const double slip = 0.25 * ((static_cast<int>(7 * column + 13 * row) % 4 + 4) % 4);
    const bool dark = (static_cast<int>(std::floor(x / kSquare_m + slip)) + static_cast<int>(y / kSquare_m)) % 2 != 0;
    return dark && x < 4 * kSquare_m && y < 6 * kSquare_m ? 40 : 200;
  }

  void save(int number, const HoverPose& pose) {
    std::normal_distribution<double> noise(0, 2);
    std::vector<std::uint8_t> gray(kWidth * kHeight);
    for (int v = 0; v < kHeight; ++v)
      for (int u = 0; u < kWidth; ++u) {
        double sum = 0;
        for (int k = 0; k < 4; ++k) sum += seen(pose, u + 0.5 * (k % 2) - 0.25, v + 0.5 * (k / 2) - 0.25) / 4;
        gray[static_cast<std::size_t>(v * kWidth + u)] =
            static_cast<std::uint8_t>(std::clamp(sum + noise(random_), 0.0, 255.0));
      }
    drivers::save_png(folder_ / ("test" + std::to_string(number) + ".png"),
                      GrayView{gray.data(), kWidth, kHeight, kWidth});
  }

  static double seen(const HoverPose& pose, double u_px, double v_px) {
    const Eigen::Vector2d bent((u_px - 159.5) / kFocal_px, (v_px - 119.5) / kFocal_px);
    const Eigen::Vector2d ray = bent * (1 + kDistortion * bent.squaredNorm());
    const Eigen::Vector3d along = pose.q_world_body * Eigen::Vector3d(ray.y(), ray.x(), -1);
    const Eigen::Vector3d hit = pose.position_m - along * (pose.position_m.z() / along.z());
    return brightness(hit.x(), hit.y());
  }

  std::filesystem::path folder_;
  HoverPath path_;
  std::mt19937 random_;
};

}  // namespace wasp::test
