#include "scheduling/fault_request.h"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace wasp::scheduling {
namespace {

constexpr const char* kGrammar = "inject NAME for SECONDS [value X] [behaviour NAME] | clear [NAME] | list | status";

std::vector<std::string_view> words_in(std::string_view text) {
  std::vector<std::string_view> words;
  while (!text.empty()) {
    const std::size_t begin = text.find_first_not_of(' ');
    if (begin == std::string_view::npos) break;
    text.remove_prefix(begin);
    const std::size_t length = std::min(text.find(' '), text.size());
    words.push_back(text.substr(0, length));
    text.remove_prefix(length);
  }
  return words;
}

double number_in(std::string_view word) {
  double x = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), x);
  if (error != std::errc{} || end != word.data() + word.size() || !std::isfinite(x))
    throw FaultRefused("a number was expected");
  return x;
}

FaultWords inject_words(const std::vector<std::string_view>& words) {
  FaultWords order;
  if (words.size() < 2 || words.size() % 2 != 0) throw FaultRefused(std::string("usage: ") + kGrammar);
  order.what = words[1];
  for (std::size_t i = 2; i < words.size(); i += 2) {
    if (words[i] == "for" && !order.for_s)
      order.for_s = number_in(words[i + 1]);
    else if (words[i] == "value" && !order.value)
      order.value = number_in(words[i + 1]);
    else if (words[i] == "behaviour" && order.behaviour.empty())
      order.behaviour = words[i + 1];
    else
      throw FaultRefused(std::string("usage: ") + kGrammar);
  }
  return order;
}

FaultRequest clear_request(const std::vector<std::string_view>& words) {
  FaultRequest request{FaultRequest::Verb::kClear, {}, std::nullopt};
  if (words.size() > 2) throw FaultRefused(std::string("usage: ") + kGrammar);
  if (words.size() == 2) {
    request.point = fault_point_named(words[1]);
    if (!request.point) throw FaultRefused("no fault point of this name; 'list' names them all");
  }
  return request;
}

}  // namespace

FaultRequest parse_fault_request(std::string_view text, const FaultScope& scope) {
  if (text.size() > kLongestRequest)
    throw FaultRefused("a request has at most " + std::to_string(kLongestRequest) + " bytes");
  if (!text.empty() && text.back() == '\n') text.remove_suffix(1);
  if (!std::all_of(text.begin(), text.end(), [](char c) { return c >= 0x20 && c < 0x7f; }))
    throw FaultRefused("a request is one line of plain text");
  const auto words = words_in(text);
  if (words.empty()) throw FaultRefused(std::string("usage: ") + kGrammar);
  if (words[0] == "inject") return {FaultRequest::Verb::kInject, order_of(inject_words(words), scope), std::nullopt};
  if (words[0] == "clear") return clear_request(words);
  if (words.size() == 1 && words[0] == "list") return {FaultRequest::Verb::kList, {}, std::nullopt};
  if (words.size() == 1 && words[0] == "status") return {FaultRequest::Verb::kStatus, {}, std::nullopt};
  throw FaultRefused(std::string("usage: ") + kGrammar);
}

}  // namespace wasp::scheduling
