// The worker's way into iceoryx: waits for the daemon, registers, and turns iceoryx's errors into words and exit codes.
#pragma once

#include <string>

#include "iceoryx_posh/capro/service_description.hpp"
#include "tools/iceoryx_supervisor.h"

namespace wasp::iceoryx {

/// Registers this process. kDone, or the exit code to end with (said on standard error): kNoDaemon when no daemon came
/// within `patience_s`. A daemon that does not answer holds this call; the parent sees to that.
int connect(Shared& shared, double patience_s);

/// True while the daemon that `connect` found is the one that runs, or none does: what is connected stays so without
/// it.
bool same_daemon();

/// "S/I/E" in three parts. Throws std::runtime_error naming the text if it is not.
struct ServiceName {
  std::string service, instance, event;
  [[nodiscard]] std::string text() const { return service + "/" + instance + "/" + event; }
};
ServiceName parse_service(const std::string& text);
iox::capro::ServiceDescription describe(const ServiceName& name);

}  // namespace wasp::iceoryx
