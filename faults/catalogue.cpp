// Rows by class (docs/faults.md). Times are promises on the wire [ms]; what a point does by default, `wasp flight
// --fault-socket` says (`list`).
#include "faults/catalogue.h"

namespace wasp::faults {
namespace {

using enum Injector;
using enum Promise;

constexpr double kImage_ms = 150;    // after the last good frame
constexpr double kStale_ms = 160;    // age limit of a cue, one control period, one deadline
constexpr double kFrozen_ms = 360;   // known after 100 ms; then the age limit counts
constexpr double kBack_ms = 1000;    // a stream that is back is used again
constexpr double kVehicle_ms = 260;  // age limit of the attitude, one control period, one deadline
constexpr double kSilence_ms = 300;
constexpr double kGuardian_ms = 100, kHang_ms = 75, kRestart_ms = 500;
constexpr double kReport_ms = 500, kBoard_ms = 2100;
constexpr double kLanded_ms = 40'000;  // from any phase, slowly
constexpr unsigned kBoth = kHover | kCruise;

/// A row: what is done, and behind it what is promised. Promises not given: within limits, in every phase.
class Row {
 public:
  constexpr Row(int class_number, std::string_view id, Injector injector, std::string_view what = {}, double value = 0)
      : f_{.id = id, .class_number = class_number, .injector = injector, .what = what, .value = value} {}
  constexpr operator Fault() const { return f_; }  // NOLINT: a row is a fault

  constexpr Row to(std::string_view target) const { return with(&Fault::target, target); }
  constexpr Row lasting(double seconds) const { return with(&Fault::for_s, seconds); }
  constexpr Row in(unsigned phases) const { return with(&Fault::phases, phases); }
  constexpr Row saying(std::string_view text) const { return with(&Fault::says, text); }
  constexpr Row tainting(double after_ms) const { return with(&Fault::tainted_after_ms, after_ms); }
  constexpr Row alone() const { return with(&Fault::isolated, true); }
  constexpr Row noisy() const { return with(&Fault::noisy, true); }
  constexpr Row own_machine() const { return with(&Fault::own_machine, true); }
  constexpr Row brief() const { return with(&Fault::in_short, true); }  ///< part of the short set

  constexpr Row neutral(double within_ms, double back_ms = kBack_ms) const {
    return promised(kNeutral, within_ms, within_ms, back_ms);
  }
  constexpr Row guarded(double within_ms = kGuardian_ms, double restarted_ms = kRestart_ms) const {
    return promised(kGuardian, within_ms, within_ms, restarted_ms);
  }
  constexpr Row reported(double back_ms = 0) const { return promised(kReported, kReport_ms, 0, back_ms); }
  constexpr Row line_back(double seen_ms, double back_ms) const { return promised(kLineBack, seen_ms, 0, back_ms); }
  constexpr Row said(std::string_view text, double within_ms) const {
    return promised(kBounded, within_ms, 0, 0).saying(text);
  }
  constexpr Row restarts() const { return promised(kRestarts, 0, 0, kBoard_ms); }
  constexpr Row unaffected() const { return promised(kUnaffected, 0, 0, 0); }
  constexpr Row ends() const { return promised(kEnds, kReport_ms, 0, kLanded_ms); }
  constexpr Row refused(std::string_view says) const { return promised(kRefused, 0, 0, 0).saying(says); }

