// Opening a socket endpoint, and the peer of one that listens.
#pragma once

#include <netinet/in.h>

#include "drivers/endpoint.h"
#include "rt/contract.h"

namespace wasp::drivers {

/// A descriptor, non-blocking, close-on-exec: bound (kUdpListen), with its destination set (kUdpSend) or connected
/// (kTcp, waits at most a second); -1 with errno set.
int open_socket_line(const Endpoint& endpoint) noexcept;

/// From now on `fd`, a datagram socket, speaks to `peer` and hears nobody else; an address of family AF_UNSPEC lifts
/// that. Realtime-safe: yes (one connect, which for datagrams sends nothing).
void set_peer(int fd, const sockaddr_in& peer) WASP_REALTIME;

}  // namespace wasp::drivers
