#include "scheduling/computer_status.h"

#include <algorithm>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>
#include <system_error>

namespace wasp::scheduling {
namespace {

constexpr std::uint8_t kUnknownShare = 255;
constexpr std::int8_t kUnknownDegrees = 127;
constexpr std::uint32_t kUnknownSize = std::numeric_limits<std::uint32_t>::max();

/// All fields at their "not known" (the message's own `invalid`).
mavlink::OnboardComputerStatus unknown() {
  mavlink::OnboardComputerStatus s;
  s.ram_usage = s.ram_total = kUnknownSize;
  for (auto* list : {&s.storage_type, &s.storage_usage, &s.storage_total}) list->fill(kUnknownSize);
  for (auto* list : {&s.link_tx_rate, &s.link_rx_rate, &s.link_tx_max, &s.link_rx_max})
    list->fill(kUnknownSize);
  s.fan_speed.fill(std::numeric_limits<std::int16_t>::max());
  s.cpu_cores.fill(kUnknownShare);
  s.cpu_combined.fill(kUnknownShare);
  s.gpu_cores.fill(kUnknownShare);
  s.gpu_combined.fill(kUnknownShare);
  s.temperature_board = kUnknownDegrees;
  s.temperature_core.fill(kUnknownDegrees);
  return s;
}

std::uint32_t mebibytes(std::uintmax_t bytes) {
  return static_cast<std::uint32_t>(std::min<std::uintmax_t>(bytes >> 20, kUnknownSize - 1));
}

}  // namespace

ComputerWatch::ComputerWatch(std::filesystem::path root) : root_(std::move(root)) {
  combined_.fill(kUnknownShare);
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(root_ / "sys/class/thermal", error))
    if (entry.path().filename().string().starts_with("thermal_zone")) thermal_zones_.push_back(entry.path() / "temp");
  std::sort(thermal_zones_.begin(), thermal_zones_.end());
}

mavlink::OnboardComputerStatus ComputerWatch::look(TimeNs now_ns) {
  mavlink::OnboardComputerStatus status = unknown();
  status.uptime = static_cast<std::uint32_t>(now_ns / kMillisecond);
  status.type = 0;  // mission computer
  read_cores(status);
  read_memory(status);
  read_temperatures(status);
  read_disk(status);
  return status;
}

/// Share of the time since the last look in which each core was not idle [%]; of all together the last ten, newest first.
void ComputerWatch::read_cores(mavlink::OnboardComputerStatus& status) {
  std::ifstream stat(root_ / "proc/stat");
  std::vector<Ticks> now;
  for (std::string line; std::getline(stat, line) && line.starts_with("cpu");) {
    std::istringstream words(line.substr(line.find(' ')));
    Ticks t;
    std::uint64_t ticks = 0;
    for (int column = 0; column < 8 && words >> ticks; ++column) {
      t.all += ticks;
      if (column != 3 && column != 4) t.busy += ticks;  // not idle, not waiting for a disk
    }
    now.push_back(t);
  }
  before_.resize(now.size());
  for (std::size_t i = 0; i < now.size(); ++i) {
    const std::uint64_t all = now[i].all - before_[i].all, busy = now[i].busy - before_[i].busy;
    if (all == 0 || busy > all) continue;
    const auto share = static_cast<std::uint8_t>((100 * busy + all / 2) / all);
    if (i == 0) {
      std::shift_right(combined_.begin(), combined_.end(), 1);
      combined_[0] = share;
    }
    if (i > 0 && i <= status.cpu_cores.size()) status.cpu_cores[i - 1] = share;
  }
  status.cpu_combined = combined_;
  before_ = std::move(now);
}

void ComputerWatch::read_memory(mavlink::OnboardComputerStatus& status) const {
  std::ifstream memory(root_ / "proc/meminfo");
  std::uint64_t total_KiB = 0, available_KiB = 0;
  for (std::string line; std::getline(memory, line);) {
    std::istringstream words(line);
    std::string name;
    std::uint64_t KiB = 0;
    words >> name >> KiB;
    if (name == "MemTotal:") total_KiB = KiB;
    if (name == "MemAvailable:") available_KiB = KiB;
  }
  if (total_KiB == 0 || available_KiB > total_KiB) return;
  status.ram_total = mebibytes(total_KiB << 10);
  status.ram_usage = mebibytes((total_KiB - available_KiB) << 10);
}

/// The hottest zone stands for the board.
void ComputerWatch::read_temperatures(mavlink::OnboardComputerStatus& status) const {
  int hottest = std::numeric_limits<int>::min();
  std::size_t n = 0;
  for (const auto& zone : thermal_zones_) {
    std::ifstream file(zone);
    long milli_degrees = 0;
    if (!(file >> milli_degrees)) continue;
    const int degrees = static_cast<int>(std::clamp(milli_degrees / 1000, -127l, 126l));
    hottest = std::max(hottest, degrees);
    if (n < status.temperature_core.size()) status.temperature_core[n++] = static_cast<std::int8_t>(degrees);
  }
  if (n > 0) status.temperature_board = static_cast<std::int8_t>(hottest);
}

void ComputerWatch::read_disk(mavlink::OnboardComputerStatus& status) const {
  std::error_code error;
  const auto space = std::filesystem::space(std::filesystem::current_path(error), error);
  if (error || space.capacity == 0) return;
  status.storage_type[0] = 0;  // not told which kind
  status.storage_total[0] = mebibytes(space.capacity);
  status.storage_usage[0] = mebibytes(space.capacity - space.available);
  if (space.available < space.capacity / 50) status.status_flags = mavlink::computer_status_flags::kDiskFull;
}

}  // namespace wasp::scheduling
