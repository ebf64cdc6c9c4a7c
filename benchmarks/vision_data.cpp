// Grey frames: seeded value noise in octaves is the texture; a moved frame is the same function read elsewhere, so its
// motion is exact. Depth: a floor in front of a wall with sensor noise and holes, and the cases that hurt.
#include "benchmarks/vision_data.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <filesystem>
#include <functional>
#include <random>

#include "drivers/image_file.h"

namespace wasp::bench {
namespace {

namespace fs = std::filesystem;
constexpr std::size_t kPixels = static_cast<std::size_t>(kVisionWidth) * kVisionHeight;

std::uint32_t mix(std::uint32_t h) {
  h = (h ^ (h >> 16)) * 0x7feb352du;
  h = (h ^ (h >> 15)) * 0x846ca68bu;
  return h ^ (h >> 16);
}

/// Smooth noise in -1 ... 1 with features about one unit wide.
float value_noise(float x, float y, std::uint32_t seed) {
  const float fx = std::floor(x), fy = std::floor(y), tx = x - fx, ty = y - fy;
  const auto at = [&](int dx, int dy) {
    const auto i = static_cast<std::uint32_t>(static_cast<int>(fx) + dx),
               j = static_cast<std::uint32_t>(static_cast<int>(fy) + dy);
    return static_cast<float>(mix(i * 73856093u ^ j * 19349663u ^ seed)) * 0x1p-31f - 1.f;
  };
  const float sx = tx * tx * (3 - 2 * tx), sy = ty * ty * (3 - 2 * ty);
  const float top = at(0, 0) + sx * (at(1, 0) - at(0, 0)), bottom = at(0, 1) + sx * (at(1, 1) - at(0, 1));
  return top + sy * (bottom - top);
}

std::uint8_t texture(float x, float y, std::uint32_t seed) {
  float sum = 0, amplitude = 60;
  for (float size = 48; size > 2; size /= 2, amplitude *= 0.7f)
    sum += amplitude * value_noise(x / size, y / size, seed + static_cast<std::uint32_t>(size));
  return static_cast<std::uint8_t>(std::clamp(128.f + sum, 0.f, 255.f));
}

template <class T>
VisionFrame<T> fill(const std::string& name, const std::function<T(int, int)>& pixel) {
  VisionFrame<T> frame{name, false, std::vector<T>(kPixels)};
  for (int v = 0; v < kVisionHeight; ++v)
    for (int u = 0; u < kVisionWidth; ++u)
      frame.pixels[static_cast<std::size_t>(v) * kVisionWidth + static_cast<std::size_t>(u)] = pixel(u, v);
  return frame;
}

void add_gray_pair(VisionData& data, const std::string& name, const std::function<std::uint8_t(int, int)>& first,
                   const std::function<std::uint8_t(int, int)>& second) {
  const int n = static_cast<int>(data.gray.size());
  data.gray.push_back(fill<std::uint8_t>(name + ".a", first));
  data.gray.push_back(fill<std::uint8_t>(name + ".b", second));
  data.pairs.push_back({n, n + 1});
}

void make_gray(VisionData& data) {
  struct Motion {
    float dx, dy, zoom, turn_rad;
  };
  constexpr Motion kMotions[] = {
      {3.3f, -1.7f, 1, 0}, {-9.6f, 6.2f, 1, 0}, {0, 0, 1.03f, 0}, {1, 1, 1, 0.03f}, {14, 11, 0.98f, -0.02f}};
  for (std::uint32_t i = 0; i < std::size(kMotions); ++i) {
    const Motion m = kMotions[i];
    const auto moved = [m, i](int u, int v) {
      const float x = (static_cast<float>(u) - 320 - m.dx) / m.zoom, y = (static_cast<float>(v) - 240 - m.dy) / m.zoom;
      const float c = std::cos(m.turn_rad), s = std::sin(m.turn_rad);
      return texture(c * x + s * y + 1000, c * y - s * x + 1000, i);
    };
    const auto still = [i](int u, int v) {
      return texture(static_cast<float>(u) + 680, static_cast<float>(v) + 760, i);
    };
    add_gray_pair(data, "textured" + std::to_string(i), still, moved);
  }
  std::mt19937 random(1);
  const auto noise = [&](int, int) { return static_cast<std::uint8_t>(random()); };
  const auto checks = [](int size, int shift) {
    return [size, shift](int u, int v) {
      return static_cast<std::uint8_t>((((u + shift) / size + v / size) & 1) != 0 ? 255 : 0);
    };
  };
  const auto level = [](int grey) { return [grey](int, int) { return static_cast<std::uint8_t>(grey); }; };
  add_gray_pair(data, "noise", noise, noise);
  add_gray_pair(data, "flat", level(90), level(90));
  add_gray_pair(data, "saturated", level(255), level(255));
  add_gray_pair(data, "black_white", level(0), level(255));
  add_gray_pair(data, "checks1", checks(1, 0), checks(1, 1));
  add_gray_pair(data, "checks16", checks(16, 0), checks(16, 5));
  add_gray_pair(data, "checks53", checks(53, 0), checks(53, 3));
  add_gray_pair(
      data, "stripes", [](int, int v) { return static_cast<std::uint8_t>((v & 8) != 0 ? 255 : 0); },
      [](int, int v) { return static_cast<std::uint8_t>(((v + 2) & 8) != 0 ? 255 : 0); });
}

/// A level floor `height_m` below a camera pitched down, a wall in front, boxes, noise of inverse depth, holes.
DepthFrame room(const std::string& name, unsigned seed, float pitch_rad, float height_m, float holes) {
  std::mt19937 random(seed);
  std::normal_distribution<float> noise(0.f, 0.0014f);
  std::uniform_real_distribution<float> uniform;
  return fill<std::uint16_t>(name, [&, pitch_rad, height_m, holes](int u, int v) -> std::uint16_t {
    const float x = (static_cast<float>(u) - 319.5f) / 525, y = (static_cast<float>(v) - 239.5f) / 525;
    const float down = y * std::cos(pitch_rad) + std::sin(pitch_rad);
    const float ahead = std::cos(pitch_rad) - y * std::sin(pitch_rad);
    float w = std::max(down / height_m, ahead / 4.f);                  // floor, wall 4 m ahead
    if (std::abs(x - 0.2f) < 0.1f && y < 0.1f) w = std::max(w, 0.6f);  // a post
    w += noise(random);
    const bool hole = uniform(random) < holes || w < 0.12f;
    return hole ? std::uint16_t{0} : static_cast<std::uint16_t>(std::clamp(1000.f / w, 1.f, 65534.f));
  });
}

void make_depth(VisionData& data) {
  std::mt19937 random(2);
  for (unsigned i = 0; i < 8; ++i) {
    const auto t = static_cast<float>(i);
    data.depth.push_back(room("room" + std::to_string(i), i, 0.2f + 0.12f * t, 0.5f + 0.2f * t, 0.02f * t));
  }
  const auto add = [&](const std::string& name, const std::function<std::uint16_t(int, int)>& pixel) {
    data.depth.push_back(fill<std::uint16_t>(name, pixel));
  };
  add("depth_noise", [&](int, int) { return static_cast<std::uint16_t>(random()); });
  add("depth_noise_near", [&](int, int) { return static_cast<std::uint16_t>(500 + random() % 4000); });
  add("depth_flat", [](int, int) { return std::uint16_t{1500}; });
  add("depth_empty", [](int, int) { return std::uint16_t{0}; });
  add("depth_full", [](int, int) { return std::uint16_t{65535}; });
  add("depth_checks", [](int u, int v) { return static_cast<std::uint16_t>(((u ^ v) & 1) != 0 ? 900 : 3000); });
  add("depth_checks16", [](int u, int v) { return static_cast<std::uint16_t>(((u ^ v) & 16) != 0 ? 900 : 3000); });
  add("depth_sparse", [&](int u, int v) { return static_cast<std::uint16_t>(random() % 20 != 0 ? 0 : 1000 + u + v); });
}

/// Pixels of the middle 640 x 480; false for a smaller image.
template <class T>
bool crop(const drivers::Image<T>& image, VisionFrame<T>& out) {
  const int left = (image.width_px - kVisionWidth) / 2, top = (image.height_px - kVisionHeight) / 2;
  if (left < 0 || top < 0) return false;
  out.pixels.clear();
  for (int v = 0; v < kVisionHeight; ++v) {
    const T* row = image.view().row(v + top) + left;
    out.pixels.insert(out.pixels.end(), row, row + kVisionWidth);
  }
  return true;
}

std::vector<fs::path> files_of(const fs::path& folder, const std::string& contains, std::size_t most) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (const std::string name = entry.path().filename().string();
        name.find(contains) != std::string::npos && (name.ends_with(".png") || name.ends_with(".pgm")))
      files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  if (files.size() > most) files.resize(most);
  return files;
}

void note_used(VisionData& data, const std::string& folder, std::size_t count) {
  if (count > 0) data.real_used += (data.real_used.empty() ? "" : ", ") + folder + " (" + std::to_string(count) + ")";
}

void load_gray(VisionData& data, const fs::path& root, const std::string& folder, const std::string& contains) {
  std::size_t used = 0;
  for (const fs::path& file : files_of(root / folder, contains, 8)) {
    GrayFrame frame{folder + "/" + file.stem().string(), true, {}};
    if (!crop(drivers::load_gray8(file), frame)) continue;
    const int n = static_cast<int>(data.gray.size());
    data.gray.push_back(std::move(frame));
    if (used++ > 0) data.pairs.push_back({n - 1, n});
  }
  note_used(data, folder, used);
}

void load_depth(VisionData& data, const fs::path& root, const std::string& folder, const std::string& contains) {
  std::size_t used = 0;
  for (const fs::path& file : files_of(root / folder, contains, 8)) {
    DepthFrame frame{folder + "/" + file.stem().string(), true, {}};
    if (!crop(drivers::load_gray16(file), frame)) continue;
    for (std::uint16_t& mm : frame.pixels) mm = mm == 65535 ? std::uint16_t{0} : mm;
    data.depth.push_back(std::move(frame));
    ++used;
  }
  note_used(data, folder, used);
}

void load_real(VisionData& data, const fs::path& root) {
  for (const char* folder : {"corner_tracks", "plane_checkerboard", "rgbd_tum_pair"})
    load_gray(data, root, folder, "img_");
  for (const char* folder : {"flow_middlebury/Grove2", "flow_middlebury/Urban2"})
    load_gray(data, root, folder, "frame");
  for (const char* folder :
       {"kinect_7scenes_redkitchen", "kinect_floor_pcl", "kinect_livingroom_pgm", "kinect_table_osd"})
    load_depth(data, root, folder, "depth");
}

}  // namespace

VisionData make_vision_data() {
  VisionData data;
  make_gray(data);
  make_depth(data);
  try {
    load_real(data, fs::path(WASP_SOURCE_DIR) / ".." / "shared" / "data");
  } catch (const std::exception& e) {
    data.real_used += std::string(" (") + e.what() + ")";
  }
  return data;
}

}  // namespace wasp::bench
