// wasp-judge: holds a recorded flight of a mission against the mission's bars; what `wasp fly --mission` asks at its
// end.
#include <CLI/CLI.hpp>
#include <iostream>
#include <stdexcept>

#include "missions/campaign.h"

int main(int argc, char** argv) {
  using namespace wasp::missions;
  CLI::App app{"Figures of one recorded flight against the bars of its mission, as JSON, one object a line."};
  app.name("wasp judge");
  std::string mission;
  std::filesystem::path folder;
  std::vector<std::string> configs;
  std::string world;
  std::uint32_t seed = 1;
  app.add_option("MISSION", mission, "which it was")->required();
  app.add_option("FOLDER", folder, "of the run; its log/ is read")->required()->check(CLI::ExistingDirectory);
  app.add_option("--seed", seed, "of the simulated world it was flown in")->capture_default_str();
  app.add_option("--config", configs, "further flight configuration it was flown with")->check(CLI::ExistingFile);
  app.add_option("--world", world, "VRML97 file it was flown in instead of the mission's world")
      ->check(CLI::ExistingFile);
  CLI11_PARSE(app, argc, argv);
  try {
    MissionSetup setup = load_mission(mission, seed, configs);
    setup.sim.world_file = world;
    const Judge& judge = judge_of(mission);
    WorldProbe probe(setup);
    bool ok = true;
    for (const auto& r : verdict(judge, {judge.measure(read_trace(folder / "log"), setup, probe)})) {
      std::cout << wasp::tools::to_json(r).dump() << "\n";
      ok = ok && r.ok;
    }
    return ok ? 0 : 1;
  } catch (const std::exception& e) {
    std::cerr << "wasp judge: " << e.what() << "\n";
    return 2;
  }
}
