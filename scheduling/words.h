// A short text put together on a real-time thread: what does not fit is cut.
#pragma once

#include <algorithm>
#include <array>
#include <concepts>
#include <cstdint>
#include <string_view>

#include "rt/contract.h"

namespace wasp::scheduling {

class Words {
 public:
  Words& operator<<(std::string_view text) WASP_REALTIME {
    const std::size_t n = std::min(text.size(), text_.size() - size_);
    std::copy_n(text.begin(), n, text_.begin() + static_cast<std::ptrdiff_t>(size_));
    size_ += n;
    return *this;
  }
  Words& operator<<(char c) WASP_REALTIME { return *this << std::string_view(&c, 1); }
  template <std::unsigned_integral T>
  Words& operator<<(T number) WASP_REALTIME {
    std::array<char, 20> digits;
    std::size_t begin = digits.size();
    auto rest = static_cast<std::uint64_t>(number);
    do digits[--begin] = static_cast<char>('0' + rest % 10);
    while ((rest /= 10) != 0);
    return *this << std::string_view(digits.data() + begin, digits.size() - begin);
  }
  [[nodiscard]] std::string_view view() const WASP_REALTIME { return {text_.data(), size_}; }

 private:
  std::array<char, 120> text_{};
  std::size_t size_ = 0;
};

}  // namespace wasp::scheduling
