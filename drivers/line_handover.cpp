#include "drivers/line_handover.h"

#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <system_error>

namespace wasp::drivers {
namespace {

/// A message of one byte with room for one descriptor.
struct Packet {
  char byte = 'L';
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> control{};
  iovec data{&byte, 1};

  msghdr header() noexcept {
    msghdr h{};
    h.msg_iov = &data;
    h.msg_iovlen = 1;
    h.msg_control = control.data();
    h.msg_controllen = control.size();
    return h;
  }
};

/// One descriptor, -1 if none waits.
int take_one(int socket) noexcept {
  Packet packet;
  msghdr h = packet.header();
  if (recvmsg(socket, &h, MSG_DONTWAIT | MSG_CMSG_CLOEXEC) <= 0) return -1;
  const cmsghdr* c = CMSG_FIRSTHDR(&h);
  if (c == nullptr || c->cmsg_level != SOL_SOCKET || c->cmsg_type != SCM_RIGHTS) return -1;
  int fd = -1;
  std::memcpy(&fd, CMSG_DATA(c), sizeof fd);
  return fd;
}

}  // namespace

HandoverSockets make_handover() {
  std::array<int, 2> ends{};
  if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, ends.data()) != 0)
    throw std::system_error(errno, std::generic_category(), "socketpair for the serial line");
  return {ends[0], ends[1]};
}

bool give_descriptor(int socket, int fd) noexcept {
  Packet packet;
  msghdr h = packet.header();
  cmsghdr* c = CMSG_FIRSTHDR(&h);
  c->cmsg_level = SOL_SOCKET;
  c->cmsg_type = SCM_RIGHTS;
  c->cmsg_len = CMSG_LEN(sizeof(int));
  std::memcpy(CMSG_DATA(c), &fd, sizeof fd);
  return sendmsg(socket, &h, MSG_DONTWAIT | MSG_NOSIGNAL) == 1;
}

int take_descriptor(int socket) noexcept {
  int newest = -1;
  for (int fd = take_one(socket); fd >= 0; fd = take_one(socket)) {
    if (newest >= 0) ::close(newest);
    newest = fd;
  }
  return newest;
}

}  // namespace wasp::drivers
