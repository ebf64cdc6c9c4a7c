// Malloc guard: counts (or aborts on) every call of the C allocator made while this thread is inside a RealtimeSection.
// `operator new` and `delete` of libstdc++ end in malloc and free, so they are seen too. Linked into a test it replaces
// malloc itself; under the sanitizers, which own malloc, it listens to their allocation hooks instead. The same source
// built as libwasp_malloc_guard.so is preloaded into a whole program (see malloc_guard.cpp).
#pragma once

#include <cstdint>

namespace wasp::test {

/// Allocator calls made inside real-time sections, by all threads, since the start of the process.
std::uint64_t malloc_violations() noexcept;

/// True: the first violation prints a backtrace to stderr and aborts. Default false.
void abort_on_malloc_violation(bool abort) noexcept;

/// Frees inside real-time sections are seen only where malloc itself is replaced and, under a sanitizer, by its hooks.
class MallocCount {
 public:
  MallocCount() noexcept : start_(malloc_violations()) {}
  [[nodiscard]] std::uint64_t violations() const noexcept { return malloc_violations() - start_; }

 private:
  std::uint64_t start_;
};

}  // namespace wasp::test
