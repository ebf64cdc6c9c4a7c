// wasp-iceoryx: the door to programs that speak iceoryx. A process of its own: nothing of iceoryx is ever inside the
// flight. See docs/iceoryx.md.
#include <fmt/format.h>
#include <sched.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

#include "tools/iceoryx_export.h"
#include "tools/iceoryx_import.h"
#include "tools/iceoryx_list.h"
#include "tools/record_attachment.h"

namespace {

using namespace wasp;

/// The one instance there is; throws if there are none or several.
std::string only_instance() {
  const auto names = tools::list_instances();
  if (names.size() == 1) return names.front();
  std::string text = names.empty() ? "no instance of wasp is running (nothing in shared memory)"
                                   : "several instances run; choose one with --instance:";
  for (const auto& name : names) text += " " + name;
  throw std::runtime_error(text);
}

/// "640x480".
void parse_size(const std::string& text, iceoryx::ImportOptions& options) {
  char rest = 0;
  if (text.empty()) return;
  if (std::sscanf(text.c_str(), "%5ux%5u%c", &options.width_px, &options.height_px, &rest) != 2 ||
      options.width_px == 0 || options.height_px == 0 || options.width_px > 16384 || options.height_px > 16384)
    throw std::runtime_error("--size '" + text + "' is not WIDTHxHEIGHT, each 1 to 16384");
}

/// Below every thread of the flight, even if the program that started us was real-time.
void step_back() {
  const sched_param none{};
  sched_setscheduler(0, SCHED_OTHER, &none);
  setpriority(PRIO_PROCESS, 0, 5);
}

void declare_export(CLI::App& app, iceoryx::ExportOptions& o, bool& all) {
  app.add_option("--instance", o.instance, "instance to export; may be left out when there is exactly one");
  auto* topics = app.add_option("--topic", o.topics, "topic to export, e.g. gray or cue.ground_altitude; may repeat");
  app.add_flag("--all", all, "export every topic")->excludes(topics);
  app.add_option("--wait", o.wait_s, "wait this long for iox-roudi and for the topics [s]")
      ->check(CLI::Range(0.0, 3600.0))
      ->capture_default_str();
  app.add_option("--poll-ms", o.poll_ms, "time between looks at the rings [ms]")
      ->check(CLI::Range(0.1, 100.0))
      ->capture_default_str();
  app.add_flag("--json", o.json, "the account at the end as one JSON object a line");
}

void declare_import(CLI::App& app, iceoryx::ImportOptions& o, std::string& size) {
  app.add_option("--instance", o.instance, "instance to be the camera of: makes the region wasp.NAME.camera")
      ->required();
  app.add_option("--service", o.service, "SERVICE/INSTANCE/EVENT of frames that say whether they are grey or depth");
  app.add_option("--gray", o.gray, "SERVICE/INSTANCE/EVENT of the grey images");
  app.add_option("--depth", o.depth, "SERVICE/INSTANCE/EVENT of the depth images");
  app.add_option("--size", size, "WIDTHxHEIGHT of the camera (default: of the first frame)");
  app.add_flag("--raw", o.raw,
               "messages are bare pixels without padding: mono8 with --gray, uint16 millimetres with --depth; exposure "
               "is taken to be the moment of arrival");
  app.add_option("--wait", o.wait_s, "wait this long for iox-roudi [s]")
      ->check(CLI::Range(0.0, 3600.0))
      ->capture_default_str();
  app.add_flag("--json", o.json, "the account at the end as one JSON object a line");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Exports the topics of a running instance as iceoryx services, and imports a camera from one. Needs iceoryx's "
      "daemon, iox-roudi. Message layout: docs/iceoryx.md."};
  app.name("wasp iceoryx");
  app.require_subcommand(1);
  iceoryx::ExportOptions exported;
  iceoryx::ImportOptions imported;
  std::string size;
  bool all = false, list_json = false;
  auto* list = app.add_subcommand("list", "topics that could be exported, and the services iceoryx offers now");
  list->add_flag("--json", list_json, "one JSON document");
  auto* out = app.add_subcommand("export", "rings of an instance as services wasp/INSTANCE/TOPIC, until Ctrl-C");
  declare_export(*out, exported, all);
  auto* in = app.add_subcommand("import", "be the camera of an instance with frames of iceoryx services, until Ctrl-C");
  declare_import(*in, imported, size);
  CLI11_PARSE(app, argc, argv);

  try {
    if (list->parsed()) return iceoryx::run_list(list_json);
    if (out->parsed()) {
      if (!all && exported.topics.empty()) throw std::runtime_error("nothing to export: say --topic NAME or --all");
      if (exported.instance.empty()) exported.instance = only_instance();
      iceoryx::check_request(exported);
      step_back();
      return iceoryx::run_export(exported);
    }
    parse_size(size, imported);
    iceoryx::check_request(imported);
    return iceoryx::run_import(imported);
  } catch (const std::exception& error) {
    fmt::print(stderr, "wasp-iceoryx: {}\n", error.what());
    return iceoryx::kBadRequest;
  }
}
