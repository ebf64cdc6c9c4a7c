#include "faults/injector.h"

#include <fmt/format.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <memory>
#include <optional>

#include "faults/region_tamper.h"
#include "faults/thread_tamper.h"
#include "rt/clock.h"
#include "shm/topics.h"

namespace wasp::faults {
namespace {

constexpr int kControlCore = 1;
constexpr const char* kStress = "/usr/bin/stress-ng";
constexpr const char* kTracer = "/usr/bin/strace";
constexpr float kForceDisarm = 21196.f, kForceReboot = 20190226.f;
constexpr std::uint16_t kClockStep = 31010;  // of our simulator: sim/autopilot_link.h

template <class Value>
struct Named {
  std::string_view name;
  Value value;
};

template <class Value, std::size_t N>
std::optional<Value> find(const std::array<Named<Value>, N>& rows, std::string_view name) {
  for (const auto& row : rows)
    if (row.name == name) return row.value;
  return std::nullopt;
}

constexpr std::array kWireKinds = {
    Named<WireFaultKind>{"silence", WireFaultKind::kSilence},
    Named<WireFaultKind>{"flood", WireFaultKind::kFlood},
    Named<WireFaultKind>{"noise", WireFaultKind::kNoise},
    Named<WireFaultKind>{"flip", WireFaultKind::kFlip},
    Named<WireFaultKind>{"drop", WireFaultKind::kDrop},
    Named<WireFaultKind>{"duplicate", WireFaultKind::kDuplicate},
    Named<WireFaultKind>{"delay", WireFaultKind::kDelay},
    Named<WireFaultKind>{"half", WireFaultKind::kHalf},
    Named<WireFaultKind>{"baud", WireFaultKind::kBaud},
    Named<WireFaultKind>{"reorder", WireFaultKind::kReorder},
    Named<WireFaultKind>{"system_id", WireFaultKind::kSystemId},
    Named<WireFaultKind>{"mode", WireFaultKind::kMode},
    Named<WireFaultKind>{"disarmed", WireFaultKind::kDisarmed},
    Named<WireFaultKind>{"deny", WireFaultKind::kDenyCommand},
    Named<WireFaultKind>{"attitude_nan", WireFaultKind::kAttitudeNan},
    Named<WireFaultKind>{"attitude_frozen", WireFaultKind::kAttitudeFrozen},
    Named<WireFaultKind>{"attitude_slow", WireFaultKind::kAttitudeSlow},
    Named<WireFaultKind>{"attitude_spike", WireFaultKind::kAttitudeSpike},
    Named<WireFaultKind>{"attitude_lost", WireFaultKind::kAttitudeLost},
    Named<WireFaultKind>{"imu_nan", WireFaultKind::kImuNan},
    Named<WireFaultKind>{"imu_huge", WireFaultKind::kImuHuge},
    Named<WireFaultKind>{"imu_lost", WireFaultKind::kImuLost},
    Named<WireFaultKind>{"clock_step", WireFaultKind::kClockStep},
};

constexpr std::array kSignals = {Named<int>{"kill", SIGKILL}, Named<int>{"stop", SIGSTOP}, Named<int>{"segv", SIGSEGV},
                                 Named<int>{"abort", SIGABRT}, Named<int>{"hup", SIGHUP}};

constexpr std::array kLimits = {Named<int>{"memlock", RLIMIT_MEMLOCK}, Named<int>{"nofile", RLIMIT_NOFILE},
                                Named<int>{"fsize", RLIMIT_FSIZE}, Named<int>{"rtprio", RLIMIT_RTPRIO},
                                Named<int>{"as", RLIMIT_AS}};

constexpr std::array kUnits = {Named<float>{"gyro", 0}, Named<float>{"accel", 1}, Named<float>{"mag", 2},
                               Named<float>{"baro", 3}};

bool traced(pid_t pid) {
  std::ifstream status(fmt::format("/proc/{}/status", pid));
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("TracerPid:")) return std::stoi(line.substr(10)) != 0;
  return false;
}

Injected failed(std::string why) { return {rt::now(), std::move(why), {}}; }

/// As a ground station, system 255.
std::vector<std::uint8_t> command(std::uint16_t id, std::array<float, 7> p, std::uint8_t to_component = 1) {
  static mavlink::Encoder encoder(255, 190);
  mavlink::CommandLong m{};
  m.param1 = p[0], m.param2 = p[1], m.param3 = p[2], m.param4 = p[3], m.param5 = p[4], m.param6 = p[5], m.param7 = p[6];
  m.command = id, m.target_system = 1, m.target_component = to_component;
  std::vector<std::uint8_t> bytes(mavlink::kMaxFrame);
  bytes.resize(encoder.encode(m, bytes));
  return bytes;
}

Injected point(const Fault& f, FlightUnderTest& flight) {
  std::string request = fmt::format("inject {} for {}", f.what, f.for_s);
  if (f.value != 0) request += fmt::format(" value {}", f.value);
  if (!f.target.empty()) request += fmt::format(" behaviour {}", f.target);
  const std::string answer = flight.ask_flight(request);
  const auto at = answer.rfind(" at ");
  if (!answer.starts_with("ok") || at == std::string::npos) return failed("fault socket: " + answer);
  return {std::stoll(answer.substr(at + 4)), {}, {}};
}

Injected wire(const Fault& f, FlightUnderTest& flight, std::uint32_t seed) {
  const auto kind = find(kWireKinds, f.what);
  if (!kind) return failed(fmt::format("no wire fault '{}'", f.what));
  const Direction direction = f.target == "autopilot" ? Direction::kToAutopilot : Direction::kToFlight;
  const TimeNs at_ns = rt::now();
  const int number = flight.tap().add({*kind, direction, f.value, seed});
  return {at_ns, {}, [&flight, number] { flight.tap().remove(number); }};
}

Injected hang_up(FlightUnderTest& flight) {
  const TimeNs at_ns = rt::now();
  flight.tap().hang_up();
  return {at_ns, {}, [&flight] { flight.tap().come_back(); }};
}

Injected ground(const Fault& f, FlightUnderTest& flight) {
  using namespace mavlink;
  const auto say = [&flight](std::uint16_t id, std::array<float, 7> p) {
    flight.tap().inject(Direction::kToAutopilot, command(id, p));
  };
  const TimeNs at_ns = rt::now();
  const auto value = static_cast<float>(f.value);
  if (f.what == "disarm") return say(mav_cmd::kComponentArmDisarm, {0, kForceDisarm}), Injected{at_ns, {}, {}};
  if (f.what == "reboot")
    return say(mav_cmd::kPreflightRebootShutdown, {1, 0, 0, 0, 0, kForceReboot}), Injected{at_ns, {}, {}};
  if (f.what == "clock") return say(kClockStep, {value}), Injected{at_ns, {}, {}};
  if (f.what == "mode") {
    say(mav_cmd::kDoSetMode, {1, value});
    return {at_ns, {}, [say] { say(mav_cmd::kDoSetMode, {1, 1}); }};
  }
  if (f.what == "arm_companion") {
    flight.tap().inject(Direction::kToFlight,
                        command(mav_cmd::kComponentArmDisarm, {1}, mav_component::kCompIdOnboardComputer));
    return {at_ns, {}, {}};
  }
  const auto unit = find(kUnits, f.what);
  if (!unit) return failed(fmt::format("no ground station's command '{}'", f.what));
  say(mav_cmd::kInjectFailure, {*unit, value});
  return {at_ns, {}, [say, unit = *unit] { say(mav_cmd::kInjectFailure, {unit, 0}); }};
}

Injected signal_process(const Fault& f, FlightUnderTest& flight) {
  const auto number = find(kSignals, f.what);
  const pid_t pid = flight.pid_of(f.target);
  if (!number || pid <= 0) return failed(fmt::format("no process '{}'", f.target));
  if (f.target == "guardian" && *number == SIGKILL) flight.orphan_flight();
  const TimeNs at_ns = rt::now();
  if (kill(pid, *number) != 0) return failed("it is gone");
  if (*number == SIGSTOP) return {at_ns, {}, [pid] { kill(pid, SIGCONT); }};
  if (f.target == "camera") return {at_ns, {}, [&flight] { flight.start_camera(); }};
  const bool observer = std::ranges::find(kObservers, f.target) != kObservers.end() && f.target != "daemon";
  if (observer) return {at_ns, {}, [&flight, name = f.target] { flight.start_observer(name); }};
  return {at_ns, {}, {}};
}

Injected stop_thread(const Fault& f, FlightUnderTest& flight) {
  const TimeNs at_ns = rt::now();
  auto stop = std::make_shared<ThreadStop>(flight.thread_of(f.target));
  if (!stop->stopped()) return failed(fmt::format("thread '{}' cannot be stopped", f.target));
  return {at_ns, {}, [stop]() mutable { stop.reset(); }};
}

Injected steal(const Fault& f, FlightUnderTest& flight) {
  const pid_t tid = flight.thread_of(f.target);
  if (tid <= 0) return failed(fmt::format("no thread '{}'", f.target));
  auto theft = std::make_shared<SchedulingTheft>(tid);
  const TimeNs at_ns = rt::now();
  const bool done = f.what == "core"       ? theft->core(static_cast<int>(f.value))
                    : f.what == "priority" ? theft->policy(SCHED_FIFO, static_cast<int>(f.value))
                                           : theft->policy(SCHED_OTHER, 0);
  if (!done) return failed("the kernel refuses");
  return {at_ns, {}, [theft]() mutable { theft.reset(); }};
}

Injected limit(const Fault& f, FlightUnderTest& flight) {
  const auto resource = find(kLimits, f.what);
  const pid_t pid = flight.pid_of(f.target);
  if (!resource || pid <= 0) return failed(fmt::format("no process '{}'", f.target));
  rlimit before{};
  const auto which = static_cast<__rlimit_resource>(*resource);
  prlimit(pid, which, nullptr, &before);
  rlimit now = before;
  now.rlim_cur = static_cast<rlim_t>(f.value);
  const TimeNs at_ns = rt::now();
  if (prlimit(pid, which, &now, nullptr) != 0) return failed("the kernel refuses");
  return {at_ns, {}, [pid, which, before] { prlimit(pid, which, &before, nullptr); }};
}

Injected hog(const Fault& f) {
  try {
    const TimeNs at_ns = rt::now();
    auto hogs = std::make_shared<Hog>(static_cast<int>(f.value), rt::nearest_usable_core(kControlCore));
    return {at_ns, {}, [hogs]() mutable { hogs.reset(); }};
  } catch (const std::exception& error) {
    return failed(error.what());
  }
}

Injected load(const Fault& f, FlightUnderTest& flight) {
  std::vector<std::string> a{kStress,
                             "--quiet",
                             "--timeout",
                             fmt::format("{}", static_cast<int>(f.for_s) + 5),
                             "--temp-path",
                             flight.plan().folder.string(),
                             fmt::format("--{}", f.what),
                             fmt::format("{}", static_cast<int>(f.value))};
  if (f.what == "vm") a.insert(a.end(), {"--vm-bytes", "25%"});
  if (f.what == "hdd") a.insert(a.end(), {"--hdd-bytes", "64M"});
  const TimeNs at_ns = rt::now();
  auto stress = std::make_shared<tools::ChildProcess>(a, (flight.plan().folder / "stress.txt").string());
  return {at_ns, {}, [stress]() mutable { stress->end(SIGINT, 10), stress.reset(); }};
}

Injected tamper_region(const Fault& f, FlightUnderTest& flight, std::uint32_t seed) {
  const bool of_camera = f.target == "camera";
  const std::string name =
      of_camera ? shm::camera_region(flight.plan().instance) : shm::flight_region(flight.plan().instance);
  const auto count = static_cast<std::size_t>(f.value);
  const TimeNs at_ns = rt::now();
  bool done = false;
  if (f.what == "flip_pixels") {
    done = flip_bits(name, 2 * shm::kPage, 0, count, seed);
  } else if (f.what == "flip_directory") {
    done = flip_bits(name, 0, sizeof(shm::RegionHeader), count, seed);
  } else if (f.what == "cut") {
    flight.watch().stop();  // a look would end us, too
    done = cut_short(name, count);
  } else if (f.what == "second_writer") {
    done = second_writer_refused(name);
    if (!done) return {at_ns, "a second writer was let in", {}};
  } else if (f.what == "remove") {
    done = unlink(("/dev/shm/" + name).c_str()) == 0;
  }
  if (!done) return failed(fmt::format("'{}' cannot be done to {}", f.what, name));
  return {at_ns, {}, {}};
}

/// Every write of the recorder fails with EIO, or takes `value` ms more: the kernel's own system calls, by strace.
Injected spoil_disk(const Fault& f, FlightUnderTest& flight) {
  const pid_t recorder = flight.pid_of("recorder");
  const bool slow = f.what == "slow";
  const std::string how = slow ? fmt::format("delay_enter={:.0f}", f.value * 1e3) : std::string("error=EIO");
  const TimeNs at_ns = rt::now();
  auto tracer = std::make_shared<tools::ChildProcess>(
      std::vector<std::string>{kTracer, "-f", "-qq", "-p", std::to_string(recorder), "-e",
                               "inject=write,writev,pwrite64,fsync,fdatasync:" + how, "-o", "/dev/null"},
      (flight.plan().folder / "tracer.txt").string());
  while (!traced(recorder) && !tracer->poll() && rt::now() < at_ns + 10 * kSecond)
    rt::sleep_until(rt::now() + 2 * kMillisecond);
  if (!traced(recorder)) return failed("the recorder cannot be traced");
  return {at_ns, {}, [tracer]() mutable { tracer->end(SIGINT, 10), tracer.reset(); }};
}

/// The core of control, as a machine without it: its threads are moved by the kernel.
Injected take_core() {
  const int core = rt::nearest_usable_core(kControlCore);
  const std::string file = fmt::format("/sys/devices/system/cpu/cpu{}/online", core);
  const TimeNs at_ns = rt::now();
  if (!(std::ofstream(file) << 0).flush()) return failed(file + " cannot be written: the machine keeps this core");
  return {at_ns, {}, [file] { std::ofstream(file) << 1; }};
}

bool shift_wall_clock(double seconds) {
  timespec wall{};
  clock_gettime(CLOCK_REALTIME, &wall);
  wall.tv_sec += static_cast<time_t>(seconds);
  return clock_settime(CLOCK_REALTIME, &wall) == 0;
}

Injected jump_wall_clock(const Fault& f) {
  const TimeNs at_ns = rt::now();
  if (!shift_wall_clock(f.value)) return failed("the kernel refuses");
  return {at_ns, {}, [seconds = f.value] { shift_wall_clock(-seconds); }};
}

}  // namespace

