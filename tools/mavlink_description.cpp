#include "tools/mavlink_description.h"

#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string_view>
#include <utility>

namespace wasp::tools {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;
using Type = FieldDescription::Type;

struct TypeRow {
  std::string_view name;
  Type type;
  std::size_t bytes;
};
constexpr std::array<TypeRow, 11> kTypes = {{{"uint8_t", Type::kU8, 1},
                                             {"int8_t", Type::kI8, 1},
                                             {"uint16_t", Type::kU16, 2},
                                             {"int16_t", Type::kI16, 2},
                                             {"uint32_t", Type::kU32, 4},
                                             {"int32_t", Type::kI32, 4},
                                             {"uint64_t", Type::kU64, 8},
                                             {"int64_t", Type::kI64, 8},
                                             {"float", Type::kF32, 4},
                                             {"double", Type::kF64, 8},
                                             {"char", Type::kChar, 1}}};

std::size_t bytes_of(Type type) { return kTypes[static_cast<std::size_t>(type)].bytes; }

Type type_of(const std::string& name) {
  for (const TypeRow& row : kTypes)
    if (row.name == name) return row.type;
  throw std::runtime_error("unknown type '" + name + "'");
}

FieldDescription field_of(const json& j, std::size_t max_length) {
  FieldDescription f;
  f.name = j.at("name").get<std::string>();
  f.type = type_of(j.at("type").get<std::string>());
  f.offset = j.at("offset").get<std::size_t>();
  f.length = j.at("array_length").get<std::size_t>();
  f.extension = j.at("extension").get<bool>();
  f.units = j.value("units", "");
  f.enumeration = j.value("enum", "");
  const std::size_t bytes = bytes_of(f.type) * std::max<std::size_t>(1, f.length);
  if (f.offset > max_length || f.length > max_length || f.offset + bytes > max_length)
    throw std::runtime_error(f.name + " lies beyond its message");
  return f;
}

MessageDescription message_of(const json& j) {
  MessageDescription m;
  m.id = j.at("id").get<std::uint32_t>();
  m.name = j.at("name").get<std::string>();
  m.crc_extra = j.at("crc_extra").get<std::uint8_t>();
  m.min_length = j.at("min_length").get<std::size_t>();
  m.max_length = j.at("max_length").get<std::size_t>();
  if (m.id > 0xFFFFFF || m.min_length > m.max_length || m.max_length > mavlink::kMaxPayload)
    throw std::runtime_error(m.name + ": no such message can be");
  for (const json& field : j.at("fields")) m.fields.push_back(field_of(field, m.max_length));
  return m;
}

template <class T>
T read(const std::uint8_t* at) {
  T value;
  std::memcpy(&value, at, sizeof value);
  return value;
}

ordered_json number(double value) {
  if (std::isnan(value)) return "nan";
  if (std::isinf(value)) return value > 0 ? "inf" : "-inf";
  return value;
}

ordered_json element(Type type, const std::uint8_t* at) {
  switch (type) {
    case Type::kU8:
    case Type::kChar:
      return read<std::uint8_t>(at);
    case Type::kI8:
      return read<std::int8_t>(at);
    case Type::kU16:
      return read<std::uint16_t>(at);
    case Type::kI16:
      return read<std::int16_t>(at);
    case Type::kU32:
      return read<std::uint32_t>(at);
    case Type::kI32:
      return read<std::int32_t>(at);
    case Type::kU64:
      return read<std::uint64_t>(at);
    case Type::kI64:
      return read<std::int64_t>(at);
    case Type::kF32:
      return number(static_cast<double>(read<float>(at)));
    case Type::kF64:
      break;
  }
  return number(read<double>(at));
}

/// Bytes above 127 as the two UTF-8 bytes of their code point.
std::string text(const std::uint8_t* at, std::size_t length) {
  std::string out;
  for (std::size_t i = 0; i < length && at[i] != 0; ++i) {
    if (at[i] < 0x80) {
      out += static_cast<char>(at[i]);
    } else {
      out += static_cast<char>(0xC0 | at[i] >> 6);
      out += static_cast<char>(0x80 | (at[i] & 0x3F));
    }
  }
  return out;
}

ordered_json value(const FieldDescription& field, const std::uint8_t* at) {
  if (field.type == Type::kChar && field.length > 0) return text(at, field.length);
  if (field.length == 0) return element(field.type, at);
  ordered_json list = ordered_json::array();
  for (std::size_t i = 0; i < field.length; ++i) list.push_back(element(field.type, at + i * bytes_of(field.type)));
  return list;
}

}  // namespace

MavlinkDescription MavlinkDescription::parse(const std::string& text, const std::string& path) {
  MavlinkDescription d;
  try {
    const json description = json::parse(text);
    for (const json& message : description.at("messages")) d.messages_.push_back(message_of(message));
  } catch (const std::exception& error) {
    throw std::runtime_error(path + ": no message description: " + error.what());
  }
  std::sort(d.messages_.begin(), d.messages_.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
  for (const MessageDescription& m : d.messages_) {
    if (!d.rows_.empty() && d.rows_.back().id == m.id) throw std::runtime_error(path + ": two messages " + m.name);
    d.rows_.push_back({m.id, m.name.c_str(), m.crc_extra, m.min_length, m.max_length});
  }
  return d;
}

MavlinkDescription MavlinkDescription::load(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error(path.string() + ": cannot be read");
  return parse(std::string(std::istreambuf_iterator<char>(file), {}), path.string());
}

const MessageDescription* MavlinkDescription::find(std::uint32_t id) const {
  const auto row = std::lower_bound(messages_.begin(), messages_.end(), id,
                                    [](const MessageDescription& m, std::uint32_t wanted) { return m.id < wanted; });
  return row != messages_.end() && row->id == id ? &*row : nullptr;
}

std::filesystem::path default_description() {
  constexpr const char* kName = "mavlink_messages.json";
  const auto folder = std::filesystem::read_symlink("/proc/self/exe").parent_path();
  for (const auto& path : {folder / ".." / "share" / "wasp" / kName, folder / "generated" / "messages" / kName,
                           folder / ".." / "generated" / "messages" / kName})
    if (std::filesystem::exists(path)) return path;
  throw std::runtime_error(std::string(kName) + " stands neither in ../share/wasp nor in generated/messages beside " +
                           folder.string());
}

ordered_json decode(const MessageDescription& message, std::span<const std::uint8_t> payload) {
  const auto full = mavlink::wire::full_length<mavlink::kMaxPayload>(payload.data(), payload.size());
  ordered_json fields = ordered_json::object();
  for (const FieldDescription& field : message.fields) fields[field.name] = value(field, full.data() + field.offset);
  return fields;
}

}  // namespace wasp::tools
