// Who throws the fault points: an ordinary thread that runs a timeline and answers on a control socket. It exists only
// in a flight that was started with faults, and owns the board: without it there is none.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "rt/thread.h"
#include "scheduling/fault_socket.h"
#include "scheduling/fault_timeline.h"
#include "scheduling/process_faults.h"

namespace wasp::scheduling {

struct FaultSetup {
  std::string timeline;  ///< path; empty: none
  std::string socket;    ///< path; empty: none
  FaultScope scope;
  bool timeline_over = false;  ///< a flight that was started again: what its timeline did is not done twice
};

class FaultControl {
 public:
  using Log = std::function<void(const std::string&)>;

  /// Reads the timeline, makes the socket, and says on the log that faults are armed. Throws what is wrong with either.
  FaultControl(const FaultSetup& setup, Log log);
  /// As stop().
  ~FaultControl();
  FaultControl(const FaultControl&) = delete;
  FaultControl& operator=(const FaultControl&) = delete;

  [[nodiscard]] const FaultBoard& board() const noexcept { return board_; }
  /// Begins: everything before is kStart. The thread ends with stop() or this object; `marks` must outlive it.
  void start(const MissionMarks& marks);
  /// Every fault ends, the thread too; says which faults of the timeline never fell due.
  void stop();

  // What the thread does, for tests with a clock of their own.
  /// Begins and ends what is due; the next instant at which something will be, at most `kPatience` away.
  TimeNs look(const MissionMarks& marks, TimeNs now_ns);
  /// The reply to a request. Never throws for what is in it.
  std::string answer(std::string_view request, TimeNs now_ns);
  static constexpr DurationNs kPatience = 5 * kMillisecond;

 private:
  struct Active {
    FaultOrder order;
    TimeNs until_ns = 0;  ///< 0: off
  };
  void run(const MissionMarks& marks);
  void begin(const FaultOrder& order, TimeNs now_ns);
  void end(FaultPoint point);
  void clear(std::optional<FaultPoint> point);
  [[nodiscard]] std::string status(TimeNs now_ns) const;

  FaultScope scope_;
  Log log_;
  FaultBoard board_;
  std::vector<TimedFault> pending_;
  std::array<Active, kFaultPoints> active_{};
  std::optional<FaultPoint> ending_;  ///< the process, as soon as the reply is out
  DescriptorHoard descriptors_;
  std::unique_ptr<FaultSocket> socket_;
  std::atomic<bool> stop_{false};
  rt::Thread thread_;
};

}  // namespace wasp::scheduling
