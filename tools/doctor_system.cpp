#include "tools/doctor_system.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <fstream>
#include <sstream>

namespace wasp::tools {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kMost_bytes = std::size_t{4} << 20;

std::string trimmed(std::string text) {
  text.erase(text.find_last_not_of(" \t\r\n\0") + 1);
  return text;
}

std::vector<std::string> split(std::string_view text, char separator) {
  std::vector<std::string> parts;
  std::istringstream in{std::string(text)};
  for (std::string part; std::getline(in, part, separator);) parts.push_back(part);
  return parts;
}

std::optional<int> whole_number(std::string_view text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

}  // namespace

fs::path SystemTree::at(std::string_view path) const { return root_ / fs::path(path).relative_path(); }

std::optional<std::string> SystemTree::text(std::string_view path) const {
  std::ifstream in(at(path), std::ios::binary);
  if (!in) return std::nullopt;
  std::string content;
  std::array<char, 16384> chunk;  // /proc/sys refuses reads of megabytes
  while (content.size() < kMost_bytes && (in.read(chunk.data(), chunk.size()) || in.gcount() > 0))
    content.append(chunk.data(), static_cast<std::size_t>(in.gcount()));
  if (in.bad()) return std::nullopt;
  return trimmed(std::move(content));
}

std::optional<std::string> SystemTree::unzipped(std::string_view path) const {
  gzFile file = gzopen(at(path).c_str(), "rb");
  if (file == nullptr) return std::nullopt;
  std::string content(kMost_bytes, '\0');
  const int got = gzread(file, content.data(), static_cast<unsigned>(content.size()));
  gzclose(file);
  if (got < 0) return std::nullopt;
  content.resize(static_cast<std::size_t>(got));
  return content;
}

std::optional<long long> SystemTree::number(std::string_view path) const {
  const auto content = text(path);
  if (!content) return std::nullopt;
  long long value = 0;
  const auto [end, error] = std::from_chars(content->data(), content->data() + content->size(), value);
  return error == std::errc{} ? std::optional(value) : std::nullopt;
}

bool SystemTree::exists(std::string_view path) const {
  std::error_code ignored;
  return fs::exists(at(path), ignored);
}

std::vector<std::string> SystemTree::names(std::string_view folder) const {
  std::vector<std::string> found;
  std::error_code error;
  for (fs::directory_iterator it(at(folder), error), end; !error && it != end; it.increment(error))
    found.push_back(it->path().filename().string());
  std::sort(found.begin(), found.end());
  return found;
}

std::set<int> parse_cores(std::string_view text) {
  std::set<int> cores;
  for (const auto& part : split(text, ',')) {
    const std::string range = trimmed(part);
    const std::size_t dash = range.find('-');
    const auto low = whole_number(std::string_view(range).substr(0, dash));
    const auto high = dash == std::string::npos ? low : whole_number(std::string_view(range).substr(dash + 1));
    if (low && high && *high < 65536)
      for (int c = *low; c <= *high; ++c) cores.insert(c);
  }
  return cores;
}

std::string core_text(const std::set<int>& cores) {
  std::string text;
  for (auto it = cores.begin(); it != cores.end();) {
    const int low = *it;
    int high = low;
    for (++it; it != cores.end() && *it == high + 1; ++it) high = *it;
    if (!text.empty()) text += ',';
    text += std::to_string(low);
    if (high > low) text.append("-").append(std::to_string(high));
  }
  return text.empty() ? "none" : text;
}

std::optional<std::string> kernel_argument(std::string_view command_line, std::string_view key) {
  std::optional<std::string> value;
  for (const auto& word : words(command_line)) {
    if (word == "--") break;  // what follows belongs to init
    if (word == key)
      value = "";
    else if (word.starts_with(key) && word[key.size()] == '=')
      value = word.substr(key.size() + 1);
  }
  return value;
}

std::string chosen(std::string_view text) {
  for (const auto& [open, close] : {std::pair{'[', ']'}, std::pair{'(', ')'}}) {
    const std::size_t from = text.find(open), to = text.find(close);
    if (from != std::string_view::npos && to != std::string_view::npos && to > from)
      return std::string(text.substr(from + 1, to - from - 1));
  }
  return {};
}

std::vector<std::string> words(std::string_view text) {
  std::istringstream in{std::string(text)};
  std::vector<std::string> all;
  for (std::string word; in >> word;) all.push_back(word);
  return all;
}

}  // namespace wasp::tools
