// A recording made by the simulator's renderer along a motion that is known to the bit, with images stamped late by a
// known delay: EuRoC ASL for a camera carried about by hand, wasp's own layout for one above a turntable.
#pragma once

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "drivers/image_file.h"
#include "sim/sim_camera.h"
#include "sim/stand.h"

namespace wasp::test {

/// Turn angles (roll, pitch, yaw) [rad] and place [m] by time [s]; the rates follow by differences.
using Path = std::function<sim::BodyPose(double)>;

/// To and fro about all axes as a hand does it, each axis three sines of its own; `turn` scales the angles.
inline Path by_hand(unsigned seed, double turn) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  struct Sine {
    double size, rate, phase;
  };
  std::array<std::array<Sine, 3>, 6> sines;
  for (auto& axis : sines)
    for (Sine& s : axis)
      s = {0.4 + 0.6 * uniform(random), 2 * std::numbers::pi * (0.25 + 1.2 * uniform(random)), 6.28 * uniform(random)};
  return [=](double t) {
    std::array<float, 6> x{};
    for (std::size_t a = 0; a < 6; ++a)
      for (const Sine& s : sines[a]) x[a] += static_cast<float>(s.size * std::sin(s.rate * t + s.phase) / s.rate);
    const auto k = static_cast<float>(0.6 * turn);
    sim::BodyPose pose;
    pose.at_ns = from_seconds(t);
    pose.position_ned_m = Vec3(0.1f * x[3], 0.1f * x[4], -1.2f + 0.1f * x[5]);
    pose.q_ned_body = quat_from_euler({k * x[0], k * x[1], k * x[2]});
    return pose;
  };
}

