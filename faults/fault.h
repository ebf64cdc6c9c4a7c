// A fault of the catalogue: what is done, how, for how long, and what is promised of the flight's answer.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

namespace wasp::faults {

/// Where a flight is when the fault comes.
enum class Phase : std::uint8_t { kIdle = 0, kTakeOff = 1, kHover = 2, kCruise = 3, kLanding = 4 };
inline constexpr std::array kPhases = {Phase::kIdle, Phase::kTakeOff, Phase::kHover, Phase::kCruise, Phase::kLanding};
constexpr unsigned bit(Phase phase) { return 1u << static_cast<unsigned>(phase); }
inline constexpr unsigned kIdle = bit(Phase::kIdle), kTakeOff = bit(Phase::kTakeOff), kHover = bit(Phase::kHover),
                          kCruise = bit(Phase::kCruise), kLanding = bit(Phase::kLanding);
inline constexpr unsigned kFlying = kTakeOff | kHover | kCruise | kLanding, kAll = kFlying | kIdle;
const char* name_of(Phase phase);

/// Who does it (injector.cpp).
enum class Injector : std::uint8_t {
  kPoint,   ///< a fault point of the flight over its control socket: `what` [value] [target]
  kWire,    ///< the tap: `what` is a wire fault, value its value; towards the flight, or with target "autopilot" back
  kHangUp,  ///< the line is gone
  kGround,  ///< a ground station commands the autopilot: `what`, value
  kSignal,  ///< `what`: kill, stop (CONT at the end), segv, abort; to the process `target`
  kThreadStop,  ///< the thread `target` of the flight stands still, as under a debugger
  kSteal,       ///< policy, priority or core of the thread `target` taken: `what`
  kLimit,       ///< prlimit `what` of the process `target` becomes value
  kHog,         ///< a SCHED_FIFO thread of priority value spins on the core of control
  kLoad,        ///< stress-ng `what`, bounded
  kRegion,      ///< `what` happens to the shared memory file `target`
  kDisk,        ///< the recorder's disk: `what` full (256 KiB), errors (EIO), slow (value ms a write)
  kCore,        ///< the core of control is taken from the kernel (hot-plug)
  kClock,       ///< CLOCK_REALTIME of the whole machine jumps by value s
  kBoard,       ///< the whole board: only as the guest's last job (tools/rt_guest/jobs.sh)
  kStart,       ///< hostile input at start: `what`; no flight begins
};

/// What must be seen on the wire.
enum class Promise : std::uint8_t {
  kNeutral,     ///< alarm, and level or silent, until the fault is over and recovered from
  kUnaffected,  ///< nothing: no alarm, no gap
  kBounded,     ///< an alarm or none, but within all limits, and the flight goes on
  kGuardian,    ///< the guardian speaks, neutral; the flight is started again, disarmed
  kReported,    ///< the heartbeat tells; no arming by itself
  kLineBack,    ///< no wire to judge: gone is seen, and the stream comes back after it
  kEnds,        ///< says so, goes on commanding without a gap, lands and disarms, ends in order
  kRestarts,    ///< the board's watchdog starts it again
  kRefused,     ///< exit code not 0 and `says`, before anything is written
};
const char* name_of(Promise promise);

struct Fault {
  std::string_view id = {};
  int class_number = 0;  ///< of the catalogue, 1 ... 18
  Injector injector = Injector::kPoint;
  std::string_view what = {};
  double value = 0;
  std::string_view target = {};
  double for_s = 1.0;
  Promise promise = Promise::kBounded;
  double detected_ms = 0;   ///< since the fault began; 0: not asked
  double response_ms = 0;   ///< likewise
  double recovered_ms = 0;  ///< since its end (the guardian's restart: since it began); 0: it does not
  unsigned phases = kAll;
  std::string_view says = {};   ///< reason in the heartbeat, or text in the log
  double tainted_after_ms = 0;  ///< frames exposed later than this must not be used; 0: they may
  bool isolated = false;        ///< the flight does not survive it: one for itself
  bool noisy = false;           ///< it disturbs the reference loop too
  bool in_short = false;        ///< part of the short set
  bool own_machine = false;     ///< changes the whole machine: in the guest only
};

}  // namespace wasp::faults
