#include "benchmarks/roudi.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "benchmarks/child.h"
#include "rt/clock.h"

namespace wasp::bench {
namespace {

/// Room for small messages and for 32 frames of 640x480.
constexpr const char* kConfig = R"([general]
version = 1
[[segment]]
[[segment.mempool]]
size = 1024
count = 100
[[segment.mempool]]
size = 320000
count = 32
)";

bool managed_memory_exists() { return std::filesystem::exists("/dev/shm/iceoryx_mgmt"); }

}  // namespace

Roudi::Roudi()
    : config_path_((std::filesystem::temp_directory_path() / ("wasp-bench-roudi." + std::to_string(getpid()) + ".toml"))
                       .string()) {
  if (managed_memory_exists()) {
    trouble_ = "an iceoryx daemon runs already, or left /dev/shm/iceoryx_mgmt behind";
    return;
  }
  std::ofstream(config_path_) << kConfig;
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
    execlp("iox-roudi", "iox-roudi", "-c", config_path_.c_str(), "-m", "off", "-l", "info",
           static_cast<char*>(nullptr));
    _exit(127);
  }
  close(ends[1]);
  trouble_ = await_ready(ends[0]);
  // The read end stays open in this process, so that the daemon's later words do not kill it.
}

std::string Roudi::await_ready(int fd) {
  std::string said;
  for (const TimeNs deadline = rt::now() + 20 * kSecond; rt::now() < deadline && !interrupted();) {
    pollfd poll_fd{fd, POLLIN, 0};
    if (poll(&poll_fd, 1, 100) <= 0) continue;
    char text[512];
    const ssize_t n = read(fd, text, sizeof text);
    if (n <= 0) return said.empty() ? "iox-roudi is not on this machine" : "iox-roudi ended: " + said;
    said.append(text, static_cast<std::size_t>(n));
    if (said.find("ready for clients") != std::string::npos) return {};
  }
  return "iox-roudi did not become ready: " + said;
}

Roudi::~Roudi() {
  std::filesystem::remove(config_path_);
  if (pid_ <= 0) return;
  kill(pid_, SIGTERM);
  const TimeNs deadline = rt::now() + 3 * kSecond;
  while (waitpid(pid_, nullptr, WNOHANG) == 0) {
    if (rt::now() > deadline) kill(pid_, SIGKILL);
    rt::sleep_until(rt::now() + 5 * kMillisecond);
  }
  std::error_code ignored;
  std::filesystem::remove("/dev/shm/iceoryx_mgmt", ignored);  // none was there before us
}

}  // namespace wasp::bench
