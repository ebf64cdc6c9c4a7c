#include "shm/bus_guard.h"

#include <signal.h>
#include <sys/mman.h>

#include <array>
#include <atomic>
#include <mutex>

namespace wasp::shm {
namespace {

constexpr std::uintptr_t kPage = 4096;

/// Read by the handler, which may interrupt anything: single words, `end` stored last and cleared first.
struct Mapping {
  std::atomic<std::uintptr_t> begin{0}, end{0};
  std::atomic<bool> writable{false};
  std::string name;  ///< under the mutex

  [[nodiscard]] bool holds(std::uintptr_t address) const noexcept {
    return address < end.load(std::memory_order_acquire) && address >= begin.load(std::memory_order_relaxed);
  }
};

std::array<Mapping, 64> mappings;
std::mutex mappings_mutex;
std::atomic<std::uint64_t> lost_pages_count{0};
std::array<std::atomic<std::uintptr_t>, 256> lost_addresses{};

bool writable(std::uintptr_t address) noexcept {
  for (const Mapping& m : mappings)
    if (m.holds(address)) return m.writable.load(std::memory_order_relaxed);
  return false;
}

void on_bus_error(int signal_number, siginfo_t* info, void* /*context*/) {
  const std::uintptr_t address = reinterpret_cast<std::uintptr_t>(info->si_addr) & ~(kPage - 1);
  const int rights = writable(address) ? PROT_READ | PROT_WRITE : PROT_READ;
  // mmap is a bare system call here; MAP_FIXED replaces the one lost page and nothing else.
  const bool ours = info->si_code == BUS_ADRERR && mmap(reinterpret_cast<void*>(address), kPage, rights,
                                                        MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED, -1, 0) != MAP_FAILED;
  if (!ours) {
    signal(signal_number, SIG_DFL);  // the access repeats and ends the program as it would have
    return;
  }
  const std::uint64_t n = lost_pages_count.load();
  lost_addresses[n % lost_addresses.size()].store(address);
  lost_pages_count.fetch_add(1);
}

}  // namespace

void install_bus_guard() {
  struct sigaction action {};
  action.sa_sigaction = on_bus_error;
  action.sa_flags = SA_SIGINFO;
  sigaction(SIGBUS, &action, nullptr);
}

std::uint64_t lost_pages() noexcept { return lost_pages_count.load(); }

bool lost_page_within(const void* begin, std::uint64_t bytes, std::uint64_t since) noexcept {
  const std::uint64_t n = lost_pages();
  if (n - since > lost_addresses.size()) return true;
  const auto first = reinterpret_cast<std::uintptr_t>(begin);
  for (std::uint64_t i = since; i < n; ++i) {
    const std::uintptr_t address = lost_addresses[i % lost_addresses.size()].load();
    if (address >= first && address - first < bytes) return true;
  }
  return false;
}

std::string lost_names(std::uint64_t since) {
  const std::lock_guard lock(mappings_mutex);
  std::string names;
  for (const Mapping& m : mappings) {
    const std::uintptr_t begin = m.begin, end = m.end;
    if (end == 0 || !lost_page_within(reinterpret_cast<const void*>(begin), end - begin, since)) continue;
    names += (names.empty() ? "" : ", ") + m.name;
  }
  return names.empty() ? "memory of another kind" : names;
}

void guard_mapping(std::string_view name, const void* begin, std::uint64_t bytes, bool writable) {
  const std::lock_guard lock(mappings_mutex);
  for (Mapping& m : mappings) {
    if (m.end.load() != 0) continue;
    m.name = name;
    m.writable.store(writable);
    m.begin.store(reinterpret_cast<std::uintptr_t>(begin));
    m.end.store(reinterpret_cast<std::uintptr_t>(begin) + bytes, std::memory_order_release);
    return;
  }
}

void forget_mapping(const void* begin) {
  const std::lock_guard lock(mappings_mutex);
  for (Mapping& m : mappings)
    if (m.end.load() != 0 && m.begin.load() == reinterpret_cast<std::uintptr_t>(begin)) return m.end.store(0);
}

}  // namespace wasp::shm
