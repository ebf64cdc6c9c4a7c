// A line for the log, put together without memory or formats: what does not fit is cut.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string_view>

#include "rt/contract.h"

namespace wasp::drivers {

class TextLine {
 public:
  TextLine& operator<<(std::string_view text) WASP_REALTIME {
    const std::size_t n = std::min(text.size(), text_.size() - used_);
    std::memcpy(text_.data() + used_, text.data(), n);
    used_ += n;
    return *this;
  }
  /// At most three decimals, none where there are none.
  TextLine& operator<<(double value) WASP_REALTIME {
    if (!std::isfinite(value) || std::fabs(value) > 1e12) return *this << (value > 0 ? "+huge" : "-huge");
    auto thousandths = static_cast<std::int64_t>(std::fabs(value) * 1000 + 0.5);
    if (value < 0 && thousandths > 0) *this << "-";
    number(static_cast<std::uint64_t>(thousandths / 1000), 1);
    thousandths %= 1000;
    if (thousandths == 0) return *this;
    *this << ".";
    int digits = 3;
    for (; thousandths % 10 == 0; thousandths /= 10) --digits;
    return number(static_cast<std::uint64_t>(thousandths), digits);
  }
  [[nodiscard]] std::string_view view() const WASP_REALTIME { return {text_.data(), used_}; }
  [[nodiscard]] bool empty() const noexcept { return used_ == 0; }

 private:
  TextLine& number(std::uint64_t value, int least_digits) WASP_REALTIME {
    std::array<char, 20> digits;
    std::size_t begin = digits.size();
    for (; value != 0 || least_digits > 0; value /= 10, --least_digits)
      digits[--begin] = static_cast<char>('0' + value % 10);
    return *this << std::string_view(digits.data() + begin, digits.size() - begin);
  }

  std::array<char, 118> text_;
  std::size_t used_ = 0;
};

}  // namespace wasp::drivers
