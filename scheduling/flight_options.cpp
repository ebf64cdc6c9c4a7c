#include "scheduling/flight_options.h"

#include <CLI/CLI.hpp>
#include <cstdio>

#include "scheduling/fault_order.h"

namespace wasp::scheduling {

std::optional<int> parse_flight_options(int argc, char** argv, FlightOptions& o) {
  CLI::App app{
      "The flying process; `wasp fly` starts it together with simulator, recorder and report. `wasp guard`, with the\n"
      "same options, starts it under a guardian that keeps the serial line and answers for it when it dies or hangs.\n"
      "Exit code 0: the mission was flown to its end and behaviours commanded it; 1: broken off, refused or an error;\n"
      "2: bad arguments; 3: --check-rights found some missing; 4: it ended in order, but short of its purpose "
      "(stopped\n"
      "early, or no behaviour ever commanded)."};
  app.name("wasp flight");
  app.option_defaults()->always_capture_default();
  app.add_option("--instance", o.instance, "name of its shared memory: wasp.NAME.flight");
  app.add_option("--config", o.configs, "TOML files in order, later ones override single keys")
      ->check(CLI::ExistingFile);
  app.add_option("--replay", o.replay, "take frames from this recording");
  app.add_option("--seconds", o.seconds, "length of a replay (0: once through)");
  app.add_flag("--preload", o.preload, "decode the whole recording into memory before arming")->needs("--replay");
  app.add_option("--measured", o.measured,
                 "admission by this log/stages.json of an earlier flight, not by configured budgets")
      ->check(CLI::ExistingFile);
  app.add_option("--faults", o.faults, "arm the fault points and run this timeline (docs/faults.md)")
      ->check(CLI::ExistingFile);
  app.add_option("--fault-socket", o.fault_socket,
                 "arm the fault points and take faults on a control socket made here");
  app.add_flag("--no-rt", o.no_rt, "ordinary scheduling, no locked memory; every figure is marked 'not real time'");
  app.add_flag("--guarded", o.guarded,
               "started by `wasp guard`: the serial line is inherited, and the control thread beats");
  app.add_flag("--check-rights", o.check_rights, "only say which rights real time lacks; exit code 3 if any");
  bool list_faults = false;
  app.add_flag("--list-faults", list_faults, "only print the fault points");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  if (list_faults) {
    std::fputs(list_of_fault_points().c_str(), stdout);
    return 0;
  }
  return std::nullopt;
}

}  // namespace wasp::scheduling
