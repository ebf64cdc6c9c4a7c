#include "sim/pty.h"

#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "rt/clock.h"

namespace wasp::sim {
namespace {

[[noreturn]] void fail(const std::string& path, const std::string& what) {
  throw std::runtime_error("pseudo-terminal '" + path + "': " + what + ": " + std::strerror(errno));
}

void make_raw(int fd, const std::string& path) {
  termios settings{};
  if (tcgetattr(fd, &settings) != 0) fail(path, "tcgetattr");
  cfmakeraw(&settings);
  if (tcsetattr(fd, TCSANOW, &settings) != 0) fail(path, "tcsetattr");
}

void link_to(const std::string& slave, const std::string& link) {
  struct stat st {};
  if (lstat(link.c_str(), &st) == 0 && S_ISLNK(st.st_mode)) unlink(link.c_str());
  if (symlink(slave.c_str(), link.c_str()) != 0) fail(link, "cannot link to " + slave);
}

}  // namespace

Pty::Pty(std::string link_path) : link_path_(std::move(link_path)), input_(4096) {
  backlog_.reserve(4096);
  master_ = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (master_ < 0 || grantpt(master_) != 0 || unlockpt(master_) != 0) fail(link_path_, "cannot open a master");
  char name[128] = {};
  if (ptsname_r(master_, name, sizeof name) != 0) fail(link_path_, "no slave name");
  slave_path_ = name;
  slave_ = open(name, O_RDWR | O_NOCTTY | O_CLOEXEC);
  if (slave_ < 0) fail(link_path_, "cannot open " + slave_path_);
  make_raw(slave_, link_path_);
  link_to(slave_path_, link_path_);
}

Pty::~Pty() {
  unlink(link_path_.c_str());
  close(slave_);
  close(master_);
}

bool Pty::wait(TimeNs until_ns) {
  const DurationNs left = std::max<DurationNs>(0, until_ns - rt::now());
  const timespec timeout = rt::to_timespec(left);
  pollfd fd{master_, POLLIN, 0};
  return ppoll(&fd, 1, &timeout, nullptr) > 0 && (fd.revents & POLLIN) != 0;
}

std::span<const std::uint8_t> Pty::read() {
  const ssize_t n = ::read(master_, input_.data(), input_.size());
  return {input_.data(), n > 0 ? static_cast<std::size_t>(n) : 0};
}

void Pty::flush_backlog() {
  if (backlog_.empty()) return;
  const ssize_t n = ::write(master_, backlog_.data(), backlog_.size());
  if (n > 0) backlog_.erase(backlog_.begin(), backlog_.begin() + n);
}

void Pty::write(std::span<const std::uint8_t> bytes) {
  flush_backlog();
  if (bytes.empty()) return;
  if (!backlog_.empty()) {
    dropped_bytes_ += bytes.size();
    return;
  }
  const ssize_t n = ::write(master_, bytes.data(), bytes.size());
  const std::size_t sent = n > 0 ? static_cast<std::size_t>(n) : 0;
  backlog_.assign(bytes.begin() + static_cast<std::ptrdiff_t>(sent), bytes.end());
}

}  // namespace wasp::sim