Injected inject(const Fault& fault, FlightUnderTest& flight, std::uint32_t seed) {
  try {
    switch (fault.injector) {
      case Injector::kPoint:
        return point(fault, flight);
      case Injector::kWire:
        return wire(fault, flight, seed);
      case Injector::kHangUp:
        return hang_up(flight);
      case Injector::kGround:
        return ground(fault, flight);
      case Injector::kSignal:
        return signal_process(fault, flight);
      case Injector::kThreadStop:
        return stop_thread(fault, flight);
      case Injector::kSteal:
        return steal(fault, flight);
      case Injector::kLimit:
        return limit(fault, flight);
      case Injector::kHog:
        return hog(fault);
      case Injector::kLoad:
        return load(fault, flight);
      case Injector::kRegion:
        return tamper_region(fault, flight, seed);
      case Injector::kDisk: {
        if (fault.what != "full") return spoil_disk(fault, flight);
        const TimeNs at_ns = rt::now();
        flight.start_recorder_on_small_disk();
        return {at_ns, {}, {}};
      }
      case Injector::kCore:
        return take_core();
      case Injector::kClock:
        return jump_wall_clock(fault);
      case Injector::kBoard:
      case Injector::kStart:
        break;
    }
    return failed("not a fault of a flight under way");
  } catch (const std::exception& error) {
    return failed(error.what());
  }
}

