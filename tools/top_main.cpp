// wasp-top: what the flight does, live. It maps the regions read-only; the flight may end and start again meanwhile.
#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <exception>
#include <nlohmann/json.hpp>

#include "rt/clock.h"
#include "shm/bus_guard.h"
#include "tools/top_snapshot.h"
#include "tools/top_text.h"

namespace {

using namespace wasp;

std::atomic<bool> stop_requested{false};

/// The one instance there is; empty, with a message, if there are none or several.
std::string only_instance() {
  const auto names = tools::list_instances();
  if (names.size() == 1) return names.front();
  fmt::print(stderr, "wasp-top: {}\n",
             names.empty() ? "no instance is running (nothing in shared memory)"
                           : "several instances; choose one with --instance:");
  for (const auto& name : names) fmt::print("{}\n", name);
  return {};
}

int terminal_rows() {
  winsize size{};
  return ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_row > 4 ? size.ws_row : 1000;
}

/// Redraws in place; each line clears its own rest so that nothing flickers.
void redraw(const std::vector<std::string>& lines) {
  const auto room = static_cast<std::size_t>(terminal_rows() - 1);
  std::string screen = "\x1b[H";
  for (std::size_t i = 0; i < std::min(lines.size(), room); ++i) {
    const bool cut = i + 1 == room && lines.size() > room;
    const std::string text = cut ? fmt::format("... {} more lines", lines.size() - i) : lines[i];
    screen += i == 0 ? "\x1b[7m" + text + "\x1b[0m\x1b[K\n" : text + "\x1b[K\n";
  }
  std::fputs((screen + "\x1b[J").c_str(), stdout);
  std::fflush(stdout);
}

void show(const tools::TopSnapshot& snapshot, bool json, bool in_place) {
  if (json) {
    fmt::print("{}\n", tools::top_json(snapshot).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  } else if (in_place) {
    redraw(tools::top_lines(snapshot));
  } else {
    for (const auto& line : tools::top_lines(snapshot)) fmt::print("{}\n", line);
  }
  std::fflush(stdout);
}

int watch(const std::string& instance, bool once, bool json, double period_s) {
  tools::TopObserver observer(instance);
  const bool in_place = !once && !json && isatty(STDOUT_FILENO) != 0;
  if (in_place) std::fputs("\x1b[2J", stdout);
  while (!stop_requested) {
    const auto snapshot = observer.look();
    show(snapshot, json, in_place);
    if (once) {
      const bool any =
          std::any_of(snapshot.regions.begin(), snapshot.regions.end(), [](const auto& r) { return r.attached; });
      if (!any) fmt::print(stderr, "wasp-top: instance '{}' has no region in shared memory\n", instance);
      return any ? 0 : 1;
    }
    rt::sleep_until(rt::now() + from_seconds(period_s));
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  std::string instance;
  bool once = false, json = false;
  double period_s = 0.2;
  CLI::App app{"Shows topics, rates, latencies and the state of a running flight, read-only. Stop with Ctrl-C."};
  app.name("wasp-top");
  app.add_option("--instance", instance, "Instance to watch; may be left out when there is exactly one");
  app.add_flag("--once", once, "Print once and end; exit code 1 if the instance has no region");
  app.add_flag("--json", json, "One JSON document a look, a line each");
  app.add_option("--period-s", period_s, "Time between looks [s]")
      ->check(CLI::Range(0.05, 60.0))
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  if (instance.empty() && (instance = only_instance()).empty()) return 1;

  std::signal(SIGTERM, [](int) { stop_requested = true; });
  std::signal(SIGINT, [](int) { stop_requested = true; });
  shm::install_bus_guard();
  try {
    return watch(instance, once, json, period_s);
  } catch (const std::exception& error) {
    fmt::print(stderr, "wasp-top: {}\n", error.what());
    return 1;
  }
}
