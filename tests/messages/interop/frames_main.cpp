// Our half of the comparison with node-mavlink. One JSON line per frame: id, name, sequence, hex, fields.
//   wasp_interop_frames write SEED COUNT [KEY]   COUNT frames of every message with random fields, and one all-zero
//   wasp_interop_frames read [KEY]               decodes frames given as hex lines and encodes them again
// With KEY (64 hexadecimal digits) what is written is signed, and what is read must be.
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <string>
#include <type_traits>

#include "messages/mavlink_frame.h"
#include "tests/messages/hex.h"

namespace wasp::mavlink {
namespace {

using nlohmann::json;
using Random = std::mt19937_64;

template <class T>
T random_value(Random& random) {
  const auto kind = random() % 10;
  if (kind < 3) return T{};  // zeros, so that truncation happens
  if constexpr (std::is_floating_point_v<T>) {
    if (kind == 3) return std::numeric_limits<T>::quiet_NaN();
    if (kind == 4) return -std::numeric_limits<T>::infinity();
    return static_cast<T>(
        std::ldexp(static_cast<double>(random() % 2'000'001) - 1e6, static_cast<int>(random() % 60) - 40));
  } else {
    if (kind == 3) return std::numeric_limits<T>::max();
    if (kind == 4) return std::numeric_limits<T>::min();
    return static_cast<T>(random());
  }
}

void fill(auto& field, Random& random) { field = random_value<std::remove_reference_t<decltype(field)>>(random); }
template <class T, std::size_t N>
void fill(std::array<T, N>& field, Random& random) {
  for (T& value : field) value = random_value<T>(random);
}
/// Text of any length up to the full one, printable, NUL-padded.
template <std::size_t N>
void fill(std::array<char, N>& field, Random& random) {
  field.fill('\0');
  const std::size_t length = random() % (N + 1);
  for (std::size_t i = 0; i < length; ++i) field[i] = static_cast<char>(' ' + random() % 95);
}

/// 64-bit integers as text and floats that JSON lacks as words: nothing is rounded on the way.
json as_json(const auto& value) {
  using T = std::remove_cvref_t<decltype(value)>;
  if constexpr (std::is_floating_point_v<T>) {
    if (std::isnan(value)) return "nan";
    if (std::isinf(value)) return value > 0 ? "inf" : "-inf";
    return static_cast<double>(value);
  } else if constexpr (sizeof(T) == 8) {
    return std::to_string(value);
  } else {
    return value;
  }
}
template <class T, std::size_t N>
json as_json(const std::array<T, N>& values) {
  json list = json::array();
  for (const T& value : values) list.push_back(as_json(value));
  return list;
}
template <std::size_t N>
json as_json(const std::array<char, N>& text) {
  return std::string(text.data(), strnlen(text.data(), N));
}

/// What stands on both sides of a signed line.
struct Signing {
  explicit Signing(const std::string& digits) : key(key_of(digits)) {}
  static SigningKey key_of(const std::string& digits) {
    SigningKey key;
    const auto bytes = test::from_hex(digits);
    std::copy_n(bytes.begin(), std::min(bytes.size(), key.bytes.size()), key.bytes.begin());
    return key;
  }
  SigningKey key;
  SigningClock clock{1'000'000'000};
  FrameSigner signer{key, clock, 5};
  SigningClock receiver{0};
  SignatureCheck check{key, receiver, true};
};

template <class M>
void print(const M& message, std::uint8_t system, std::uint8_t component, std::uint8_t sequence, Signing* signing) {
  Encoder encoder(system, component);
  if (signing != nullptr) encoder.sign_with(signing->signer);
  encoder.set_sequence(sequence);
  std::array<std::uint8_t, kMaxFrame> out{};
  const std::size_t n = encoder.encode(message, out);
  json fields = json::object();
  M::for_each_field(message,
                    [&](const char* name, std::size_t, const auto& field, bool) { fields[name] = as_json(field); });
  std::cout << json{{"id", M::kId},
                    {"name", M::kName},
                    {"sequence", sequence},
                    {"hex", test::to_hex(std::span(out).first(n))},
                    {"fields", fields}}
                   .dump()
            << '\n';
}

void write(std::uint64_t seed, int count, Signing* signing) {
  Random random(seed);
  std::uint8_t sequence = 0;
  for_each_message([&]<class M>() {
    print(M{}, 1, 191, sequence++, signing);
    for (int i = 0; i < count; ++i) {
      M message;
      M::for_each_field(message, [&](const char*, std::size_t, auto& field, bool) { fill(field, random); });
      print(message, 1, 191, sequence++, signing);
    }
  });
}

void read(Signing* signing) {
  Parser parser;
  if (signing != nullptr) parser.check_signatures(signing->check);
  for (std::string line; std::getline(std::cin, line);) {
    parser.feed(test::from_hex(line), [&](const Frame& frame) noexcept {
      for_each_message([&]<class M>() {
        if (frame.is<M>()) print(frame.as<M>(), frame.system_id, frame.component_id, frame.sequence, nullptr);
      });
    });
  }
}

}  // namespace
}  // namespace wasp::mavlink

int main(int argc, char** argv) {
  const std::string mode = argc > 1 ? argv[1] : "";
  const int plain = mode == "read" ? 2 : 4;
  std::optional<wasp::mavlink::Signing> signing;
  if (argc == plain + 1) signing.emplace(argv[plain]);
  wasp::mavlink::Signing* with = signing ? &*signing : nullptr;
  if (mode == "read" && argc <= 3) {
    wasp::mavlink::read(with);
  } else if (mode == "write" && (argc == 4 || argc == 5)) {
    wasp::mavlink::write(std::stoull(argv[2]), std::stoi(argv[3]), with);
  } else {
    std::cerr << "usage: wasp_interop_frames read [KEY] | write SEED COUNT [KEY]\n";
    return 2;
  }
}
