// The real wasp-camera with a stand-in for its camera, and what another process sees of it.
#pragma once

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "rt/clock.h"
#include "shm/broadcast_ring.h"
#include "shm/topics.h"
#include "tests/cameras/scripted_camera.h"
#include "tests/tools/program.h"
#include "types/messages.h"

namespace wasp::test {

class CameraProgram {
 public:
  /// `standin`: a library in build/lib, preloaded.
  CameraProgram(const std::string& standin, const std::string& script, std::vector<std::string> options)
      : instance("camera" + std::to_string(getpid()) + "-" + std::to_string(++count_)) {
    std::ofstream(folder_.path / "script") << script;
    std::string command = "WASP_CAMERA_SCRIPT=" + file("script") + " LD_PRELOAD=" WASP_BINARY_DIR "/lib/" + standin +
                          " exec " + program_path("wasp-camera") + " --instance " + instance + " --no-rt --json";
    for (const auto& option : options) command += " '" + option + "'";
    command += " >" + file("out") + " 2>" + file("log");
    program_ = std::make_unique<Program>(std::vector<std::string>{"/bin/sh", "-c", command});
  }
  ~CameraProgram() {
    program_.reset();
    shm::Region::remove(shm::camera_region(instance));
  }

  /// Waits for the region; false if it never came.
  bool attach() {
    return eventually([&] {
      try {
        region.emplace(shm::Region::attach_with_bells(shm::camera_region(instance)));
        gray.emplace(*region, shm::kGray, "Frame");
        gray->rewind();
      } catch (const std::exception&) {
        return false;
      }
      return true;
    });
  }

  /// Reads grey frames until `last` of the script's count came, holding each against the script's pixels.
  void follow(std::uint32_t last) {
    ASSERT_TRUE(attach()) << log();
    for (const TimeNs limit = rt::now() + 120 * kSecond;
         rt::now() < limit && (seen.empty() || *seen.rbegin() < last);) {
      if (!gray->wait(rt::now() + 100 * kMillisecond)) continue;
      const shm::Sample sample = gray->next();
      if (sample) look(sample);
    }
    ASSERT_FALSE(seen.empty()) << log();
    EXPECT_GE(*seen.rbegin(), last) << log();
  }

  /// Ends it in order; its figures.
  nlohmann::json finish() {
    program_->signal(SIGTERM);
    EXPECT_EQ(program_->wait(), 0) << log();
    const auto document = nlohmann::json::parse(read_text(folder_.path / "out"), nullptr, false);
    if (!document.is_array() || document.empty()) {
      ADD_FAILURE() << "no figures: " << read_text(folder_.path / "out") << log();
      return {};
    }
    return document.at(0);
  }
  /// Waits for it to end by itself.
  int wait() { return program_->wait(); }
  void signal(int number) { program_->signal(number); }

  [[nodiscard]] std::string log() const { return read_text(folder_.path / "log"); }
  [[nodiscard]] std::string file(const std::string& name) const { return (folder_.path / name).string(); }

  std::string instance;
  std::optional<shm::Region> region;
  std::optional<shm::RingReader> gray;
  std::set<std::uint32_t> seen;                  ///< script's frame numbers that came through
  std::map<std::uint32_t, FrameHeader> headers;  ///< by that number
  int width_px = 0, height_px = 0;               ///< of the last one
  bool compare_pixels = true;

 private:
  void look(const shm::Sample& sample) {
    FrameHeader h;
    std::memcpy(&h, sample.data, sizeof h);
    const auto* pixels = reinterpret_cast<const std::uint8_t*>(sample.data + kFramePixelOffset);
    std::vector<std::uint8_t> copy(pixels, pixels + static_cast<std::size_t>(h.stride_bytes) * h.height_px);
    if (!gray->intact(sample)) return;
    EXPECT_EQ(h.format, PixelFormat::kMono8);
    EXPECT_EQ(h.stride_bytes, h.width_px);
    EXPECT_LE(h.exposed_at_ns, sample.published_at_ns);
    width_px = static_cast<int>(h.width_px);
    height_px = static_cast<int>(h.height_px);
    std::uint32_t n = 0;
    std::memcpy(&n, copy.data(), sizeof n);
    if (!compare_pixels) n = h.sequence;
    ASSERT_TRUE(seen.empty() || n > *seen.rbegin()) << "frame " << n << " after " << *seen.rbegin();
    seen.insert(n);
    headers[n] = h;
    if (!compare_pixels) return;
    int wrong = 0;
    for (int y = 0; y < height_px; ++y)
      for (int x = 0; x < width_px; ++x)
        wrong += copy[static_cast<std::size_t>(y * width_px + x)] != scripted_pixel(n, x, y);
    EXPECT_EQ(wrong, 0) << "pixels of frame " << n;
  }

  static inline int count_ = 0;
  TemporaryFolder folder_;
  std::unique_ptr<Program> program_;
};

}  // namespace wasp::test
