// iceoryx's daemon beside a flight whose gateway is tried; in a build without the gateway there is none
// (gateway_absent.cpp).
#pragma once

#include <sys/types.h>

#include <memory>

namespace wasp::tools {
class RoudiProcess;
}

namespace wasp::faults {

class GatewayDaemon {
 public:
  /// Starts it. Throws std::runtime_error with its trouble.
  GatewayDaemon();
  [[nodiscard]] pid_t pid() const;

 private:
  std::shared_ptr<tools::RoudiProcess> daemon_;
};

}  // namespace wasp::faults
