// A camera that does what a script says: what the stand-ins for V4L2 and libdc1394 share. The script is the file named
// by WASP_CAMERA_SCRIPT; a line is a property of the camera, or a step of what it does from the first start on:
//
//   rate 100              frames a second
//   frames 20             so many good frames
//   drop 3                so many exposures never come: their numbers are missing
//   corrupt 2             so many come damaged, each in its own way (the stand-in says which)
//   burst 3               so many at once: all but the newest are late
//   silence 400           nothing for so many milliseconds
//   unplug 300 [PLACE]    gone for so many milliseconds; comes back at PLACE
//   reset                 dc1394: a bus reset; nothing comes until the camera is opened anew
//   clock_step 3600       dc1394: the wall clock jumps by so many seconds
// After the last step good frames come for ever. A frame comes no sooner than the rate allows, and not before the one
// before it was taken and given back: nothing is lost but by the script, however late the reader is.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <map>
#include <mutex>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

namespace wasp::test {

/// Pixel (x, y) of the stand-ins' frame n; the first four of row 0 are n itself, least byte first.
inline std::uint8_t scripted_pixel(std::uint32_t n, int x, int y) {
  if (y == 0 && x < 4) return static_cast<std::uint8_t>(n >> (8 * x));
  return static_cast<std::uint8_t>(n * 13 + static_cast<std::uint32_t>(x * 3 + y * 7 + (x * y >> 4)));
}

struct ScriptStep {
  std::string what;
  int number = 0;
  std::string place;
};

struct CameraScript {
  std::map<std::string, std::string> properties;
  std::vector<std::string> formats;  ///< every "format" line
  std::vector<ScriptStep> steps;

  static CameraScript load() {
    CameraScript script;
    const char* path = std::getenv("WASP_CAMERA_SCRIPT");
    std::ifstream file(path == nullptr ? "" : path);
    for (std::string line; std::getline(file, line);) script.add(line);
    return script;
  }
  [[nodiscard]] std::string text(const std::string& key, const std::string& otherwise = {}) const {
    const auto it = properties.find(key);
    return it == properties.end() ? otherwise : it->second;
  }
  [[nodiscard]] int number(const std::string& key, int otherwise) const {
    const auto it = properties.find(key);
    return it == properties.end() ? otherwise : std::atoi(it->second.c_str());
  }

 private:
  void add(const std::string& line) {
    std::istringstream words(line);
    std::string word, rest;
    if (!(words >> word) || word[0] == '#') return;
    for (const char* step : {"frames", "drop", "corrupt", "burst", "silence", "unplug", "reset", "clock_step"})
      if (word == step) {
        ScriptStep s{word, 1, {}};
        words >> s.number >> s.place;
        steps.push_back(s);
        return;
      }
    std::getline(words >> std::ws, rest);
    if (word == "format")
      formats.push_back(rest);
    else
      properties[word] = rest;
  }
};

/// Runs the steps in a thread of its own while the camera streams. `mutex` guards the derived class as well.
class ScriptedCamera {
 public:
  explicit ScriptedCamera(CameraScript its_script) : script(std::move(its_script)) {}
  virtual ~ScriptedCamera() { stop(); }

  void start() {
    stop();
    streaming_ = true;
    thread_ = std::thread([this] { run(); });
  }
  void stop() {
    {
      const std::lock_guard lock(mutex);
      streaming_ = false;
      changed.notify_all();
    }
    if (thread_.joinable()) thread_.join();
  }
  /// With the mutex held: when the frame being emitted was due, CLOCK_MONOTONIC [ns].
  [[nodiscard]] std::int64_t due_ns() const {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(due_.time_since_epoch()).count();
  }
  /// With the mutex held: false while it is unplugged.
  [[nodiscard]] bool plugged() const { return Clock::now() >= back_at_; }

  CameraScript script;
  std::mutex mutex;
  std::condition_variable changed;

 protected:
  /// With the mutex held. True when every buffer is back: the next frame may come.
  virtual bool idle() const = 0;
  /// With the mutex held: frame `n` into the next buffer.
  virtual void emit(std::uint32_t n, bool damaged) = 0;
  /// With the mutex held: tells a sleeping reader that something happened.
  virtual void wake() = 0;
  /// With the mutex held: it is unplugged, to come back at `place` ("": where it was).
  virtual void vanish(const std::string& place) = 0;
  virtual void reset_bus() {}
  virtual void step_clock(int) {}

 private:
  using Clock = std::chrono::steady_clock;

  void run() {
    std::unique_lock lock(mutex);
    due_ = Clock::now();
    while (streaming_) {
      const ScriptStep step = position_ < script.steps.size() ? script.steps[position_] : ScriptStep{"frames", 1, {}};
      if (!act(step, lock)) return;
      ++position_;
    }
  }
  /// False: the stream ends with this step, or was ended.
  bool act(const ScriptStep& step, std::unique_lock<std::mutex>& lock) {
    if (step.what == "frames" || step.what == "corrupt") {
      for (; done_ < step.number; ++done_) {
        if (!pace(lock)) return false;
        emit(next_++, step.what == "corrupt");
        wake();
      }
      done_ = 0;
    } else if (step.what == "drop") {
      next_ += static_cast<std::uint32_t>(step.number);
      due_ += period() * step.number;
    } else if (step.what == "burst") {
      if (!pace(lock)) return false;
      for (int i = 0; i < step.number; ++i) emit(next_++, false);
      wake();
    } else if (step.what == "silence") {
      changed.wait_for(lock, std::chrono::milliseconds(step.number), [this] { return !streaming_; });
      if (!streaming_) ++position_;  // whoever lost patience finds it speaking again
      due_ = Clock::now();
    } else if (step.what == "unplug") {
      back_at_ = Clock::now() + std::chrono::milliseconds(step.number);
      ++position_;
      vanish(step.place);
      wake();
      return false;
    } else if (step.what == "reset") {
      ++position_;
      reset_bus();
      return false;
    } else if (step.what == "clock_step") {
      step_clock(step.number);
    }
    return streaming_;
  }
  bool pace(std::unique_lock<std::mutex>& lock) {
    const auto now = Clock::now();
    due_ = std::max(due_ + period(), now - std::chrono::milliseconds(500));  // catches up after a standstill
    changed.wait_until(lock, due_, [this] { return !streaming_; });
    while (streaming_ && !idle()) changed.wait_for(lock, std::chrono::milliseconds(1));
    return streaming_;
  }
  [[nodiscard]] std::chrono::nanoseconds period() const {
    return std::chrono::nanoseconds(1'000'000'000 / script.number("rate", 100));
  }

  std::thread thread_;
  bool streaming_ = false;
  std::size_t position_ = 0;
  int done_ = 0;  ///< of the present step, before the stream was stopped
  std::uint32_t next_ = 0;
  Clock::time_point due_ = Clock::now(), back_at_;
};

}  // namespace wasp::test
