// wasp bench micro, memory: what the first touch of a region's pages costs, and what pages of 2 MiB would save. Each
// iteration maps 8 MiB afresh, touches every 4 KiB page once, and unmaps. Rows whose kind of memory this machine does
// not give say so instead of a figure.
#include <benchmark/benchmark.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstring>
#include <fstream>
#include <string>

namespace wasp::bench {
namespace {

constexpr std::size_t kBytes = std::size_t{8} << 20, kPage = 4096;

void touch(std::byte* memory) {
  for (std::size_t i = 0; i < kBytes; i += kPage) memory[i] = std::byte{1};
  benchmark::ClobberMemory();
}

/// `flags` of mmap, `advice` of madvise (0: none); `memfd` as of memfd_create, -1: anonymous memory. Counted outside
/// the clock: making, mapping and unmapping, unless `populate` does the touching in mmap.
struct Kind {
  int memfd = -1, flags = 0, advice = 0;
};

/// The kernel's own word on pages of 2 MiB for this kind of memory, e.g. "always [madvise] never".
std::string huge_page_setting(const Kind& kind) {
  std::string text;
  std::getline(std::ifstream(std::string("/sys/kernel/mm/transparent_hugepage/") +
                             (kind.memfd < 0 ? "enabled" : "shmem_enabled")),
               text);
  return text;
}

int open_memory(const Kind& kind) {
  if (kind.memfd < 0) return -1;
  const int fd = memfd_create("wasp-bench", static_cast<unsigned>(kind.memfd));
  if (fd >= 0 && ftruncate(fd, kBytes) != 0) {
    close(fd);
    return -1;
  }
  return fd;
}

/// nullptr if this machine does not give such memory; errno says why.
std::byte* map(const Kind& kind, int fd) {
  const int flags = kind.flags | (kind.memfd < 0 ? MAP_PRIVATE | MAP_ANONYMOUS : MAP_SHARED);
  void* memory = kind.memfd >= 0 && fd < 0 ? MAP_FAILED : mmap(nullptr, kBytes, PROT_READ | PROT_WRITE, flags, fd, 0);
  if (memory == MAP_FAILED) return nullptr;
  if (kind.advice == 0 || madvise(memory, kBytes, kind.advice) == 0) return static_cast<std::byte*>(memory);
  munmap(memory, kBytes);
  return nullptr;
}

void first_touch(benchmark::State& state, Kind kind) {
  const bool populate = (kind.flags & MAP_POPULATE) != 0;
  if (kind.advice == MADV_HUGEPAGE) state.SetLabel("transparent huge pages: " + huge_page_setting(kind));
  for (auto _ : state) {
    if (!populate) state.PauseTiming();
    const int fd = open_memory(kind);
    std::byte* memory = map(kind, fd);
    const int why = errno;
    if (!populate) state.ResumeTiming();
    if (memory == nullptr) {
      state.SkipWithError((std::string("not available here: ") + std::strerror(why)).c_str());
      if (fd >= 0) close(fd);
      return;
    }
    touch(memory);
    state.PauseTiming();
    munmap(memory, kBytes);
    if (fd >= 0) close(fd);
    state.ResumeTiming();
  }
}

void second_touch(benchmark::State& state) {
  std::byte* memory = map({0, MAP_POPULATE, 0}, open_memory({0, 0, 0}));
  if (memory == nullptr) return state.SkipWithError("no memory");
  for (auto _ : state) touch(memory);
  munmap(memory, kBytes);
}

BENCHMARK_CAPTURE(first_touch, shm_4k, Kind{0, 0, 0});
BENCHMARK_CAPTURE(first_touch, shm_4k_populate, Kind{0, MAP_POPULATE, 0});
BENCHMARK_CAPTURE(first_touch, shm_advised_huge, Kind{0, 0, MADV_HUGEPAGE});
BENCHMARK_CAPTURE(first_touch, shm_hugetlb_2m, Kind{MFD_HUGETLB, 0, 0});
BENCHMARK_CAPTURE(first_touch, anonymous_4k, Kind{-1, 0, MADV_NOHUGEPAGE});
BENCHMARK_CAPTURE(first_touch, anonymous_advised_huge, Kind{-1, 0, MADV_HUGEPAGE});
BENCHMARK_CAPTURE(first_touch, anonymous_hugetlb_2m, Kind{-1, MAP_HUGETLB, 0});
BENCHMARK(second_touch);

}  // namespace
}  // namespace wasp::bench
