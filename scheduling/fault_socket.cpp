#include "scheduling/fault_socket.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "rt/clock.h"
#include "scheduling/fault_request.h"

namespace wasp::scheduling {
namespace {

constexpr DurationNs kDeafFor = 100 * kMillisecond;

[[noreturn]] void fail(const std::string& path, const std::string& why) {
  throw std::runtime_error("fault socket '" + path + "': " + why);
}

sockaddr_un address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, FaultSocket::kLongestPath);
  return address;
}

int new_socket(const std::string& path) {
  const int fd = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) fail(path, std::strerror(errno));
  return fd;
}

/// What an earlier flight left behind when it was killed; everything else is not ours to remove.
void remove_dead_socket(const std::string& path) {
  struct stat found {};
  if (lstat(path.c_str(), &found) != 0) return;
  if (!S_ISSOCK(found.st_mode)) fail(path, "exists and is not a socket");
  const sockaddr_un address = address_of(path);
  const int probe = new_socket(path);
  const int answer = connect(probe, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 ? 0 : errno;
  close(probe);
  if (answer != ECONNREFUSED) fail(path, "another process listens there");
  if (unlink(path.c_str()) != 0)
    fail(path, std::string("a dead socket there cannot be removed: ") + std::strerror(errno));
}

}  // namespace

FaultSocket::FaultSocket(std::string path) : path_(std::move(path)) {
  if (path_.empty() || path_.size() > kLongestPath)
    fail(path_, "its path has " + std::to_string(path_.size()) + " bytes; the kernel takes 1 ... " +
                    std::to_string(kLongestPath));
  remove_dead_socket(path_);
  listener_ = new_socket(path_);
  const sockaddr_un address = address_of(path_);
  struct stat made {};
  // The mode is the socket's before it has a name: at no moment can anybody else connect.
  if (fchmod(listener_, S_IRUSR | S_IWUSR) != 0 ||
      bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      lstat(path_.c_str(), &made) != 0 || listen(listener_, static_cast<int>(kMostClients)) != 0) {
    const int error = errno;
    close(listener_);
    fail(path_, std::strerror(error));
  }
  device_ = made.st_dev;
  inode_ = made.st_ino;
}

FaultSocket::~FaultSocket() {
  for (const int fd : clients_) close(fd);
  close(listener_);
  struct stat now {};
  if (lstat(path_.c_str(), &now) == 0 && now.st_dev == device_ && now.st_ino == inode_) unlink(path_.c_str());
}

void FaultSocket::accept_client() {
  const int fd = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (fd < 0) {
    if (errno != EAGAIN && errno != ECONNABORTED && errno != EINTR) deaf_until_ns_ = rt::now() + kDeafFor;
    return;
  }
  if (clients_.size() < kMostClients) {
    clients_.push_back(fd);
    return;
  }
  constexpr std::string_view kFull = "error too many clients";
  send(fd, kFull.data(), kFull.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
  close(fd);
}

bool FaultSocket::serve_client(int fd, const Answer& answer) {
  std::array<char, kLongestRequest + 1> buffer;  // one more: a request that fills it is too long
  const ssize_t got = recv(fd, buffer.data(), buffer.size(), MSG_DONTWAIT);
  if (got < 0) return errno == EAGAIN || errno == EINTR;
  if (got == 0) return false;
  const std::string reply = answer(std::string_view(buffer.data(), static_cast<std::size_t>(got)));
  return send(fd, reply.data(), reply.size(), MSG_DONTWAIT | MSG_NOSIGNAL) == static_cast<ssize_t>(reply.size());
}

void FaultSocket::serve(TimeNs deadline_ns, const Answer& answer) {
  std::array<pollfd, kMostClients + 1> fds{};
  for (std::size_t i = 0; i < clients_.size(); ++i) fds[i] = {clients_[i], POLLIN, 0};
  const TimeNs now_ns = rt::now();
  fds[clients_.size()] = {now_ns < deaf_until_ns_ ? -1 : listener_, POLLIN, 0};
  const timespec patience = rt::to_timespec(std::max<DurationNs>(deadline_ns - now_ns, 0));
  const std::size_t count = clients_.size();
  if (ppoll(fds.data(), count + 1, &patience, nullptr) <= 0) return;
  for (std::size_t i = 0; i < count; ++i)
    if (fds[i].revents != 0 && !serve_client(fds[i].fd, answer)) {
      close(fds[i].fd);
      std::erase(clients_, fds[i].fd);
    }
  if (fds[count].revents != 0) accept_client();
}

}  // namespace wasp::scheduling
