// The message set at run time: what share/wasp/mavlink_messages.json says is enough to check and decode any frame of it,
// of ours or of another dialect (messages/generate.py --json writes it from any definition file).
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "messages/mavlink_frame.h"

namespace wasp::tools {

struct FieldDescription {
  std::string name, units, enumeration;
  enum class Type : std::uint8_t { kU8, kI8, kU16, kI16, kU32, kI32, kU64, kI64, kF32, kF64, kChar } type = Type::kU8;
  std::size_t offset = 0, length = 0;  ///< length 0: not an array
  bool extension = false;
};

struct MessageDescription {
  std::uint32_t id = 0;
  std::string name;
  std::uint8_t crc_extra = 0;
  std::size_t min_length = 0, max_length = 0;
  std::vector<FieldDescription> fields;  ///< in wire order
};

class MavlinkDescription {
 public:
  /// Throws std::runtime_error with the path and what is wrong in the file.
  static MavlinkDescription load(const std::filesystem::path& path);
  static MavlinkDescription parse(const std::string& text, const std::string& path);

  /// Nullptr if the description lacks the id.
  [[nodiscard]] const MessageDescription* find(std::uint32_t id) const;
  /// Rows for a parser; valid while this description lives and stays where it is.
  [[nodiscard]] std::span<const mavlink::MessageInfo> rows() const { return rows_; }

 private:
  std::vector<MessageDescription> messages_;  ///< rising in id
  std::vector<mavlink::MessageInfo> rows_;
};

/// The description beside this program: installed, or in its build folder. Throws if there is none.
std::filesystem::path default_description();

/// Field by name, in wire order. Floats are exact: each is written as the double it equals; NaN and infinities, which
/// JSON lacks, are the words "nan", "inf", "-inf". Text ends at its first NUL, a byte of it is a code point.
nlohmann::ordered_json decode(const MessageDescription& message, std::span<const std::uint8_t> payload);

}  // namespace wasp::tools
