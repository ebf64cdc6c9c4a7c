#include "tools/roudi_process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "rt/clock.h"
#include "tools/iceoryx_daemon.h"

namespace wasp::tools {
namespace {

/// Room for small messages, 64 grey and 64 depth frames of 640x480.
constexpr const char* kConfig = R"([general]
version = 1
[[segment]]
[[segment.mempool]]
size = 1024
count = 2000
[[segment.mempool]]
size = 320000
count = 64
[[segment.mempool]]
size = 640000
count = 64
)";

std::string temporary(const std::string& name) { return (std::filesystem::temp_directory_path() / name).string(); }

}  // namespace

RoudiProcess::RoudiProcess(Options options)
    : options_(std::move(options)), config_path_(temporary("wasp-roudi." + std::to_string(getpid()) + ".toml")) {
  if (!take_turn()) return;
  if (const pid_t pid = iceoryx::daemon_pid(); pid != 0) {
    trouble_ = "an iceoryx daemon that is not ours runs already (process " + std::to_string(pid) + ")";
    return;
  }
  std::ofstream(config_path_) << kConfig;
  start();
}

bool RoudiProcess::take_turn() {
  turn_fd_ = open(temporary("wasp-roudi.turn").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  const TimeNs deadline = rt::now() + from_seconds(options_.patience_s);
  while (flock(turn_fd_, LOCK_EX | LOCK_NB) != 0) {
    if (rt::now() > deadline || options_.interrupted()) {
      trouble_ = "another test or benchmark of wasp keeps its iceoryx daemon";
      return false;
    }
    rt::sleep_until(rt::now() + 20 * kMillisecond);
  }
  return true;
}

void RoudiProcess::start() {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) {
    trouble_ = "no pipe";
    return;
  }
  const pid_t parent = getpid();
  pid_ = fork();
  if (pid_ == 0) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != parent) _exit(1);
    setpgid(0, 0);  // Ctrl-C is for the parent, which stops us last
    dup2(ends[1], STDOUT_FILENO);
    dup2(ends[1], STDERR_FILENO);
    execlp("iox-roudi", "iox-roudi", "-c", config_path_.c_str(), "-m", options_.monitoring ? "on" : "off", "-l", "info",
           static_cast<char*>(nullptr));
    _exit(127);
  }
  close(ends[1]);
  said_.clear();
  listener_ = std::thread([this, fd = ends[0]] { listen(fd); });
  trouble_ = await_ready();
}

/// Reads until the daemon's end, so that its words never block or kill it.
void RoudiProcess::listen(int fd) {
  char text[512];
  for (ssize_t n = 0; (n = read(fd, text, sizeof text)) > 0;) {
    const std::lock_guard lock(said_mutex_);
    said_.append(text, static_cast<std::size_t>(n));
  }
  close(fd);
}

std::string RoudiProcess::said() const {
  const std::lock_guard lock(said_mutex_);
  return said_;
}

std::string RoudiProcess::await_ready() {
  for (const TimeNs deadline = rt::now() + 60 * kSecond; rt::now() < deadline && !options_.interrupted();) {
    if (said().find("ready for clients") != std::string::npos) return {};
    int status = 0;
    if (waitpid(pid_, &status, WNOHANG) == pid_) {
      pid_ = -1;
      if (WIFEXITED(status) && WEXITSTATUS(status) == 127) return "iox-roudi is not on this machine (package iceoryx)";
      return "iox-roudi ended: " + said();
    }
    rt::sleep_until(rt::now() + 5 * kMillisecond);
  }
  return "iox-roudi did not become ready: " + said();
}

void RoudiProcess::signal(int number) const {
  if (pid_ > 0) kill(pid_, number);
}

bool RoudiProcess::replace() {
  end(SIGKILL);
  start();
  return trouble_.empty();
}

void RoudiProcess::end(int signal) {
  if (pid_ > 0) {
    kill(pid_, signal);
    kill(pid_, SIGCONT);
    const TimeNs deadline = rt::now() + 3 * kSecond;
    while (waitpid(pid_, nullptr, WNOHANG) == 0) {
      if (rt::now() > deadline) kill(pid_, SIGKILL);
      rt::sleep_until(rt::now() + 5 * kMillisecond);
    }
    pid_ = -1;
  }
  if (listener_.joinable()) listener_.join();
}

RoudiProcess::~RoudiProcess() {
  const bool ours = pid_ > 0;
  end(SIGTERM);
  std::error_code ignored;
  std::filesystem::remove(config_path_, ignored);
  if (ours) std::filesystem::remove("/dev/shm/iceoryx_mgmt", ignored);  // left only if SIGTERM did not do
  if (turn_fd_ >= 0) close(turn_fd_);
}

}  // namespace wasp::tools
