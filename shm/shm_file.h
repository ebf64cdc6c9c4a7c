// Files under /dev/shm: paths, descriptors, the writer's lock, reserved pages. Used by region.cpp only.
#pragma once

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdint>
#include <string>
#include <utility>

namespace wasp::shm {

inline constexpr const char* kDirectory = "/dev/shm/";

/// Throw std::runtime_error naming the region; fail_errno adds what errno says.
[[noreturn]] void fail(const std::string& name, const std::string& why);
[[noreturn]] void fail_errno(const std::string& name, const std::string& what);

/// Throw if the name is empty, holds a slash, or ends as a bell or lock file does.
std::string path_of(const std::string& name);
std::string bell_path_of(const std::string& name);
std::string lock_path_of(const std::string& name);

/// A descriptor that closes itself.
class File {
 public:
  File(const std::string& path, int flags, mode_t mode = 0) : fd_(open(path.c_str(), flags | O_CLOEXEC, mode)) {}
  ~File() {
    if (fd_ >= 0) close(fd_);
  }
  File(File&& other) noexcept : fd_(other.release()) {}
  File& operator=(File&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  [[nodiscard]] int fd() const noexcept { return fd_; }
  [[nodiscard]] explicit operator bool() const noexcept { return fd_ >= 0; }
  [[nodiscard]] int release() noexcept { return std::exchange(fd_, -1); }
  [[nodiscard]] struct stat status() const noexcept {
    struct stat st {};
    fstat(fd_, &st);
    return st;
  }

 private:
  int fd_;
};

/// True if the path still means this inode.
bool same_file(const std::string& path, std::uint64_t inode);

/// Takes the writer's lock or throws; the lock ends when the descriptor returned is closed.
int lock_for_writing(const std::string& name);

/// Takes the lock for as long as the file is open, if nobody has it.
void try_lock(const File& lock_file);

/// True if somebody holds the lock. Asks without taking it: a reader's question must never make a restarting writer
/// believe in a rival. `error` is set if the kernel did not answer.
bool is_locked(const File& lock_file, bool& error);

/// posix_fallocate reserves the pages now: a full /dev/shm is an error here, not a SIGBUS in flight. Returns an errno.
int reserve(int fd, std::uint64_t bytes);

}  // namespace wasp::shm