/// Done to the camera, or between it and the behaviours.
static bool needs_camera(const Fault& fault) {
  const bool point =
      fault.injector == Injector::kPoint &&
      (fault.what.starts_with("camera.") || fault.what.starts_with("image.") || fault.what.starts_with("depth."));
  return point || fault.target == "camera";
}

std::string missing_for(const Fault& fault, const Abilities& abilities) {
  if (fault.own_machine && !abilities.own_machine) return "changes the whole machine: in the guest only";
  const bool guardian = fault.promise == Promise::kGuardian || fault.target == "guardian";
  if (guardian && !abilities.guardian) return "this wasp has no guardian";
  if (fault.injector == Injector::kPoint && !abilities.fault_points) return "this wasp has no fault points";
  if (fault.injector == Injector::kStart) return {};
  if (fault.injector == Injector::kBoard) return "the board itself: `wasp rt-guest --arch amd64` does it";
  if (abilities.replay && needs_camera(fault)) return "a replay has no camera process";
  if (!abilities.renderer && !abilities.replay) return "no camera: built without the renderer (--replay does without)";
  const bool scheduling = fault.injector == Injector::kSteal || fault.injector == Injector::kHog;
  if (scheduling && !abilities.real_time) return "needs real-time rights";
  if (fault.injector == Injector::kLoad && access(kStress, X_OK) != 0) return "needs stress-ng";
  const bool traced_disk = fault.injector == Injector::kDisk && fault.what != "full";
  if (traced_disk && access(kTracer, X_OK) != 0) return "needs strace";
  if ((fault.target == "gateway" || fault.target == "daemon") && !abilities.gateway) return "needs wasp-iceoryx";
  return {};
}

}  // namespace wasp::faults
