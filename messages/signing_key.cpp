#include "messages/signing_key.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <optional>
#include <span>
#include <stdexcept>
#include <string_view>

#include "messages/signing_clock.h"

namespace wasp::mavlink {
namespace {

constexpr std::size_t kLongest = 128;  ///< hexadecimal digits, a line end, and room to notice what is too long

[[noreturn]] void refuse(const std::string& path, const std::string& why) {
  throw std::runtime_error("signing key " + path + ": " + why);
}

class Descriptor {
 public:
  explicit Descriptor(int fd) noexcept : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int get() const noexcept { return fd_; }

 private:
  int fd_;
};

void check_owner(const std::string& path, int fd) {
  struct stat s {};
  if (fstat(fd, &s) != 0) refuse(path, std::strerror(errno));
  if (!S_ISREG(s.st_mode)) refuse(path, "not a regular file");
  if (s.st_uid != geteuid() && s.st_uid != 0) refuse(path, "belongs to another user");
  if ((s.st_mode & 077) != 0) refuse(path, "others may read or write it: chmod 600");
}

std::size_t read_all(int fd, std::span<char> into) {
  std::size_t used = 0;
  for (ssize_t n = 0; used < into.size() && (n = ::read(fd, into.data() + used, into.size() - used)) > 0;)
    used += static_cast<std::size_t>(n);
  return used;
}

std::string_view without_line_end(std::string_view text) {
  while (!text.empty() && (text.back() == '\n' || text.back() == '\r')) text.remove_suffix(1);
  return text;
}

std::optional<SigningKey> from_digits(std::string_view text) {
  SigningKey key;
  if (text.size() != 2 * key.bytes.size()) return std::nullopt;
  for (std::size_t i = 0; i < key.bytes.size(); ++i) {
    const char* digits = text.data() + 2 * i;
    const auto [end, error] = std::from_chars(digits, digits + 2, key.bytes[i], 16);
    if (error != std::errc() || end != digits + 2) return std::nullopt;
  }
  return key;
}

std::optional<SigningKey> key_of(std::string_view content) {
  if (auto key = from_digits(without_line_end(content))) return key;
  SigningKey key;
  if (content.size() != key.bytes.size()) return std::nullopt;
  std::memcpy(key.bytes.data(), content.data(), content.size());
  return key;
}

}  // namespace

SigningKey load_signing_key(const std::string& path) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.get() < 0) refuse(path, std::strerror(errno));
  check_owner(path, file.get());
  std::array<char, kLongest> content{};
  const std::size_t n = read_all(file.get(), content);
  const auto key = key_of({content.data(), n});
  explicit_bzero(content.data(), content.size());
  if (!key) refuse(path, "not 32 bytes, raw or as 64 hexadecimal digits");
  if (std::all_of(key->bytes.begin(), key->bytes.end(), [](std::uint8_t b) { return b == 0; })) refuse(path, "all zero");
  return *key;
}

std::string signing_time_path(const std::string& key_path) { return key_path + ".time"; }

std::uint64_t load_signing_time(const std::string& path) noexcept {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  std::array<char, 32> content{};
  const std::size_t n = file.get() < 0 ? 0 : read_all(file.get(), content);
  std::uint64_t units = 0;
  const auto [end, error] = std::from_chars(content.data(), content.data() + n, units);
  return error == std::errc() && units <= kLastSigningTime ? units : 0;
}

bool save_signing_time(const std::string& path, std::uint64_t units) noexcept {
  std::array<char, 4096> draft{};
  const int length = std::snprintf(draft.data(), draft.size(), "%s.new", path.c_str());
  if (length <= 0 || static_cast<std::size_t>(length) >= draft.size()) return false;
  std::array<char, 32> text{};
  char* end = std::to_chars(text.data(), text.data() + text.size() - 1, units).ptr;
  *end++ = '\n';
  const auto size = end - text.data();
  {
    const Descriptor file(::open(draft.data(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0600));
    if (file.get() < 0 || ::write(file.get(), text.data(), static_cast<std::size_t>(size)) != size) return false;
    if (fsync(file.get()) != 0) return false;
  }
  return std::rename(draft.data(), path.c_str()) == 0;
}

std::uint64_t first_signing_time(std::uint64_t clock_units, std::uint64_t stored_units) noexcept {
  return clock_units > stored_units ? clock_units : stored_units + kSigningMinute;
}

}  // namespace wasp::mavlink
