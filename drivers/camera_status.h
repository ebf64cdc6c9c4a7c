// What a camera process says of itself, in its region: block topics "camera" and "camera.down" (shm/topics.h). Single
// words and histograms, written by the capture thread, read by whoever looks (wasp top, wasp record).
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string_view>

#include "rt/histogram.h"

namespace wasp::drivers {

inline constexpr const char* kCameraStatusType = "CameraStatus";

enum class CameraState : std::uint32_t { kStarting = 0, kStreaming = 1, kGone = 2 };

/// Counts since the region was made: a camera process that is started again goes on counting.
struct CameraStatus {
  std::array<char, 16> driver{};
  std::array<char, 112> name{};             ///< identity of the device
  std::atomic<std::uint32_t> state{0};      ///< CameraState
  std::atomic<std::uint32_t> real_time{0};  ///< 1: SCHED_FIFO and locked memory
  std::atomic<std::uint64_t> frames{0};     ///< published
  std::atomic<std::uint64_t> dropped{0};    ///< exposures that never came here, by gaps in the device's count
  std::atomic<std::uint64_t> corrupt{0};    ///< came damaged: not published
  std::atomic<std::uint64_t> timeouts{0};   ///< waits that ended without a frame
  std::atomic<std::uint64_t> reopened{0};   ///< times the device was lost and found again
  std::atomic<std::uint64_t> estimated{0};  ///< frames whose own time stamp could not be believed
  rt::Histogram interval;                   ///< between the exposures of frames in a row, none missing between them
  rt::Histogram latency;                    ///< exposure to publication

  [[nodiscard]] std::string_view driver_view() const { return view(driver.data(), driver.size()); }
  [[nodiscard]] std::string_view name_view() const { return view(name.data(), name.size()); }

 private:
  static std::string_view view(const char* text, std::size_t size) {
    std::size_t n = 0;
    while (n < size && text[n] != 0) ++n;
    return {text, n};
  }
};

/// One writer a word.
inline void count(std::atomic<std::uint64_t>& word, std::uint64_t n = 1) noexcept {
  word.store(word.load(std::memory_order_relaxed) + n, std::memory_order_relaxed);
}

}  // namespace wasp::drivers
