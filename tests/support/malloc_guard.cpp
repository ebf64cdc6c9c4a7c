// Replaces malloc, calloc, realloc, free, aligned_alloc, posix_memalign, memalign: each looks at the real-time depth of
// its thread, counts a violation if that is above 0, keeps the backtrace of the first, and hands on to glibc's own
// entry points (__libc_*), so that no dlsym is needed before the loader is ready.
//
// As a preloaded library it asks the program through the exported C function `int wasp_realtime_depth()` (a weak
// symbol: without it nothing is ever counted and the report says so), and writes count and first backtrace at exit to
// the file named by WASP_MALLOC_GUARD_OUT.
#include "tests/support/malloc_guard.h"

#include <execinfo.h>
#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <iterator>

#ifdef WASP_MALLOC_GUARD_PRELOAD
extern "C" [[gnu::weak]] int wasp_realtime_depth();
#else
#include "rt/contract.h"
extern "C" int wasp_realtime_depth() { return wasp::rt::realtime_depth; }
#endif

#ifdef __has_feature
#if __has_feature(realtime_sanitizer)  // watches the allocator itself, and ends the program: nothing is left to count
#define WASP_MALLOC_GUARD_OFF 1
#endif
#endif

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define WASP_SANITIZER_HOOKS 1
extern "C" int __sanitizer_install_malloc_and_free_hooks(void (*)(const volatile void*, std::size_t),
                                                         void (*)(const volatile void*));
#endif

namespace wasp::test {
namespace {

std::atomic<std::uint64_t> violations{0};
std::atomic<bool> abort_wanted{false};
void* first_backtrace[48];
std::atomic<int> first_depth{0};
[[gnu::tls_model("initial-exec")]] thread_local bool inside = false;

bool realtime() noexcept {
#ifdef WASP_MALLOC_GUARD_PRELOAD
  if (wasp_realtime_depth == nullptr) return false;
#endif
  return wasp_realtime_depth() > 0;
}

void note_violation() noexcept {
  inside = true;
  if (violations.fetch_add(1) == 0) {
    const int depth = backtrace(first_backtrace, static_cast<int>(std::size(first_backtrace)));
    first_depth.store(depth, std::memory_order_release);
    if (abort_wanted.load()) {
      backtrace_symbols_fd(first_backtrace, depth, STDERR_FILENO);
      std::abort();
    }
  }
  inside = false;
}

void check() noexcept {
  if (!inside && realtime()) note_violation();
}

/// The first backtrace() loads libgcc and allocates: have that behind us.
[[gnu::constructor]] void prepare() {
  void* unused[2];
  backtrace(unused, 2);
#ifdef WASP_SANITIZER_HOOKS
  __sanitizer_install_malloc_and_free_hooks([](const volatile void*, std::size_t) { check(); },
                                            [](const volatile void*) { check(); });
#endif
}

#ifdef WASP_MALLOC_GUARD_PRELOAD
[[gnu::destructor]] void report() {
  const char* path = std::getenv("WASP_MALLOC_GUARD_OUT");
  if (path == nullptr || wasp_realtime_depth == nullptr) return;  // no real-time code in this program
  const int fd = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (fd < 0) return;
  dprintf(fd, "violations %llu\n", static_cast<unsigned long long>(violations.load()));
  if (const int depth = first_depth.load(std::memory_order_acquire); depth > 0)
    backtrace_symbols_fd(first_backtrace, depth, fd);
  close(fd);
}
#endif

}  // namespace

std::uint64_t malloc_violations() noexcept { return violations.load(); }
void abort_on_malloc_violation(bool abort) noexcept { abort_wanted.store(abort); }

}  // namespace wasp::test

#if !defined(WASP_SANITIZER_HOOKS) && !defined(WASP_MALLOC_GUARD_OFF)
extern "C" {

void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);

void* malloc(std::size_t bytes) {
  wasp::test::check();
  return __libc_malloc(bytes);
}
void* calloc(std::size_t count, std::size_t bytes) {
  wasp::test::check();
  return __libc_calloc(count, bytes);
}
void* realloc(void* old, std::size_t bytes) {
  wasp::test::check();
  return __libc_realloc(old, bytes);
}
void free(void* memory) {
  if (memory != nullptr) wasp::test::check();
  __libc_free(memory);
}
void* memalign(std::size_t alignment, std::size_t bytes) {
  wasp::test::check();
  return __libc_memalign(alignment, bytes);
}
void* aligned_alloc(std::size_t alignment, std::size_t bytes) {
  wasp::test::check();
  return __libc_memalign(alignment, bytes);
}
int posix_memalign(void** memory, std::size_t alignment, std::size_t bytes) {
  wasp::test::check();
  if (alignment % sizeof(void*) != 0 || (alignment & (alignment - 1)) != 0 || alignment == 0) return EINVAL;
  void* p = __libc_memalign(alignment, bytes);
  if (p == nullptr) return ENOMEM;
  *memory = p;
  return 0;
}

}  // extern "C"
#endif
