#include "faults/flight_under_test.h"

#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "control/mission.h"
#include "rt/clock.h"
#include "scheduling/config.h"
#include "shm/topics.h"

namespace wasp::faults {
namespace {

namespace fs = std::filesystem;

constexpr double kComesUp_s = 60;
constexpr DurationNs kReferencePeriod = kMillisecond;
constexpr std::size_t kReferenceRoom = 900'000;  // 15 minutes
constexpr int kReferencePriority = 90;
constexpr int kControlCore = 1;
constexpr float kTakenOff_m = 2.1f, kAlmostDown_m = 0.5f;

std::string first_line(const fs::path& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}

std::unique_ptr<tools::WakeupLoop> start_reference() {
  tools::WakeupSpec spec{.core = rt::nearest_usable_core(kControlCore),
                         .priority = kReferencePriority,
                         .period_ns = kReferencePeriod,
                         .first_due_ns = rt::now() + kReferencePeriod,
                         .capacity = kReferenceRoom};
  try {
    return std::make_unique<tools::WakeupLoop>(spec);
  } catch (const std::exception&) {
    spec.priority = 0;  // no right to it
    return std::make_unique<tools::WakeupLoop>(spec);
  }
}

bool in_leg(const Command& c, int leg) {
  return control::leg_of(static_cast<control::MissionPhase>(c.mission_phase)) == leg;
}

/// Has the flight reached the point where faults of the phase begin?
bool reached(Phase phase, const Command& c, DurationNs in_phase_ns) {
  using control::MissionPhase;
  const auto mission = static_cast<MissionPhase>(c.mission_phase);
  switch (phase) {
    case Phase::kIdle:
      return mission == MissionPhase::kArm && in_phase_ns > kSecond;
    case Phase::kTakeOff:
      return in_leg(c, 0) && c.height_m > 0.35f && c.height_m < kTakenOff_m;
    case Phase::kHover:
      return in_leg(c, 0) && in_phase_ns > 3 * kSecond && std::abs(c.height_m - c.height_setpoint_m) < 0.15f;
    case Phase::kCruise:
      return in_leg(c, 1) && in_phase_ns > 3 * kSecond && c.velocity_forward_mps > 0.15f;
    case Phase::kLanding:
      return mission == MissionPhase::kLand && in_phase_ns > 200 * kMillisecond && c.height_m > kAlmostDown_m;
  }
  return false;
}

bool passed(Phase phase, const Command& c) {
  using control::MissionPhase;
  const auto mission = static_cast<MissionPhase>(c.mission_phase);
  if (phase == Phase::kTakeOff) return mission == MissionPhase::kLand || (in_leg(c, 0) && c.height_m >= kTakenOff_m);
  if (phase != Phase::kLanding) return false;
  return mission > MissionPhase::kLand || (mission == MissionPhase::kLand && c.height_m <= kAlmostDown_m);
}

}  // namespace

std::vector<pid_t> children_of(pid_t pid) {
  std::vector<pid_t> children;
  std::ifstream file(fmt::format("/proc/{}/task/{}/children", pid, pid));
  for (pid_t child = 0; file >> child;) children.push_back(child);
  return children;
}

std::vector<std::pair<pid_t, std::string>> threads_of(pid_t pid) {
  std::vector<std::pair<pid_t, std::string>> threads;
  std::error_code gone;
  for (const auto& entry : fs::directory_iterator(fmt::format("/proc/{}/task", pid), gone))
    threads.emplace_back(std::stoi(entry.path().filename()), first_line(entry.path() / "comm"));
  return threads;
}

FlightUnderTest::FlightUnderTest(const FlightPlan& plan) : plan_(plan) {
  write_configuration(plan_);
  sim_.emplace(sim_arguments(plan_), (plan_.folder / "sim.txt").string());
  wait_until_there(autopilot_line(plan_), *sim_);
  tap_ = std::make_unique<WireTap>(autopilot_line(plan_), flight_line(plan_));
  if (plan_.phase == Phase::kIdle) held_ = tap_->add({WireFaultKind::kNoCommand, Direction::kToAutopilot});
  if (plan_.replay.empty()) {
    start_camera();
    wait_until_there("/dev/shm/" + shm::camera_region(plan_.instance), *camera_);
  }
  watch_ = std::make_unique<FlightWatch>(plan_.instance);
  if (plan_.observers.contains("gateway") || plan_.observers.contains("daemon"))
    daemon_ = std::make_unique<GatewayDaemon>();
  for (const auto observer : kObservers)
    if (plan_.observers.contains(observer) && observer != "daemon") start_observer(observer);
  reference_ = start_reference();
  flight_.emplace(flight_arguments(plan_), (plan_.folder / "flight.txt").string());
}

FlightUnderTest::~FlightUnderTest() {
  end(1);
  reference_.reset();
  for (auto& [name, observer] : observers_) {
    observer.signal(SIGCONT);
    observer.end(SIGTERM, 5);
  }
  daemon_.reset();
  for (auto* child : {&camera_, &sim_})
    if (*child) {
      (*child)->signal(SIGCONT);
      (*child)->end(SIGTERM, 5);
    }
  watch_.reset();
  tap_.reset();
  for (const auto& region : {shm::flight_region(plan_.instance), shm::camera_region(plan_.instance),
                             shm::truth_region(plan_.instance), "wasp." + plan_.instance + ".relay"})
    shm::Region::remove(region);
}

void FlightUnderTest::wait_until_there(const std::string& path, tools::ChildProcess& by) {
  const TimeNs deadline_ns = rt::now() + from_seconds(kComesUp_s);
  while (!fs::exists(path)) {
    if (const auto code = by.poll()) throw std::runtime_error(fmt::format("{} ended with code {}", by.name(), *code));
    if (rt::now() > deadline_ns) throw std::runtime_error(path + " did not come up");
    rt::sleep_until(rt::now() + 10 * kMillisecond);
  }
}

void FlightUnderTest::start_camera() {
  camera_.reset();
  camera_.emplace(camera_arguments(plan_), (plan_.folder / "camera.txt").string());
}

void FlightUnderTest::start_observer(std::string_view name) {
  observers_.erase(std::string(name));
  auto arguments = observer_arguments(plan_, name);
  if (name == "recorder") {
    recording_ = plan_.folder / fmt::format("recording-{}", ++recordings_);
    arguments.insert(arguments.end(), {"--out", recording_.string()});
  }
  observers_.try_emplace(std::string(name), arguments, (plan_.folder / fmt::format("{}.txt", name)).string());
}

void FlightUnderTest::start_recorder_on_small_disk() {
  const fs::path disk = plan_.folder / "disk";
  fs::create_directories(disk);
  const std::string script =
      fmt::format("mount -t tmpfs -o size=256k tmpfs '{0}' && exec {1} --instance {2} --out '{0}'", disk.string(),
                  observer_arguments(plan_, "recorder").front(), plan_.instance);
  observers_.erase("recorder");
  observers_.try_emplace("recorder", std::vector<std::string>{"/usr/bin/unshare", "-m", "/bin/sh", "-c", script},
                         (plan_.folder / "recorder.txt").string());
}

RecorderAccount FlightUnderTest::recorder_account() {
  const auto recorder = observers_.find("recorder");
  if (recorder == observers_.end()) return {};
  recorder->second.signal(SIGCONT);
  recorder->second.end(SIGTERM, 20);
  return read_account(recording_);
}

std::optional<int> FlightUnderTest::exit_code() {
  if (orphan_ <= 0) return flight_->poll();
  int status = 0;
  if (!orphan_code_ && waitpid(orphan_, &status, WNOHANG) == orphan_)
    orphan_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return orphan_code_;
}

void FlightUnderTest::orphan_flight() {
  prctl(PR_SET_CHILD_SUBREAPER, 1);  // else nobody could tell how it ends
  orphan_ = pid_of("flight");
}

bool FlightUnderTest::running() { return flight_ && !exit_code(); }

bool FlightUnderTest::wait_for(Phase phase, double patience_s) {
  const TimeNs deadline_ns = rt::now() + from_seconds(patience_s);
  while (running() && rt::now() < deadline_ns) {
    if (reached(phase, watch_->newest(), rt::now() - watch_->phase_since_ns())) return true;
    rt::sleep_until(rt::now() + 5 * kMillisecond);
  }
  return false;
}

bool FlightUnderTest::commanded(Phase phase) {
  const Command c = watch_->newest();
  if (!running() || rt::now() - c.released_at_ns > 200 * kMillisecond) return false;
  return c.mode == (phase == Phase::kIdle ? FlightMode::kDisarmed : FlightMode::kBehaviour);
}

bool FlightUnderTest::past(Phase phase) { return passed(phase, watch_->newest()); }

bool FlightUnderTest::settled(Phase phase) {
  return commanded(phase) && reached(phase, watch_->newest(), rt::now() - watch_->phase_since_ns());
}

int FlightUnderTest::end(double patience_s) {
  if (!flight_) return 0;
  if (const pid_t flying = pid_of("flight"); flying > 0) kill(flying, SIGCONT);
  flight_->signal(SIGCONT);
  if (!flight_->poll()) flight_->signal(SIGINT);
  if (orphan_ > 0) end_orphan(patience_s);
  return flight_->end(SIGINT, patience_s);
}

void FlightUnderTest::end_orphan(double patience_s) {
  const TimeNs deadline_ns = rt::now() + from_seconds(patience_s);
  while (!exit_code() && rt::now() < deadline_ns) rt::sleep_until(rt::now() + 5 * kMillisecond);
  if (exit_code()) return;
  kill(orphan_, SIGKILL);
  waitpid(orphan_, nullptr, 0);
  orphan_code_ = 128 + SIGKILL;
}

pid_t FlightUnderTest::pid_of(std::string_view name) const {
  const bool guarded = plan_.guarded && plan_.abilities.guardian;
  const auto pid = [](const std::optional<tools::ChildProcess>& child) { return child ? child->pid() : -1; };
  if (name == "sim") return pid(sim_);
  if (name == "camera") return pid(camera_);
  if (name == "daemon") return daemon_ ? daemon_->pid() : -1;
  if (const auto observer = observers_.find(name); observer != observers_.end()) return observer->second.pid();
  if (name == "guardian") return guarded ? pid(flight_) : -1;
  if (!guarded) return pid(flight_);
  if (orphan_ > 0) return orphan_code_ ? -1 : orphan_;
  const auto children = flight_ ? children_of(flight_->pid()) : std::vector<pid_t>{};
  return children.empty() ? -1 : children.front();
}

pid_t FlightUnderTest::thread_of(std::string_view name) const {
  for (const auto& [tid, comm] : threads_of(pid_of("flight")))
    if (comm == name.substr(0, 15)) return tid;
  return -1;
}

std::string FlightUnderTest::ask_flight(const std::string& request) {
  const int fd = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string path = fault_socket(plan_);
  std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
  const timeval patience{5, 0};
  setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  std::array<char, 16384> answer{};
  ssize_t n = -1;
  if (connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 &&
      send(fd, request.data(), request.size(), MSG_NOSIGNAL) > 0)
    n = recv(fd, answer.data(), answer.size(), 0);
  const std::string why = n < 0 ? std::string("error ") + std::strerror(errno) : std::string();
  close(fd);
  return n < 0 ? why : std::string(answer.data(), static_cast<std::size_t>(n));
}

const WireReader& FlightUnderTest::wire() {
  wire_.follow(tap_->log());
  return wire_;
}

std::vector<LogLine> FlightUnderTest::log() const {
  std::vector<LogLine> lines;
  std::ifstream file(plan_.folder / "flight.txt");
  for (std::string line; std::getline(file, line);) {
    char* rest = nullptr;
    const double seconds = std::strtod(line.c_str(), &rest);
    lines.push_back({rest == line.c_str() ? 0 : from_seconds(seconds), line});
  }
  return lines;
}

std::vector<tools::Wakeup> FlightUnderTest::reference() {
  return reference_ ? reference_->finish() : std::vector<tools::Wakeup>{};
}

}  // namespace wasp::faults