/// Level, turning about the vertical as the platform of figure 5.6 does.
inline Path on_turntable(const sim::StandParams& stand) {
  std::vector<double> yaws{0};
  for (int ms = 0; ms < 60'000; ++ms)
    yaws.push_back(yaws.back() + 0.001 * sim::stand_yaw_rate_radps(stand, 0.001 * ms));
  return [yaws](double t) {
    const double at = std::max(t, 0.0) * 1000;
    const auto before = static_cast<std::size_t>(at);
    const double yaw = yaws.at(before) + (at - static_cast<double>(before)) * (yaws.at(before + 1) - yaws.at(before));
    sim::BodyPose pose;
    pose.at_ns = from_seconds(t);
    pose.position_ned_m = Vec3(0, 0, -1);
    pose.q_ned_body = quat_from_euler({0, 0, static_cast<float>(yaw)});
    return pose;
  };
}

/// Mean body rate over the 5 ms before t.
inline Vec3 gyro(const Path& path, double t) {
  const Eigen::AngleAxisf turn(path(t - 0.005).q_ned_body.conjugate() * path(t).q_ned_body);
  return turn.axis() * turn.angle() / 0.005f;
}

struct RunOptions {
  double seconds = 6, rate_hz = 20, delay_s = 0.03;
  double gyro_scale = 1, gyro_noise_radps = 0.01;
  unsigned seed = 1;
  Radians pitch_down{0.35};
};

class SimulatedRun {
 public:
  static constexpr int kWidth = 160, kHeight = 120;

  explicit SimulatedRun(const std::string& name)
      : folder_(std::filesystem::temp_directory_path() / ("wasp_run_" + name + "_" + std::to_string(::getpid()))) {
    std::filesystem::remove_all(folder_);
  }
  ~SimulatedRun() { std::filesystem::remove_all(folder_); }
  SimulatedRun(const SimulatedRun&) = delete;
  SimulatedRun& operator=(const SimulatedRun&) = delete;
  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }

  /// mav0/ with cam0 and imu0.
  void write_euroc(const Path& path, const RunOptions& o) {
    std::filesystem::create_directories(folder_ / "mav0/cam0/data");
    std::filesystem::create_directories(folder_ / "mav0/imu0");
    std::ofstream index(folder_ / "mav0/cam0/data.csv"), imu(folder_ / "mav0/imu0/data.csv"),
        yaml(folder_ / "mav0/cam0/sensor.yaml");
    index << "#timestamp [ns],filename\n";
    imu << "#timestamp [ns],w,w,w,a,a,a\n";
    const Mat3 R = R_body_cam_from_pitch_down(o.pitch_down);
    yaml << "T_BS:\n  data: [";
    for (int i = 0; i < 3; ++i) yaml << R(i, 0) << ", " << R(i, 1) << ", " << R(i, 2) << ", 0,\n";
    yaml << "0, 0, 0, 1]\nrate_hz: " << o.rate_hz << "\nresolution: [160, 120]\ncamera_model: pinhole\n"
         << "intrinsics: [130, 130, 79.5, 59.5]\ndistortion_model: radial-tangential\ndistortion_coefficients: [0, 0, "
            "0, 0]\n";
    write_images(path, o, [&](int, TimeNs stamp) {
      const std::string file = std::to_string(kEpoch + stamp) + ".png";
      index << kEpoch + stamp << "," << file << "\n";
      return folder_ / "mav0/cam0/data" / file;
    });
    write_gyro(path, o, [&](TimeNs t, const Vec3& w) {
      imu << kEpoch + t << "," << w.x() << "," << w.y() << "," << w.z() << ",0,0,-9.81\n";
    });
  }

  /// rgb.txt, camera.toml and imu.csv.
  void write_wasp(const Path& path, const RunOptions& o) {
    std::filesystem::create_directories(folder_ / "rgb");
    std::ofstream index(folder_ / "rgb.txt"), imu(folder_ / "imu.csv"), toml(folder_ / "camera.toml");
    toml << "width_px = 160\nheight_px = 120\nfx_px = 130.0\nfy_px = 130.0\ncx_px = 79.5\ncy_px = 59.5\npitch_down_deg "
            "= "
         << o.pitch_down.value * 180 / std::numbers::pi << "\nrate_hz = " << o.rate_hz << "\n";
    imu << "exposed_at_ns,sequence,fields,ax,ay,az,gx,gy,gz\n";
    write_images(path, o, [&](int n, TimeNs stamp) {
      const std::string file = "rgb/frame-" + std::to_string(n) + ".png";
      index << (kEpoch + stamp) / kSecond << "." << std::to_string(kSecond + (kEpoch + stamp) % kSecond).substr(1)
            << " " << file << "\n";
      return folder_ / file;
    });
    int n = 0;
    write_gyro(path, o, [&](TimeNs t, const Vec3& w) {
      imu << kEpoch + t << "," << n++ << ",0,0,0,-9.81," << w.x() << "," << w.y() << "," << w.z() << "\n";
    });
  }

 private:
  static constexpr TimeNs kEpoch = 1'000'000 * kSecond;

  template <class Place>
  void write_images(const Path& path, const RunOptions& o, const Place& place) {
    sim::SimConfig config;
    config.camera.intrinsics = {
        .width_px = kWidth, .height_px = kHeight, .fx_px = 130.f, .fy_px = 130.f, .cx_px = 79.5f, .cy_px = 59.5f};
    config.camera.R_body_cam = R_body_cam_from_pitch_down(o.pitch_down);
    config.camera.position_body_m = Vec3::Zero();
    static const auto kScene = sim::make_world_scene(sim::SimConfig{});
    sim::SimCamera camera(kScene, config.front(), config.sensor, o.seed);
    std::vector<std::uint8_t> gray(kWidth * kHeight);
    const int frames = static_cast<int>(o.seconds * o.rate_hz);
    for (int n = 0; n < frames; ++n) {
      const double exposed_s = 1 + n / o.rate_hz;
      camera.render(path(exposed_s), static_cast<std::uint32_t>(n), gray.data(), nullptr);
      drivers::save_png(place(n, from_seconds(exposed_s + o.delay_s)), GrayView{gray.data(), kWidth, kHeight, kWidth});
    }
  }

  template <class Write>
  void write_gyro(const Path& path, const RunOptions& o, const Write& write) {
    std::mt19937 random(o.seed + 100);
    std::normal_distribution<float> noise(0.f, static_cast<float>(o.gyro_noise_radps));
    for (double t = 0.5; t < o.seconds + 1.5; t += 0.005) {
      // The mean of 5 ms stands for their middle.
      const Vec3 w = static_cast<float>(o.gyro_scale) * gyro(path, t) +
                     Vec3(noise(random) + 0.02f, noise(random), noise(random) - 0.05f);
      write(from_seconds(t - 0.0025), w);
    }
  }

  std::filesystem::path folder_;
};

}  // namespace wasp::test
