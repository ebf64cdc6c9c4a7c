// A file (or folder) in /dev/shm that a fuzzer writes anew for every input; gone when the process ends.
#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "tests/fuzz/fuzz_input.h"

namespace wasp::fuzz {

inline std::filesystem::path scratch_path(const std::string& name) {
  return "/dev/shm/wasp_fuzz_" + std::to_string(getpid()) + name;
}

class ScratchFile {
 public:
  explicit ScratchFile(const std::string& name)
      : path_(scratch_path(name)), fd_(open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600)) {
    require(fd_ >= 0, "a scratch file can be made");
  }
  ScratchFile(const ScratchFile&) = delete;
  ScratchFile& operator=(const ScratchFile&) = delete;
  ~ScratchFile() {
    close(fd_);
    unlink(path_.c_str());
  }

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  void write(std::span<const std::uint8_t> bytes) {
    require(ftruncate(fd_, 0) == 0 && pwrite(fd_, bytes.data(), bytes.size(), 0) == static_cast<ssize_t>(bytes.size()),
            "a scratch file can be written");
  }

 private:
  std::filesystem::path path_;
  int fd_;
};

/// Made empty by `clear`.
class ScratchFolder {
 public:
  ScratchFolder() : path_(scratch_path("")) { std::filesystem::create_directories(path_); }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  ~ScratchFolder() { std::filesystem::remove_all(path_); }

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  void clear() {
    for (const auto& entry : std::filesystem::directory_iterator(path_)) std::filesystem::remove_all(entry.path());
  }
  void write(const std::string& name, std::span<const std::uint8_t> bytes) {
    const int fd = open((path_ / name).c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    require(fd >= 0 && ::write(fd, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size()),
            "a scratch file can be written");
    close(fd);
  }

 private:
  std::filesystem::path path_;
};

}  // namespace wasp::fuzz
