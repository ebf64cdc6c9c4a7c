#include "drivers/socket_line.h"

#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>

namespace wasp::drivers {
namespace {

constexpr int kConnectPatience_ms = 1000;

sockaddr_in address_of(const Endpoint& endpoint) noexcept {
  sockaddr_in a{};
  a.sin_family = AF_INET;
  a.sin_addr.s_addr = htonl(endpoint.host);
  a.sin_port = htons(endpoint.port);
  return a;
}

/// Waits for a connection under way; false with errno set.
bool connected(int fd) noexcept {
  pollfd state{fd, POLLOUT, 0};
  if (poll(&state, 1, kConnectPatience_ms) <= 0) {
    errno = ETIMEDOUT;
    return false;
  }
  int error = 0;
  socklen_t size = sizeof error;
  getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &size);
  errno = error;
  return error == 0;
}

bool set_up(int fd, const Endpoint& endpoint) noexcept {
  const sockaddr_in a = address_of(endpoint);
  const auto* address = reinterpret_cast<const sockaddr*>(&a);
  if (endpoint.kind == EndpointKind::kUdpListen) return bind(fd, address, sizeof a) == 0;
  if (endpoint.kind == EndpointKind::kTcp) {
    const int at_once = 1;
    setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &at_once, sizeof at_once);
  }
  return connect(fd, address, sizeof a) == 0 || (errno == EINPROGRESS && connected(fd));
}

}  // namespace

int open_socket_line(const Endpoint& endpoint) noexcept {
  const int type = endpoint.datagrams() ? SOCK_DGRAM : SOCK_STREAM;
  const int fd = ::socket(AF_INET, type | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd < 0 || set_up(fd, endpoint)) return fd;
  const int error = errno;
  ::close(fd);
  errno = error;
  return -1;
}

void set_peer(int fd, const sockaddr_in& peer) WASP_REALTIME {
  connect(fd, reinterpret_cast<const sockaddr*>(&peer), sizeof peer);
}

}  // namespace wasp::drivers
