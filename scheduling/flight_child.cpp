#include "scheduling/flight_child.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <stdexcept>

#include "scheduling/guard_page.h"

namespace wasp::scheduling {
namespace {

constexpr int kLastInherited = kGoDescriptor;

constexpr int kHurriedNice = -15;

/// Puts page, line, its socket and the word to go where a guarded flight looks for them. Above the targets first: they
/// may be among them.
bool inherit(const std::array<int, 4>& from) {
  std::array<int, 4> safe{};
  for (std::size_t i = 0; i < from.size(); ++i) safe[i] = fcntl(from[i], F_DUPFD_CLOEXEC, kLastInherited + 1);
  bool ok = true;
  for (std::size_t i = 0; i < safe.size(); ++i)
    ok = dup2(safe[i], kPageDescriptor + static_cast<int>(i)) >= 0 && ok;  // dup2 clears close-on-exec
  return ok;
}

}  // namespace

FlightChild::FlightChild(const std::vector<std::string>& command, int page, int line, const cpu_set_t& cores,
                         bool hurried)
    : sockets_(drivers::make_handover()) {
  int go[2];
  if (pipe2(go, O_CLOEXEC) != 0) throw std::runtime_error(std::string("pipe: ") + std::strerror(errno));
  go_fd_ = go[1];
  std::vector<char*> argv;
  for (const auto& word : command) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  const pid_t parent = getpid();
  pid_ = fork();
  if (pid_ < 0) throw std::runtime_error("fork for '" + command[0] + "': " + std::strerror(errno));
  if (pid_ == 0) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != parent) _exit(126);
    sigset_t none;
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, nullptr);
    sched_setaffinity(0, sizeof cores, &cores);
    if (hurried) setpriority(PRIO_PROCESS, 0, kHurriedNice);
    if (inherit({page, line, sockets_.taker, go[0]})) execv(argv[0], argv.data());
    _exit(127);
  }
  close(go[0]);
  pid_fd_ = static_cast<int>(syscall(SYS_pidfd_open, pid_, 0));
  if (pid_fd_ >= 0) fcntl(pid_fd_, F_SETFD, FD_CLOEXEC);
}

FlightChild::~FlightChild() {
  if (!poll()) {
    signal(SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  for (const int fd : {pid_fd_, go_fd_, sockets_.giver, sockets_.taker})
    if (fd >= 0) close(fd);
}

void FlightChild::go() noexcept {
  if (go_fd_ < 0) return;
  static_cast<void>(!write(go_fd_, "g", 1));
  close(go_fd_);
  go_fd_ = -1;
}

void FlightChild::give_line(int line) noexcept { drivers::give_descriptor(sockets_.giver, line); }

void FlightChild::signal(int number) const noexcept {
  if (!end_) kill(pid_, number);  // not reaped yet, so the number is still its own
}

void FlightChild::kill_at_once() const noexcept {
  if (!end_) setpriority(PRIO_PROCESS, static_cast<id_t>(pid_), kHurriedNice);
  signal(SIGKILL);
}

const std::optional<ProcessEnd>& FlightChild::poll() noexcept {
  int status = 0;
  if (end_ || waitpid(pid_, &status, WNOHANG) != pid_) return end_;
  end_ = WIFEXITED(status) ? ProcessEnd{WEXITSTATUS(status), 0} : ProcessEnd{0, WTERMSIG(status)};
  return end_;
}

}  // namespace wasp::scheduling
