// A man in the middle of the serial line: the simulator's pseudo-terminal on one side, one of its own on the other,
// which the flight opens. Every piece is logged with its time as it was written, then passed on as the faults leave it.
// The thread runs SCHED_FIFO where that is allowed.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/line_port.h"
#include "faults/inheriting_mutex.h"
#include "faults/stretch.h"
#include "faults/wire_fault.h"
#include "rt/thread.h"
#include "sim/pty.h"

namespace wasp::faults {

class WireTap {
 public:
  /// Opens the autopilot's line and makes `link_path` for the flight. Throws std::runtime_error.
  WireTap(const std::string& autopilot_path, std::string link_path);
  ~WireTap();
  WireTap(const WireTap&) = delete;
  WireTap& operator=(const WireTap&) = delete;

  /// From now on; faults of one direction work one after the other. Returns a number to take it away again.
  int add(const WireFault& fault);
  void remove(int number);
  /// Closes the flight's line: whoever has it open sees a hang-up, and its name is gone.
  void hang_up();
  /// It is there again, under the same name.
  void come_back();
  /// Writes bytes in between.
  void inject(Direction direction, std::vector<std::uint8_t> bytes);
  [[nodiscard]] const WireLog& log() const { return log_; }
  /// When this thread itself did not run for more than 5 ms: what arrived then bears too late a time.
  [[nodiscard]] std::vector<Stretch> stalls() const;

 private:
  struct Stage {
    int number = 0;
    WireMangler mangler;
  };
  void run();
  void turn();
  void pass(Direction direction, std::span<const std::uint8_t> bytes, TimeNs now_ns);
  void write(Direction direction, std::span<const std::uint8_t> bytes);

  std::string link_path_;
  drivers::LinePort autopilot_;
  WireLog log_;
  mutable InheritingMutex mutex_;  ///< all below
  std::unique_ptr<sim::Pty> flight_;
  std::vector<Stage> stages_;
  int next_number_ = 1;
  std::vector<Stretch> stalls_;
  bool autopilot_gone_ = false;
  std::atomic<bool> stop_{false};
  rt::Thread thread_;  // joined first
};

}  // namespace wasp::faults
