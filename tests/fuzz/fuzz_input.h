// Bytes of a fuzzer's input taken one field after the other; zero and empty behind the end.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

namespace wasp::fuzz {

/// Ends the run as a finding: the input broke a promise, though nothing crashed.
[[noreturn]] inline void broken(const char* promise) {
  std::fprintf(stderr, "broken promise: %s\n", promise);
  std::abort();
}
inline void require(bool held, const char* promise) {
  if (!held) broken(promise);
}

/// An error that a user meets names the thing it is about; one without text, or of the library alone, is no answer.
inline void require_clear(const std::string& error, std::string_view name) {
  if (error.find(name) == std::string::npos) broken(("an error that names its file: " + error).c_str());
}

class FuzzInput {
 public:
  FuzzInput(const std::uint8_t* data, std::size_t size) : rest_(data, size) {}

  [[nodiscard]] bool empty() const { return rest_.empty(); }
  template <class T>
  T take() {
    static_assert(std::is_integral_v<T>);
    T value{};
    const auto bytes = take_bytes(sizeof(T));
    if (!bytes.empty()) std::memcpy(&value, bytes.data(), bytes.size());
    return value;
  }
  /// At most `n` bytes.
  std::span<const std::uint8_t> take_bytes(std::size_t n) {
    const auto taken = rest_.first(std::min(n, rest_.size()));
    rest_ = rest_.subspan(taken.size());
    return taken;
  }
  std::span<const std::uint8_t> rest() { return take_bytes(rest_.size()); }
  std::string rest_as_text() {
    const auto bytes = rest();
    return {bytes.begin(), bytes.end()};
  }

 private:
  std::span<const std::uint8_t> rest_;
};

}  // namespace wasp::fuzz