 private:
  template <class Value>
  constexpr Row with(Value Fault::*field, Value value) const {
    Row row = *this;
    row.f_.*field = value;
    return row;
  }
  constexpr Row promised(Promise promise, double detected_ms, double response_ms, double recovered_ms) const {
    Row row = *this;
    row.f_.promise = promise, row.f_.detected_ms = detected_ms;
    row.f_.response_ms = response_ms, row.f_.recovered_ms = recovered_ms;
    return row;
  }
  Fault f_;
};

constexpr Fault kRows[] = {
    // 1: the camera.
    Row(1, "camera-freeze", kPoint, "camera.freeze").neutral(kImage_ms).saying("camera frozen").tainting(150).brief(),
    Row(1, "camera-drop", kPoint, "camera.drop", 1).neutral(kImage_ms),
    Row(1, "camera-slow", kPoint, "camera.slow"),
    Row(1, "camera-disconnect", kPoint, "camera.disconnect").neutral(kImage_ms),
    Row(1, "camera-error", kPoint, "camera.error", 1500).neutral(kImage_ms),
    Row(1, "camera-process-stop", kSignal, "stop").to("camera").neutral(kImage_ms).brief(),
    Row(1, "camera-process-kill", kSignal, "kill").to("camera").neutral(kImage_ms, 5000),

    // 2: times and shapes of frames.
    Row(2, "frames-late", kPoint, "camera.late"),
    Row(2, "frames-too-late", kPoint, "camera.late", 400).neutral(kStale_ms),
    Row(2, "frames-half-lost", kPoint, "camera.drop"),
    Row(2, "frames-reordered", kPoint, "camera.reorder"),
    Row(2, "frames-twice", kPoint, "camera.duplicate").saying("duplicate"),
    Row(2, "frames-wrong-size", kPoint, "camera.size").neutral(kImage_ms).saying("malformed").tainting(0.001),
    Row(2, "frames-torn-header", kPoint, "camera.torn_header").neutral(kStale_ms),
    Row(2, "stamps-ahead", kPoint, "camera.stamp_ahead").neutral(kStale_ms),
    Row(2, "stamps-back", kPoint, "camera.stamp_back").neutral(kStale_ms),
    Row(2, "stamps-stuck", kPoint, "camera.stamp_stuck").neutral(kStale_ms),
    Row(2, "sequence-wraps", kPoint, "camera.sequence_wrap"),
    Row(2, "sequence-restarts", kPoint, "camera.sequence_restart"),

    // 3: exposure.
    Row(3, "image-black", kPoint, "image.black"),
    Row(3, "image-white", kPoint, "image.white"),
    Row(3, "image-blur", kPoint, "image.blur"),
    Row(3, "image-noise", kPoint, "image.noise"),
    Row(3, "image-band", kPoint, "image.band"),
    Row(3, "image-tear", kPoint, "image.tear"),
    Row(3, "image-gain", kPoint, "image.gain"),

    // 4: depth.
    Row(4, "depth-holes", kPoint, "depth.holes"),
    Row(4, "depth-none", kPoint, "depth.none").neutral(kStale_ms).in(kFlying),
    Row(4, "depth-bias", kPoint, "depth.bias"),
    Row(4, "depth-quantise", kPoint, "depth.quantise"),
    Row(4, "depth-noise", kPoint, "depth.noise"),
    Row(4, "depth-zero", kPoint, "depth.zero"),
    Row(4, "depth-far", kPoint, "depth.far"),
    Row(4, "depth-freeze", kPoint, "depth.freeze"),
    Row(4, "depth-drop", kPoint, "depth.drop").neutral(kStale_ms),

    // 5: attitude and inertial samples.
    Row(5, "attitude-stop", kPoint, "attitude.stop").neutral(kVehicle_ms).in(kFlying),
    Row(5, "attitude-freeze", kPoint, "attitude.freeze").neutral(kFrozen_ms),
    Row(5, "attitude-spike", kPoint, "attitude.spike"),
    Row(5, "attitude-nan", kPoint, "attitude.nan").neutral(kVehicle_ms).brief(),
    Row(5, "attitude-bias", kPoint, "attitude.bias"),
    Row(5, "attitude-10-hz", kPoint, "attitude.slow"),
    Row(5, "attitude-ahead", kPoint, "attitude.stamp_ahead"),
    Row(5, "attitude-back", kPoint, "attitude.stamp_back").neutral(kVehicle_ms),
    Row(5, "imu-stop", kPoint, "imu.stop"),
    Row(5, "imu-freeze", kPoint, "imu.freeze"),
    Row(5, "imu-spike", kPoint, "imu.spike"),
    Row(5, "imu-nan", kPoint, "imu.nan"),
    Row(5, "imu-bias", kPoint, "imu.bias"),
    Row(5, "imu-10-hz", kPoint, "imu.slow"),
    Row(5, "wire-attitude-nan", kWire, "attitude_nan").neutral(kVehicle_ms).in(kFlying),
    Row(5, "wire-attitude-frozen", kWire, "attitude_frozen").neutral(kFrozen_ms),
    Row(5, "wire-attitude-10-hz", kWire, "attitude_slow", 10),
    Row(5, "wire-attitude-spike", kWire, "attitude_spike", 10),
    Row(5, "wire-attitude-lost", kWire, "attitude_lost").neutral(kVehicle_ms).in(kFlying).brief(),
    Row(5, "wire-imu-nan", kWire, "imu_nan"),
    Row(5, "wire-imu-huge", kWire, "imu_huge"),
    Row(5, "wire-imu-lost", kWire, "imu_lost"),
    Row(5, "sensor-accel-garbage", kGround, "accel", 3).lasting(0.5),
    Row(5, "sensor-mag-wrong", kGround, "mag", 4).lasting(0.5),
    Row(5, "sensor-baro-off", kGround, "baro", 1),
    Row(5, "sensor-baro-stuck", kGround, "baro", 2),

    // 6: the serial line.
    Row(6, "line-hang-up", kHangUp).lasting(0.4).line_back(50, 500).brief(),
    Row(6, "line-silence", kWire, "silence").neutral(kSilence_ms).brief(),
    Row(6, "line-flood", kWire, "flood", 60000),
    Row(6, "line-noise", kWire, "noise").neutral(kSilence_ms),
    Row(6, "line-bit-flips", kWire, "flip", 500),
    Row(6, "line-bit-flips-many", kWire, "flip", 20),
    Row(6, "line-bytes-lost", kWire, "drop", 500),
    Row(6, "line-bytes-twice", kWire, "duplicate", 500),
    Row(6, "line-late-30-ms", kWire, "delay", 30),
    Row(6, "line-late-400-ms", kWire, "delay", 400).neutral(kSilence_ms),
    Row(6, "line-half-frames", kWire, "half").neutral(kSilence_ms),
    Row(6, "line-reordered", kWire, "reorder"),
    Row(6, "line-half-the-baud-rate", kWire, "baud", 0.5).neutral(kSilence_ms),
    Row(6, "line-twice-the-baud-rate", kWire, "baud", 2).neutral(kSilence_ms),
    Row(6, "line-6-percent-fast", kWire, "baud", 1.06).neutral(kSilence_ms),
    Row(6, "line-silence-outward", kWire, "silence").to("autopilot"),
    Row(6, "line-bit-flips-outward", kWire, "flip", 500).to("autopilot"),

    // 7: the autopilot.
    Row(7, "autopilot-mode", kGround, "mode", 0).lasting(0.4).reported(kBack_ms).brief(),
    Row(7, "autopilot-disarms", kGround, "disarm").reported().alone().brief(),
    Row(7, "autopilot-reboots", kGround, "reboot").lasting(2.5).reported().in(kHover | kIdle).alone(),
    Row(7, "autopilot-clock-ahead", kGround, "clock", 3600),
    Row(7, "autopilot-clock-back", kGround, "clock", -500).saying("clock began anew"),
    Row(7, "wire-clock-step", kWire, "clock_step", 7),
    Row(7, "autopilot-system-id", kWire, "system_id", 7).neutral(kSilence_ms),
    Row(7, "autopilot-heartbeat-mode", kWire, "mode", 9).lasting(2.5).reported(kBack_ms),
    Row(7, "autopilot-heartbeat-disarmed", kWire, "disarmed").lasting(2.5).reported().alone(),
    Row(7, "autopilot-denies", kWire, "deny").in(kLanding),
    Row(7, "stranger-arms-companion", kGround, "arm_companion").unaffected().in(kBoth | kIdle),

    // 8: behaviours.
    Row(8, "behaviour-over-budget", kPoint, "behaviour.spin").to("ground_altitude").lasting(0.25),
    Row(8, "behaviour-endless", kPoint, "behaviour.endless").to("ground_altitude").neutral(kStale_ms, 0).alone(),
    Row(8, "behaviour-nan", kPoint, "behaviour.nan_cue").to("ground_altitude").neutral(kStale_ms),
    Row(8, "behaviour-huge", kPoint, "behaviour.huge_cue").to("ground_altitude"),
    Row(8, "behaviour-denormal", kPoint, "behaviour.denormal").to("ground_altitude"),
    Row(8, "behaviour-fed-nan", kPoint, "behaviour.denormal", 1).to("ground_altitude"),
    Row(8, "behaviour-stuck", kPoint, "behaviour.stuck_cue").to("ground_altitude"),
    Row(8, "behaviour-future", kPoint, "behaviour.future_cue").to("ground_altitude").neutral(kStale_ms),
    Row(8, "behaviour-silent", kPoint, "behaviour.silent").to("ground_altitude").neutral(kStale_ms),
    Row(8, "behaviour-thread-stops", kThreadStop).to("ground_altitude").lasting(0.6).neutral(kStale_ms),

    // 9: the control thread, and its neighbour.
    Row(9, "control-thread-stops", kThreadStop).to("control").guarded(kHang_ms, 0).brief(),
    Row(9, "control-stalls", kPoint, "control.stall").lasting(0.4).neutral(kHang_ms).noisy(),
    Row(9, "control-spins", kPoint, "control.spin").noisy(),
    Row(9, "link-thread-stops", kThreadStop).to("link").lasting(0.6).neutral(kSilence_ms),

    // 10: the flight process.
    Row(10, "flight-killed", kSignal, "kill").to("flight").guarded().brief(),
    Row(10, "flight-stopped", kSignal, "stop").to("flight").guarded(),
    Row(10, "flight-segv", kSignal, "segv").to("flight").guarded(),
    Row(10, "flight-abort-signal", kSignal, "abort").to("flight").guarded(),
    Row(10, "flight-aborts", kPoint, "process.abort").guarded(),
    Row(10, "flight-wild-read", kPoint, "process.segv").guarded(),
    Row(10, "guardian-killed", kSignal, "kill").to("guardian").ends().saying("landing in order").alone(),
    Row(10, "guardian-stopped", kSignal, "stop").to("guardian").unaffected(),

    // 11: observers.
    Row(11, "recorder-killed", kSignal, "kill").to("recorder").unaffected().brief(),
    Row(11, "recorder-stopped", kSignal, "stop").to("recorder").lasting(2).unaffected().in(kCruise),
    Row(11, "monitor-killed", kSignal, "kill").to("monitor").unaffected().in(kBoth),
    Row(11, "monitor-stopped", kSignal, "stop").to("monitor").lasting(2).unaffected().in(kBoth),
    Row(11, "gateway-killed", kSignal, "kill").to("gateway").unaffected().in(kBoth),
    Row(11, "gateway-stopped", kSignal, "stop").to("gateway").lasting(2).unaffected().in(kBoth),
    Row(11, "gateway-daemon-stopped", kSignal, "stop").to("daemon").lasting(2).unaffected().in(kBoth),
    Row(11, "gateway-daemon-killed", kSignal, "kill").to("daemon").unaffected().in(kBoth),

    // 12: load.
    Row(12, "hog-fifo-99", kHog, "", 99).lasting(0.13).noisy(),
    Row(12, "hog-fifo-50", kHog, "", 50).lasting(0.4).noisy(),
    Row(12, "load-cpu", kLoad, "cpu", 4).lasting(3).noisy(),
    Row(12, "load-memory", kLoad, "vm", 1).lasting(3).noisy(),
    Row(12, "load-disk", kLoad, "hdd", 1).lasting(3).noisy(),
    Row(12, "load-interrupts", kLoad, "timer", 2).lasting(3).noisy(),
    Row(12, "load-switches", kLoad, "switch", 2).lasting(3).noisy(),
    Row(12, "load-forks", kLoad, "fork", 2).lasting(3).noisy(),

    // 13: rights.
    Row(13, "policy-stolen", kSteal, "policy").to("control").lasting(2).said(" is now ", 1000),
    Row(13, "priority-stolen", kSteal, "priority", 10).to("control").lasting(2).said(" is now ", 1000),
    Row(13, "core-stolen", kSteal, "core", 0).to("control").lasting(2).said(" is now ", 1000),
    Row(13, "link-policy-stolen", kSteal, "policy").to("link").lasting(2).said(" is now ", 1000),
    Row(13, "memlock-limit", kLimit, "memlock", 8 << 20).to("flight").unaffected(),
    Row(13, "core-offlined", kCore).lasting(2).said(" is now ", 1000).own_machine(),
    Row(13, "start-memlock", kStart, "memlock 8 MiB").refused("memlock|lock"),
    Row(13, "start-no-priority", kStart, "no priority").refused("SCHED_FIFO|rtprio|priority"),
    Row(13, "start-budget", kStart, "budget").refused("sched_rt_runtime_us"),
    Row(13, "start-budget-of-the-kernel", kStart, "budget of the kernel").refused("sched_rt_runtime_us").own_machine(),

    // 14: wall time.
    Row(14, "wall-clock-year-ahead", kClock, "", 365.25 * 86400).unaffected().own_machine(),
    Row(14, "wall-clock-year-back", kClock, "", -365.25 * 86400).unaffected().own_machine(),
    Row(14, "start-time-namespace", kStart, "time namespace").refused("another time namespace.*3600 s"),

    // 15: disks, descriptors, memory files.
    Row(15, "recorder-file-limit", kLimit, "fsize", 4096).to("recorder").lasting(2).unaffected(),
    Row(15, "flight-no-descriptors", kLimit, "nofile", 3).to("flight").unaffected(),
    Row(15, "flight-uses-up-descriptors", kPoint, "process.descriptors").unaffected(),
    Row(15, "flight-file-limit", kLimit, "fsize", 0).to("flight").unaffected(),
    Row(15, "start-shm-full", kStart, "shm full").refused("/dev/shm"),
    Row(15, "start-no-descriptors", kStart, "no descriptors").refused("Too many open files"),
    Row(15, "recorder-disk-full", kDisk, "full").to("recorder").lasting(3).unaffected(),
    Row(15, "recorder-disk-errors", kDisk, "errors").to("recorder").lasting(2).unaffected(),
    Row(15, "recorder-disk-slow", kDisk, "slow", 400).to("recorder").lasting(3).unaffected(),

    // 16: shared memory.
    Row(16, "camera-bits-flip", kRegion, "flip_pixels", 2000).to("camera"),
    Row(16, "camera-directory-flips", kRegion, "flip_directory", 200).to("camera"),
    Row(16, "camera-file-cut", kRegion, "cut", 8192)
        .to("camera")
        .neutral(kStale_ms, 0)
        .saying("shared memory lost")
        .in(kBoth)
        .alone(),
    Row(16, "camera-file-removed", kRegion, "remove").to("camera").unaffected().alone(),
    Row(16, "camera-second-writer", kRegion, "second_writer").to("camera").unaffected(),
    Row(16, "flight-bits-flip", kRegion, "flip_pixels", 200).to("flight").in(kBoth).alone(),
    Row(16, "flight-second-writer", kRegion, "second_writer").to("flight").unaffected().brief(),
    Row(16, "start-stale-layout", kStart, "stale layout").refused("layout version"),
    Row(16, "start-second-flight", kStart, "second flight").refused("writer|written|lock|another"),

    // 17: hostile input.
    Row(17, "config-unknown-key", kStart, "unknown key").refused("bad:2.*rate_hx").brief(),
    Row(17, "config-out-of-range", kStart, "out of range").refused("rate_hz"),
    Row(17, "config-nan", kStart, "not a number").refused("max_tilt_deg"),
    Row(17, "config-wrong-type", kStart, "wrong type").refused("rate_hz"),
    Row(17, "config-not-toml", kStart, "not TOML").refused("bad"),
    Row(17, "config-key-twice", kStart, "key twice").refused("bad"),
    Row(17, "config-binary", kStart, "binary").refused("bad"),
    Row(17, "config-no-such-behaviour", kStart, "no such behaviour").refused("levitation"),
    Row(17, "config-absent", kStart, "no such file").refused("absent.toml"),
    Row(17, "line-absent", kStart, "no serial line").refused("/dev/absent"),
    Row(17, "line-baud-unknown", kStart, "no baud rate").refused("12345"),
    Row(17, "recording-absent", kStart, "no recording").refused("absent"),
    Row(17, "recording-empty", kStart, "empty recording").refused("rec"),
    Row(17, "recording-broken", kStart, "broken recording").refused("depth.txt|rec"),
    Row(17, "world-broken", kStart, "broken world").refused("bad"),
    Row(17, "sim-config-broken", kStart, "broken sim config").refused("mass_kg"),
    Row(17, "timeline-unknown-point", kStart, "broken timeline").refused("bad:[0-9].*no fault point"),
    Row(17, "timeline-unknown-key", kStart, "timeline key").refused("bad:[0-9].*whom"),

    // 18: the board.
    Row(18, "board-unwatched", kBoard).restarts().in(kHover),
    Row(18, "start-watchdog-absent", kStart, "no watchdog").refused("hardware watchdog /dev/absent"),
    Row(18, "start-watchdog-is-none", kStart, "not a watchdog").refused("hardware watchdog /dev/null"),
};

}  // namespace

std::span<const Fault> catalogue() { return kRows; }

}  // namespace wasp::faults
