// Hands a plain value from thread to thread by an atomic flag: "relaxed" leaves the order out that makes it safe, and
// ThreadSanitizer must say so.
#include <atomic>
#include <cstdio>
#include <cstring>
#include <thread>

int main(int argc, char** argv) {
  const bool broken = argc > 1 && std::strcmp(argv[1], "relaxed") == 0;
  int value = 0;
  std::atomic<bool> published{false};
  std::thread writer([&] {
    value = 42;
    published.store(true, broken ? std::memory_order_relaxed : std::memory_order_release);
  });
  while (!published.load(broken ? std::memory_order_relaxed : std::memory_order_acquire)) std::this_thread::yield();
  std::printf("value %d\n", value);
  writer.join();
  return 0;
}
