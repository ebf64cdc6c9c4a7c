// Values and names of the MAVLink parameter protocol. PARAM_VALUE and PARAM_SET carry every value in four bytes that
// are declared a float; what stands in them is one of two things that are told apart by nothing on the wire: the number
// itself (C cast: ArduPilot), or the integer's own bits (byte-wise: PX4). AUTOPILOT_VERSION.capabilities says which.
// Source: MAVLink guide, "Parameter Protocol".
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>

#include "messages/mavlink_messages.h"
#include "rt/contract.h"

namespace wasp::drivers {

enum class ParameterEncoding : std::uint8_t { kCCast, kBytewise };

using ParameterName = std::array<char, 16>;  ///< NUL-padded; no terminator at full length

/// The name without its padding. Realtime-safe: yes.
inline std::string_view name_of(const ParameterName& name) WASP_REALTIME {
  return {name.data(), static_cast<std::size_t>(std::find(name.begin(), name.end(), '\0') - name.begin())};
}
/// Padded; what is longer than 16 characters is cut. Realtime-safe: yes.
inline ParameterName parameter_name(std::string_view text) WASP_REALTIME {
  ParameterName name{};
  std::copy_n(text.begin(), std::min(text.size(), name.size()), name.begin());
  return name;
}

namespace detail {
struct IntegerRange {
  double least = 0, greatest = 0;  ///< both 0: no integer of four bytes or fewer
};
constexpr IntegerRange integer_range(std::uint8_t type) WASP_REALTIME {
  using namespace mavlink;  // NOLINT: its enumerations
  switch (type) {
    case mav_param_type::kUint8:
      return {0, 255};
    case mav_param_type::kInt8:
      return {-128, 127};
    case mav_param_type::kUint16:
      return {0, 65535};
    case mav_param_type::kInt16:
      return {-32768, 32767};
    case mav_param_type::kUint32:
      return {0, 4294967295.0};
    case mav_param_type::kInt32:
      return {-2147483648.0, 2147483647.0};
    default:
      return {};
  }
}
}  // namespace detail

/// True for the types that four bytes can hold: integers up to 32 bits, and float. Realtime-safe: yes.
constexpr bool is_portable(std::uint8_t type) WASP_REALTIME {
  return type == mavlink::mav_param_type::kReal32 || detail::integer_range(type).greatest > 0;
}

/// What goes into param_value; nullopt for a type that does not fit four bytes, an integer out of its range, and a
/// value that is not finite. A C cast keeps integers up to 2^24 exactly. Realtime-safe: yes.
inline std::optional<float> encode_parameter(ParameterEncoding encoding, std::uint8_t type,
                                             double value) WASP_REALTIME {
  if (!std::isfinite(value) || !is_portable(type)) return std::nullopt;
  if (type == mavlink::mav_param_type::kReal32) return static_cast<float>(value);
  const detail::IntegerRange range = detail::integer_range(type);
  const double whole = std::nearbyint(value);
  if (whole < range.least || whole > range.greatest) return std::nullopt;
  if (encoding == ParameterEncoding::kCCast) return static_cast<float>(whole);
  // Little-endian: the low bytes of the 32 bits are the smaller integer's own; a negative one fills the rest with ones.
  const auto bits = static_cast<std::uint32_t>(static_cast<std::int64_t>(whole));
  const std::uint32_t kept = range.greatest <= 255 ? bits & 0xffu : range.greatest <= 65535 ? bits & 0xffffu : bits;
  return std::bit_cast<float>(kept);
}

/// The number behind param_value; nullopt for a type that does not fit, a cast number that is not finite or not of the
/// type's range. Realtime-safe: yes.
inline std::optional<double> decode_parameter(ParameterEncoding encoding, std::uint8_t type,
                                              float param_value) WASP_REALTIME {
  using namespace mavlink;  // NOLINT: its enumerations
  if (!is_portable(type)) return std::nullopt;
  const bool real = type == mav_param_type::kReal32;
  if (real || encoding == ParameterEncoding::kCCast) {
    if (!std::isfinite(param_value)) return std::nullopt;
    if (real) return static_cast<double>(param_value);
    const detail::IntegerRange range = detail::integer_range(type);
    const double whole = std::nearbyint(static_cast<double>(param_value));
    if (whole < range.least || whole > range.greatest) return std::nullopt;
    return whole;
  }
  const auto bits = std::bit_cast<std::uint32_t>(param_value);
  switch (type) {
    case mav_param_type::kUint8:
      return static_cast<double>(static_cast<std::uint8_t>(bits));
    case mav_param_type::kInt8:
      return static_cast<double>(static_cast<std::int8_t>(bits));
    case mav_param_type::kUint16:
      return static_cast<double>(static_cast<std::uint16_t>(bits));
    case mav_param_type::kInt16:
      return static_cast<double>(static_cast<std::int16_t>(bits));
    case mav_param_type::kUint32:
      return static_cast<double>(bits);
    default:
      return static_cast<double>(static_cast<std::int32_t>(bits));
  }
}

/// The bit of AUTOPILOT_VERSION.capabilities that announces the encoding. Realtime-safe: yes.
constexpr std::uint64_t capability_of(ParameterEncoding encoding) WASP_REALTIME {
  return encoding == ParameterEncoding::kBytewise ? mavlink::mav_protocol_capability::kParamEncodeBytewise
                                                  : mavlink::mav_protocol_capability::kParamEncodeCCast;
}
/// What a peer's capabilities say; `otherwise` where they say neither (or both). Realtime-safe: yes.
constexpr ParameterEncoding encoding_of(std::uint64_t capabilities, ParameterEncoding otherwise) WASP_REALTIME {
  const bool bytewise = (capabilities & capability_of(ParameterEncoding::kBytewise)) != 0;
  const bool cast = (capabilities & capability_of(ParameterEncoding::kCCast)) != 0;
  if (bytewise == cast) return otherwise;
  return bytewise ? ParameterEncoding::kBytewise : ParameterEncoding::kCCast;
}

}  // namespace wasp::drivers
