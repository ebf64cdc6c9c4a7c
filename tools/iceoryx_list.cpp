#include "tools/iceoryx_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "iceoryx_posh/runtime/service_discovery.hpp"
#include "rt/clock.h"
#include "tools/iceoryx_daemon.h"
#include "tools/iceoryx_message.h"
#include "tools/iceoryx_runtime.h"
#include "tools/iceoryx_topics.h"
#include "tools/record_attachment.h"

namespace wasp::iceoryx {
namespace {

std::vector<TopicRow> all_topics() {
  std::vector<TopicRow> rows;
  for (const auto& instance : tools::list_instances())
    for (const auto& row : topics_of(instance))
      if (row.ring) rows.push_back(row);
  return rows;
}

/// Services other processes offer now; the daemon's own (introspection and the like) are left out.
std::vector<std::string> offered_services() {
  std::vector<std::string> names;
  iox::runtime::ServiceDiscovery discovery;
  discovery.findService(
      iox::cxx::nullopt, iox::cxx::nullopt, iox::cxx::nullopt,
      [&](const iox::capro::ServiceDescription& s) {
        const ServiceName name{s.getServiceIDString().c_str(), s.getInstanceIDString().c_str(),
                               s.getEventIDString().c_str()};
        if (name.instance != iox::SERVICE_DISCOVERY_INSTANCE_NAME) names.push_back(name.text());
      },
      iox::popo::MessagingPattern::PUB_SUB);
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return names;
}

std::string service_of(const TopicRow& row) { return ServiceName{kService, row.instance, row.topic}.text(); }

nlohmann::json as_json(const std::vector<TopicRow>& rows, pid_t daemon, const std::vector<std::string>& services) {
  nlohmann::json document{{"daemon_pid", daemon}, {"services", services}, {"topics", nlohmann::json::array()}};
  for (const auto& row : rows)
    document["topics"].push_back({{"instance", row.instance},
                                  {"topic", row.topic},
                                  {"type", row.type},
                                  {"bytes", row.bytes},
                                  {"service", service_of(row)}});
  return document;
}

void print(const std::vector<TopicRow>& rows, pid_t daemon, const std::vector<std::string>& services) {
  fmt::print("{:<16} {:<24} {:<10} {:>9}  {}\n", "INSTANCE", "TOPIC", "TYPE", "BYTES", "SERVICE WHEN EXPORTED");
  for (const auto& row : rows)
    fmt::print("{:<16} {:<24} {:<10} {:>9}  {}\n", row.instance, row.topic, row.type, row.bytes, service_of(row));
  if (rows.empty()) fmt::print("no instance of wasp is running\n");
  if (daemon == 0) {
    fmt::print("\niceoryx: no daemon runs; start `iox-roudi`\n");
    return;
  }
  fmt::print("\niceoryx: daemon iox-roudi, process {}; services offered now:\n", daemon);
  for (const auto& service : services) fmt::print("  {}\n", service);
  if (services.empty()) fmt::print("  none\n");
}

}  // namespace

int run_list(bool json) {
  const auto show = [json](pid_t daemon, const std::vector<std::string>& services) {
    const auto rows = all_topics();
    json ? fmt::print("{}\n", as_json(rows, daemon, services).dump()) : print(rows, daemon, services);
    std::fflush(stdout);
  };
  if (daemon_pid() == 0) {
    show(0, {});
    return kDone;
  }
  return supervise(map_shared(), [&](Shared& shared) -> int {
    if (const int code = connect(shared, 5); code != kDone) return code;
    show(daemon_pid(), offered_services());
    return kDone;
  });
}

}  // namespace wasp::iceoryx
