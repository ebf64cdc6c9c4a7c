// wasp-link: a look at an autopilot before any mission, and a short bench flight where that is asked for.
#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <exception>
#include <optional>

#include "tools/link_session.h"
#include "types/units.h"

namespace {

using namespace wasp;

struct Options {
  scheduling::AutopilotConfig autopilot;
  std::string flavour = "px4", attitude;
  double seconds = 10;
  bool arm = false;
};

void declare(CLI::App& app, Options& o) {
  app.name("wasp link");
  app.add_option("endpoint", o.autopilot.endpoint,
                 "serial:DEVICE:BAUD, udp://OWN_ADDRESS:PORT, udpout://HOST:PORT or tcp://HOST:PORT")
      ->required();
  app.add_option("--flavour", o.flavour, "whose autopilot it is")
      ->check(CLI::IsMember({"wasp", "px4", "ardupilot"}))
      ->capture_default_str();
  app.add_option("--seconds", o.seconds, "how long to look; with --arm: patience until it can be flown")
      ->check(CLI::Range(1.0, 3600.0))
      ->capture_default_str();
  app.add_option("--system-id", o.autopilot.system_id, "of the vehicle")
      ->check(CLI::Range(1, 255))
      ->capture_default_str();
  app.add_option("--mode", o.autopilot.follow_mode, "mode number in which it obeys; -1: the flavour's own")
      ->capture_default_str();
  app.add_option("--attitude", o.attitude,
                 "a flight of its own: \"pitch=-8,roll=0,seconds=5,height=2\" (degrees, metres by the autopilot's own "
                 "estimate): up, hold that, level, land. Needs --arm");
  app.add_flag("--arm", o.arm, "it may be armed: THE ROTORS TURN");
}

int run(Options& o) {
  for (std::size_t i = 0; i < drivers::kFlavours.size(); ++i)
    if (drivers::kFlavours[i].name == o.flavour) o.autopilot.flavour = static_cast<drivers::Flavour>(i);
  tools::LinkSession session(o.autopilot);
  if (o.attitude.empty()) {
    session.run(o.seconds, nullptr);
    return session.report() ? 0 : 1;
  }
  tools::BenchFlight flight(tools::BenchPlan::parse(o.attitude), o.autopilot.flavour);
  session.run(o.seconds, &flight);
  session.report();
  const auto error = flight.error();
  if (!error) return 1;  // it was never held
  std::printf("attitude reached less commanded, mean of the last second: roll %.2f, pitch %.2f degrees\n",
              to_degrees(Radians{error->first}).value, to_degrees(Radians{error->second}).value);
  return flight.landed() ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Who is on a line, which messages come how often, what the autopilot's parameters say, and whether it\n"
      "can be flown by setpoints. Exit code 0: it can, and was flown and landed where that was asked for; 1: not, or "
      "not\n"
      "heard; 2: bad arguments."};
  Options options;
  declare(app, options);
  try {
    app.parse(argc, argv);
    if (!options.attitude.empty() && !options.arm) throw CLI::ValidationError("--attitude", "needs --arm");
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  std::signal(SIGPIPE, SIG_IGN);
  try {
    return run(options);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "wasp link: %s\n", e.what());
    return 1;
  }
}
