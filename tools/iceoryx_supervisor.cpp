#include "tools/iceoryx_supervisor.h"

#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <new>
#include <stdexcept>
#include <string>

#include "rt/clock.h"
#include "tools/iceoryx_daemon.h"

namespace wasp::iceoryx {
namespace {

constexpr DurationNs kStandstill = 5 * kSecond;
constexpr DurationNs kLook = 50 * kMillisecond;
constexpr int kEarlyDeaths = 3;  ///< in a row, before a worker was ever connected

std::atomic<bool> stop_flag{false};

void say(const std::string& text) { std::fprintf(stderr, "wasp-iceoryx: %s\n", text.c_str()); }

void catch_stop_signals() {
  struct sigaction action {};
  action.sa_handler = [](int) { stop_flag = true; };
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaction(signal, &action, nullptr);
}

[[noreturn]] void be_the_worker(const std::function<int(Shared&)>& work, Shared& shared, pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(kFailed);
  setpgid(0, 0);  // Ctrl-C reaches the parent, which tells us
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  int code = kFailed;
  try {
    code = work(shared);
  } catch (const std::exception& e) {
    say(e.what());
  }
  std::exit(code);  // not _exit: iceoryx signs off with its daemon here
}

/// One worker and what the parent knows of it.
class Worker {
 public:
  Worker(const std::function<int(Shared&)>& work, Shared& shared) : shared_(shared) {
    shared.phase = Phase::kWaiting;
    const pid_t parent = getpid();
    pid_ = fork();
    if (pid_ < 0) throw std::runtime_error(std::string("fork: ") + std::strerror(errno));
    if (pid_ == 0) be_the_worker(work, shared, parent);
    beat_at_ns_ = looked_at_ns_ = rt::now();
    last_beat_ = shared.beats.load();
  }
  /// True once it has ended; `status()` is then that of waitpid.
  bool ended() { return waitpid(pid_, &status_, WNOHANG) == pid_; }
  [[nodiscard]] pid_t pid() const { return pid_; }
  [[nodiscard]] int status() const { return status_; }
  void tell(int signal) const { kill(pid_, signal); }

  /// True if no beat came for too long. Time this process itself stood still (Ctrl-Z) does not count.
  bool stands_still() {
    const TimeNs now = rt::now();
    const bool paused = now - looked_at_ns_ > kSecond;
    looked_at_ns_ = now;
    if (const std::uint64_t beats = shared_.beats.load(); beats != last_beat_ || paused) {
      last_beat_ = beats;
      beat_at_ns_ = now;
    }
    return now - beat_at_ns_ > kStandstill;
  }
  int kill_and_wait() {
    tell(SIGKILL);
    waitpid(pid_, &status_, 0);
    return status_;
  }

 private:
  Shared& shared_;
  pid_t pid_ = -1;
  int status_ = 0;
  TimeNs beat_at_ns_ = 0, looked_at_ns_ = 0;
  std::uint64_t last_beat_ = 0;
};

/// iceoryx's socket and lock of a client that could not say good-bye; connect() in iceoryx_runtime.cpp names them.
void sweep_after(pid_t worker) {
  const std::string path = "/tmp/wasp-iceoryx-" + std::to_string(worker);
  unlink(path.c_str());
  unlink((path + ".lock").c_str());
}

/// Asked to stop: three seconds for a good-bye, then the end.
int stop(Worker& worker) {
  worker.tell(SIGTERM);
  for (const TimeNs limit = rt::now() + 3 * kSecond; rt::now() < limit; rt::sleep_until(rt::now() + kLook / 5))
    if (worker.ended()) return WIFEXITED(worker.status()) ? WEXITSTATUS(worker.status()) : kDone;
  worker.kill_and_wait();
  return kDone;
}

std::string standstill(Phase phase) {
  if (phase != Phase::kConnecting) return "the worker stands still (stopped, or waiting for a lock inside iceoryx)";
  const pid_t daemon = daemon_pid();
  if (daemon == 0) return "iox-roudi ended while we registered with it";
  return "iox-roudi (process " + std::to_string(daemon) + ") does not answer" +
         (is_stopped(daemon) ? ": it is stopped; `kill -CONT " + std::to_string(daemon) + "` lets it go on" : "");
}

/// Watches one worker to its end. Exit code of the program, or kReconnect: another worker is wanted.
int watch(Worker& worker, const Shared& shared) {
  while (!worker.ended()) {
    if (stop_requested()) return stop(worker);
    if (worker.stands_still()) {
      say(standstill(shared.phase.load()) + (shared.was_running ? "; replacing the worker" : ""));
      worker.kill_and_wait();
      return shared.was_running ? kReconnect : kNoDaemon;
    }
    rt::sleep_until(rt::now() + kLook);
  }
  if (WIFEXITED(worker.status())) return WEXITSTATUS(worker.status());
  say(std::string("the worker was ended by ") + strsignal(WTERMSIG(worker.status())) +
      (WTERMSIG(worker.status()) == SIGABRT ? " (iceoryx ends clients its daemon has forgotten)" : "") +
      "; starting another");
  return kReconnect;
}

}  // namespace

bool stop_requested() { return stop_flag.load(std::memory_order_relaxed); }

Shared& map_shared() {
  void* memory = mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) throw std::runtime_error(std::string("mmap: ") + std::strerror(errno));
  return *new (memory) Shared;
}

int supervise(Shared& shared, const std::function<int(Shared&)>& work) {
  catch_stop_signals();
  for (int early_deaths = 0; !stop_requested();) {
    Worker worker(work, shared);
    const int code = watch(worker, shared);
    sweep_after(worker.pid());
    if (code != kReconnect) return code;
    if (stop_requested()) break;
    early_deaths = shared.was_running ? 0 : early_deaths + 1;
    if (early_deaths >= kEarlyDeaths) return kFailed;
    shared.worker_restarts.fetch_add(1);
    rt::sleep_until(rt::now() + 200 * kMillisecond);
  }
  return kDone;
}

}  // namespace wasp::iceoryx
