#include "tools/record_bus_guard.h"

#include <signal.h>
#include <sys/mman.h>

#include <array>
#include <atomic>

namespace wasp::tools {
namespace {

std::atomic<std::uint64_t> lost_pages_count{0};
std::array<std::atomic<std::uintptr_t>, 256> lost_addresses{};
constexpr std::uintptr_t kPage = 4096;

void on_bus_error(int signal_number, siginfo_t* info, void* /*context*/) {
  auto* page = reinterpret_cast<void*>(reinterpret_cast<std::uintptr_t>(info->si_addr) & ~(kPage - 1));
  // mmap is a bare system call here; MAP_FIXED replaces the one lost page and nothing else.
  const bool ours = info->si_code == BUS_ADRERR &&
                    mmap(page, kPage, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED, -1, 0) != MAP_FAILED;
  if (!ours) {
    signal(signal_number, SIG_DFL);  // the access repeats and ends the program as it would have
    return;
  }
  const std::uint64_t n = lost_pages_count.fetch_add(1);
  lost_addresses[n % lost_addresses.size()].store(reinterpret_cast<std::uintptr_t>(page));
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

}  // namespace wasp::tools
