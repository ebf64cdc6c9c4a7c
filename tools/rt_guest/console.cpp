#include "tools/rt_guest/console.h"

#include <cstdlib>

namespace wasp::tools::rt_guest {
namespace {

constexpr std::size_t kTailLines = 40, kTailColumns = 200;
constexpr std::string_view kMark = "@wasp ";

/// Cuts the first word off `text`.
std::string_view word(std::string_view& text) {
  const std::size_t space = text.find(' ');
  const std::string_view first = text.substr(0, space);
  text.remove_prefix(space == std::string_view::npos ? text.size() : space + 1);
  return first;
}

}  // namespace

void Console::feed(std::string_view bytes) {
  for (const char c : bytes) {
    if (c != '\n') {
      if (c != '\r') partial_ += c;
      continue;
    }
    take(partial_);
    partial_.clear();
  }
}

void Console::take(std::string_view line) {
  tail_.emplace_back(line.substr(0, kTailColumns));
  if (tail_.size() > kTailLines) tail_.pop_front();
  const std::size_t at = line.find(kMark);  // the boot loader's last line may stand before it
  if (at == std::string_view::npos) return;
  line.remove_prefix(at + kMark.size());
  const std::string_view kind = word(line);
  if (kind == "up") {
    kernel_ = line;
  } else if (kind == "start") {
    running_ = word(line);
    elapsed_s_ = 0;
  } else if (kind == "tick") {
    word(line);
    elapsed_s_ = std::atoi(std::string(line).c_str());
  } else if (kind == "log") {
    const std::string name(word(line));
    outcomes_[name].log.emplace_back(line);
  } else if (kind == "result") {
    take_result(line);
  } else if (kind == "last") {
    last_ = word(line);
  } else if (kind == "alive") {  // so long after what should end the machine, virtual milliseconds
    JobOutcome& outcome = outcomes_[std::string(word(line))];
    if (outcome.figures.is_object()) outcome.figures["alive_ms"] = std::atoi(std::string(line).c_str());
  } else if (kind == "error") {
    errors_.emplace_back(line);
  } else if (kind == "end") {
    ended_ = true;
  }
}

void Console::machine_ended() {
  if (last_.empty() || ended_) return;
  JobOutcome& outcome = outcomes_[last_];
  if (outcome.figures.is_object()) outcome.figures["restarted"] = true;
  ended_ = true;
}

void Console::take_result(std::string_view rest) {
  JobOutcome& outcome = outcomes_[std::string(word(rest))];
  outcome.exit_code = std::atoi(std::string(word(rest)).c_str());
  outcome.figures = nlohmann::json::parse(rest, nullptr, false);
}

}  // namespace wasp::tools::rt_guest
