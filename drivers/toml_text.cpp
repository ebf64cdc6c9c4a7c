#include "drivers/toml_text.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string_view>

namespace wasp::drivers {
namespace {

/// Bytes of the character that begins at text[at] (RFC 3629: shortest form, no surrogates, at most U+10FFFF); 0: none
/// does.
std::size_t character_at(std::string_view text, std::size_t at) {
  const auto byte = [&](std::size_t i) { return at + i < text.size() ? static_cast<unsigned char>(text[at + i]) : 0u; };
  const unsigned first = byte(0);
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xC2 && first <= 0xDF   ? 2
                             : first >> 4 == 0xE              ? 3
                             : first >= 0xF0 && first <= 0xF4 ? 4
                                                              : 0;
  const unsigned lowest = first == 0xE0 ? 0xA0 : first == 0xF0 ? 0x90 : 0x80;
  const unsigned highest = first == 0xED ? 0x9F : first == 0xF4 ? 0x8F : 0xBF;
  if (length == 0 || byte(1) < lowest || byte(1) > highest) return 0;
  for (std::size_t i = 2; i < length; ++i)
    if (byte(i) >> 6 != 2) return 0;
  return length;
}

/// What is wrong with one line; `depth` is how many brackets are open before and behind it. nullptr: nothing.
const char* problem_of(std::string_view line, int& depth) {
  for (std::size_t at = 0, n = 0; at < line.size(); at += n) {
    n = character_at(line, at);
    if (n == 0) return "not UTF-8";
    const char c = line[at];
    if (c == '[' || c == '{') ++depth;
    if ((c == ']' || c == '}') && depth > 0) --depth;
    if (depth > kDeepestToml) return "nested too deep";
  }
  const std::string_view key = line.substr(0, line.find('='));
  return std::count(key.begin(), key.end(), '.') > kDeepestToml ? "a key of too many parts" : nullptr;
}

void check(const std::string& text, const std::string& name) {
  if (text.size() > kLongestToml) throw std::runtime_error(name + ": longer than 1 MiB");
  std::istringstream lines(text);
  std::string line;
  int depth = 0;
  for (int number = 1; std::getline(lines, line); ++number)
    if (const char* problem = problem_of(line, depth))
      throw std::runtime_error(name + ":" + std::to_string(number) + ": " + problem);
}

}  // namespace

toml::value parse_toml(std::istream& in, const std::string& name) {
  std::string text;
  for (std::array<char, 4096> piece; in && text.size() <= kLongestToml;) {
    in.read(piece.data(), piece.size());
    text.append(piece.data(), static_cast<std::size_t>(in.gcount()));
  }
  check(text, name);
  std::istringstream checked(text);
  try {
    return toml::parse(checked, name);
  } catch (const std::exception& error) {
    throw std::runtime_error(name + ": " + error.what());
  }
}

toml::value parse_toml_file(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in || std::filesystem::is_directory(file)) throw std::runtime_error(file.string() + ": cannot be read");
  return parse_toml(in, file.string());
}

}  // namespace wasp::drivers
