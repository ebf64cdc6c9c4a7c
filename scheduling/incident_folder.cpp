#include "scheduling/incident_folder.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>

namespace wasp::scheduling {

std::string IncidentFolder::write(const Incident& incident) {
  const auto path = std::filesystem::path(folder_) /
                    fmt::format("incident-{}-{}-{:02}.txt", incident.wall_time, incident.instance, incident.number);
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  errno = 0;
  std::ofstream file(path);
  file << incident_text(incident) << "\n" << incident_json(incident) << "\n" << std::flush;
  if (!file) {
    failed_ = true;
    return fmt::format("no incident file can be written ({}: {}); misses are only counted from here", path.string(),
                       error ? error.message() : std::strerror(errno));
  }
  ++written_;
  return path.string();
}

std::string wall_time() {
  char stamp[32];
  const std::time_t now = std::time(nullptr);
  std::strftime(stamp, sizeof stamp, "%Y%m%d-%H%M%S", std::localtime(&now));
  return stamp;
}

}  // namespace wasp::scheduling
