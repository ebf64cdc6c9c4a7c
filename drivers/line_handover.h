// A descriptor of the serial line handed from the guardian, which opens it, to the flying process, which uses it: over
// a socket pair, so that a line that was lost and opened again reaches a process that runs already.
#pragma once

namespace wasp::drivers {

/// The ends of a new socket pair, close-on-exec, non-blocking. Throws std::system_error.
struct HandoverSockets {
  int giver = -1, taker = -1;
};
HandoverSockets make_handover();

/// Hands `fd` over; false if the socket refuses. Never waits.
bool give_descriptor(int socket, int fd) noexcept;

/// The newest descriptor given and not yet taken, close-on-exec and the caller's own; -1 if there is none. Older ones
/// are closed. Never waits.
int take_descriptor(int socket) noexcept;

}  // namespace wasp::drivers
