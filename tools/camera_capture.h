// One camera's capture thread: waits for frames, counts what does not come, and finds the device again after a loss.
#pragma once

#include <atomic>
#include <memory>

#include "drivers/camera_driver.h"
#include "rt/clock.h"
#include "scheduling/events.h"
#include "tools/camera_rings.h"

namespace wasp::tools {

class CameraCapture {
 public:
  static constexpr DurationNs kSearchPeriod = 200 * kMillisecond;  ///< of looking for a device that went
  static constexpr DurationNs kPatience = 2 * kSecond;             ///< with a silent or garbling one: opened anew

  /// Makes the driver; opens nothing. `name` is what the log calls it. Throws std::runtime_error for an unknown driver.
  CameraCapture(std::string name, const drivers::CameraDriverRow& row, const drivers::CameraRequest& request,
                CameraRings& rings, scheduling::EventQueue& events);

  /// Opens the device for the first time, refuses one that is not as promised, starts it. Throws CameraError.
  drivers::CameraFormat open();
  /// After a failed open(): run() looks for the device.
  void wait_for_it() { lost_at_ns_ = rt::now(); }
  /// What only this kind of camera counts; after run().
  [[nodiscard]] const std::string& account() const { return account_; }
  /// Runs until `stop`. Call from one thread, after open().
  void run(const std::atomic<bool>& stop);

 private:
  [[nodiscard]] DurationNs longest_wait() const;
  void note(drivers::FrameEvent event, TimeNs now_ns);
  void lose(const char* why);
  bool find_again();
  void search(const std::atomic<bool>& stop);

  std::string name_;
  drivers::CameraRequest request_;
  CameraRings& rings_;
  scheduling::EventQueue& events_;
  std::unique_ptr<drivers::CameraDriver> driver_;
  std::string account_;
  TimeNs opened_at_ns_ = 0, last_frame_ns_ = 0;
  TimeNs lost_at_ns_ = kNever;  ///< kNever: it is there
  std::string said_;            ///< the last reason why it cannot be opened
};

/// Refuses a device that delivers other pictures than the flight was promised. Throws CameraError.
void check_promise(const drivers::CameraFormat& format, const drivers::CameraRequest& request, bool depth);

}  // namespace wasp::tools
