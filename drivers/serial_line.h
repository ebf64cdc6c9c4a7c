// Opening a serial device: raw, exclusive, low latency.
#pragma once

#include "drivers/endpoint.h"

namespace wasp::drivers {

/// Termios knows this rate.
bool has_baud_rate(unsigned baud) noexcept;

/// A descriptor of the device, set up 8N1, non-blocking, close-on-exec, taken for exclusive use; -1 with errno set.
int open_serial_line(const Endpoint& endpoint) noexcept;

}  // namespace wasp::drivers
