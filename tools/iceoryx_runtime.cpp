#include "tools/iceoryx_runtime.h"

#include <unistd.h>

#include <cstdio>
#include <stdexcept>

#include "iceoryx_hoofs/error_handling/error_handling.hpp"
#include "iceoryx_hoofs/log/logmanager.hpp"
#include "iceoryx_posh/runtime/posh_runtime.hpp"
#include "tools/iceoryx_daemon.h"

namespace wasp::iceoryx {
namespace {

ino_t connected_to = 0;

const char* advice(iox::Error error) {
  switch (error) {
    case iox::Error::kMEPOO__MEMPOOL_GETCHUNK_CHUNK_IS_TOO_LARGE:
      return "; the daemon has no chunk that large: start iox-roudi with a configuration whose [[segment.mempool]] "
             "size "
             "is at least that of the message plus 256";
    case iox::Error::kPOSH__RUNTIME_NO_WRITABLE_SHM_SEGMENT:
      return "; this user may not write to the daemon's memory";
    case iox::Error::kIPC_INTERFACE__COULD_NOT_ACQUIRE_FILE_LOCK:
      return "; /tmp must be writable";
    default:
      return "";
  }
}

/// iceoryx calls this from any depth and cannot be left by an exception; what it would end the process for, ends it in
/// words. Some errors will come again: those end the program, the others the worker.
void on_error(const iox::Error error, const std::function<void()>&, const iox::ErrorLevel level) {
  if (level == iox::ErrorLevel::MODERATE) return;
  std::fprintf(stderr, "wasp-iceoryx: iceoryx reports %s%s\n", iox::ErrorHandler::toString(error), advice(error));
  _exit(*advice(error) != 0 ? kFailed : kReconnect);
}

}  // namespace

int connect(Shared& shared, double patience_s) {
  shared.phase = Phase::kWaiting;
  const double patience = shared.was_running ? -1 : patience_s;
  const auto beat = [&] {
    shared.beats.fetch_add(1);
    return !stop_requested();
  };
  const pid_t daemon = await_daemon(patience, beat);
  if (daemon == 0) {
    if (stop_requested()) return kDone;
    std::fprintf(stderr, "wasp-iceoryx: no iceoryx daemon came within %.1f s; start `iox-roudi` (package iceoryx)\n",
                 patience_s);
    return kNoDaemon;
  }
  shared.phase = Phase::kConnecting;
  static auto handler = iox::ErrorHandler::setTemporaryErrorHandler(on_error);
  iox::log::LogManager::GetLogManager().SetDefaultLogLevel(iox::log::LogLevel::kError,
                                                           iox::log::LogLevelOutput::kHideLogLevel);
  connected_to = daemon_memory();
  iox::runtime::PoshRuntime::initRuntime({iox::cxx::TruncateToCapacity, "wasp-iceoryx-" + std::to_string(getpid())});
  shared.beats.fetch_add(1);
  shared.phase = Phase::kRunning;
  shared.was_running = true;
  return kDone;
}

bool same_daemon() {
  const ino_t now = daemon_memory();
  return now == 0 || now == connected_to;
}

ServiceName parse_service(const std::string& text) {
  const std::size_t first = text.find('/'), second = text.find('/', first + 1);
  const bool three = first != std::string::npos && second != std::string::npos;
  ServiceName name;
  if (three) name = {text.substr(0, first), text.substr(first + 1, second - first - 1), text.substr(second + 1)};
  if (name.service.empty() || name.instance.empty() || name.event.empty())
    throw std::runtime_error("'" + text + "' is not a service: it needs three parts, SERVICE/INSTANCE/EVENT");
  for (const auto& part : {name.service, name.instance, name.event})
    if (part.size() > iox::capro::IdString_t::capacity())
      throw std::runtime_error("'" + part + "' is too long: iceoryx names have at most " +
                               std::to_string(iox::capro::IdString_t::capacity()) + " characters");
  return name;
}

iox::capro::ServiceDescription describe(const ServiceName& name) {
  const auto id = [](const std::string& s) { return iox::capro::IdString_t{iox::cxx::TruncateToCapacity, s}; };
  return {id(name.service), id(name.instance), id(name.event)};
}

}  // namespace wasp::iceoryx
