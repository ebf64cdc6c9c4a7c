// A daemon for one test, the gateway and other programs as children, and words between the test and them.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/child.h"
#include "tools/roudi_process.h"

namespace wasp::test {

/// Memory shared with children forked later. `T` starts as constructed.
template <class T>
class SharedMemory {
 public:
  SharedMemory() : value_(std::construct_at(static_cast<T*>(map()))) {}
  ~SharedMemory() { munmap(value_, sizeof(T)); }
  SharedMemory(const SharedMemory&) = delete;
  SharedMemory& operator=(const SharedMemory&) = delete;
  T* operator->() const { return value_; }
  T& operator*() const { return *value_; }

 private:
  static void* map() {
    void* memory = mmap(nullptr, sizeof(T), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) std::abort();
    return memory;
  }
  T* value_;
};

/// A child that is killed and reaped at the end of a scope.
class Reaped {
 public:
  explicit Reaped(pid_t pid) : pid_(pid) {}
  ~Reaped() {
    if (pid_ > 0) kill_and_wait(pid_);
  }
  Reaped(const Reaped&) = delete;
  Reaped& operator=(const Reaped&) = delete;
  [[nodiscard]] pid_t pid() const { return pid_; }
  void signal(int number) const { kill(pid_, number); }
  [[nodiscard]] bool running() {
    int status = 0;
    if (pid_ > 0 && waitpid(pid_, &status, WNOHANG) == pid_) pid_ = -1;
    return pid_ > 0;
  }
  /// Waits for its end; the raw status.
  int wait() { return wait_for(std::exchange(pid_, -1)); }
  /// SIGTERM, then its exit code; 128 + signal if it did not leave by itself.
  int stop() {
    signal(SIGTERM);
    const int status = wait();
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

 private:
  pid_t pid_;
};

inline std::string built(const std::string& program) { return std::string(WASP_BINARY_DIR) + "/" + program; }

inline std::string read_text(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// A folder of its own under the system's temporary one, removed at the end.
struct Folder {
  Folder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "wasp_test_XXXXXX").string();
    path = mkdtemp(pattern.data());
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  std::filesystem::path path;
};

/// Starts a program; what it prints goes to `log`.
inline pid_t start_program(const std::vector<std::string>& arguments, const std::filesystem::path& log) {
  return start_child([&] {
    std::vector<char*> argv;
    for (const auto& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
    argv.push_back(nullptr);
    const int fd = open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
    dup2(fd, STDOUT_FILENO);
    dup2(fd, STDERR_FILENO);
    execv(argv[0], argv.data());
    return 127;
  });
}

/// Runs a program to its end: all it printed, and its exit code.
inline std::pair<std::string, int> run_program(const std::vector<std::string>& arguments) {
  const Folder folder;
  const int status = wait_for(start_program(arguments, folder.path / "log"));
  return {read_text(folder.path / "log"), WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status)};
}

/// Skips, with the reason, where somebody else's daemon runs; fails where ours does not start.
class WithRoudi : public ::testing::Test {
 protected:
  void start_roudi(bool monitoring = true) {
    tools::RoudiProcess::Options options;
    options.monitoring = monitoring;
    roudi = std::make_unique<tools::RoudiProcess>(options);
    if (roudi->trouble().find("not ours") != std::string::npos) GTEST_SKIP() << roudi->trouble();
    ASSERT_EQ(roudi->trouble(), "");
  }
  std::unique_ptr<tools::RoudiProcess> roudi;
  Folder folder;
};

// First line of a test that needs the daemon.
#define WASP_START_ROUDI()                \
  ASSERT_NO_FATAL_FAILURE(start_roudi()); \
  if (IsSkipped()) return

}  // namespace wasp::test
