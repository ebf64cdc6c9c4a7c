#include <stdexcept>

#include "faults/gateway_daemon.h"

namespace wasp::faults {

GatewayDaemon::GatewayDaemon() { throw std::runtime_error("built without the gateway"); }

pid_t GatewayDaemon::pid() const { return -1; }

}  // namespace wasp::faults
