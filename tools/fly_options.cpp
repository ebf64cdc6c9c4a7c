#include "tools/fly_options.h"

#include <CLI/CLI.hpp>
#include <ctime>
#include <iostream>

#include "tools/mission_files.h"

namespace wasp::tools {
namespace {

std::string default_name(const FlyOptions& o) {
  char stamp[32];
  const std::time_t now = std::time(nullptr);
  std::strftime(stamp, sizeof stamp, "%Y%m%d-%H%M%S", std::localtime(&now));
  return (o.replay.empty() ? o.mission : "replay") + "-" + stamp;
}

bool plain(const std::string& name) {
  return !name.empty() && name.size() <= 60 &&
         name.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_") ==
             std::string::npos;
}

/// Empty, or what is wrong with the name.
std::string known_mission(const std::string& name) {
  try {
    mission_folder(name);
    return {};
  } catch (const std::exception& e) {
    return e.what();
  }
}

}  // namespace

std::optional<int> parse_fly_options(int argc, char** argv, FlyOptions& o) {
  CLI::App app{
      "Flies a mission with the real-time flight process: in the simulator (default), on a recording with --replay,\n"
      "with the autopilot that --config names and a simulated camera with --follow, or with the real camera and\n"
      "autopilot that --config names ([camera] driver = v4l2 | dc1394 | kinect). Writes OUT/NAME/ with log/ and\n"
      "report.html. Exit code 0 only if the mission was flown to its end, behaviours commanded it, and every bar was\n"
      "met; 4: nothing failed, but it was stopped early or no behaviour ever commanded; 2: bad arguments; 1: anything\n"
      "else."};
  app.name("wasp fly");
  app.option_defaults()->always_capture_default();
  app.add_option("--mission", o.mission, "what to fly (config/missions): " + mission_list())->check(known_mission);
  app.add_option("--seconds", o.seconds,
                 "total time in flight, shared among the legs of the mission (0: as configured; hover: 80 s)")
      ->check(CLI::Range(0.0, 86400.0));
  app.add_option("--replay", o.replay,
                 "fly on this recording, looped if --seconds asks for more; 'example' makes and flies one");
  app.add_flag("--record", o.record, "keep camera frames too: OUT/NAME/recording/ can be given to --replay");
  app.add_option("--config", o.config, "TOML file whose keys override the defaults")->check(CLI::ExistingFile);
  app.add_option("--name", o.name, "name of the run and its folder (default: mission and time)");
  app.add_option("--out", o.out, "parent folder");
  app.add_option("--world", o.world,
                 "VRML97 file to fly in (`wasp world make` makes one); default: that of the mission")
      ->check(CLI::ExistingFile)
      ->excludes("--replay");
  app.add_option("--autopilot", o.autopilot,
                 "whose autopilot flies: the simulator behaves as that one, and wasp is told (docs/autopilots.md)")
      ->check(CLI::IsMember({"wasp", "px4", "ardupilot"}));
  app.add_option(
         "--follow", o.follow,
         "fly the autopilot at [autopilot] endpoint of --config (a real one, or its own simulator) with a\n"
         "simulated camera that goes where it says it is: by 'flight' on that line, or by a second ENDPOINT of\n"
         "its, as tcp://127.0.0.1:5762 (docs/services.md)")
      ->excludes("--replay", "--autopilot")
      ->needs("--config");
  app.add_option("--udp", o.udp_port, "link by UDP to this port in place of a serial line")
      ->excludes("--follow")
      ->check(CLI::Range(1024, 65535));
  app.add_option("--seed", o.seed, "seed of the simulated world and noise");
  app.add_flag("--no-rt", o.no_rt, "do not ask for real time; every figure is marked 'not real time'");
  app.add_flag("--enforce", o.enforce, "refuse to fly unless real time is granted")->excludes("--no-rt");
  app.add_flag("--strict-syscalls", o.strict_syscalls,
               "a real-time thread that leaves its list of system calls ends the run");
  app.add_flag("!--no-safety-pilot", o.safety_pilot, "no simulated pilot who keeps the vehicle over its place");
  app.add_option(
         "--faults", o.fault_timeline,
         "arm the fault points of the flight process: faults on the socket OUT/NAME/faults.sock and, if a FILE\n"
         "is given, by its timeline (docs/faults.md)")
      ->type_name("[FILE]")
      ->expected(0, 1);
  app.add_flag("--json", o.json, "print results as JSON, one object a line");
  try {
    app.parse(argc, argv);
    if (o.name.empty()) o.name = default_name(o);
    o.faults = app.count("--faults") > 0;
    if (!o.fault_timeline.empty())
      if (const std::string why = CLI::ExistingFile(o.fault_timeline); !why.empty())
        throw CLI::ValidationError("--faults", why);
    if (!plain(o.name)) throw CLI::ValidationError("--name", "use letters, digits, '-' and '_', at most 60");
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  return std::nullopt;
}

}  // namespace wasp::tools
