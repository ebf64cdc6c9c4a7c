#include "faults/gateway_daemon.h"

#include <stdexcept>

#include "tools/roudi_process.h"

namespace wasp::faults {

GatewayDaemon::GatewayDaemon() : daemon_(std::make_shared<tools::RoudiProcess>()) {
  if (!daemon_->trouble().empty()) throw std::runtime_error("iox-roudi: " + daemon_->trouble());
}

pid_t GatewayDaemon::pid() const { return daemon_->pid(); }

}  // namespace wasp::faults
