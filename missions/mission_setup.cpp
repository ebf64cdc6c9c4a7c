#include "missions/mission_setup.h"

#include <stdexcept>

#include "behaviours.h"

namespace wasp::missions {

namespace fs = std::filesystem;

double MissionSetup::limit_s() const {
  double seconds = 90;
  for (int i = 0; i < flight.control.mission.leg_count; ++i)
    seconds += static_cast<double>(flight.control.mission.legs[static_cast<std::size_t>(i)].seconds);
  return seconds;
}

MissionSetup load_mission(const std::string& name, std::uint32_t seed, const std::vector<std::string>& extra) {
  const fs::path folder = mission_folder(name);
  MissionSetup setup;
  setup.name = name;
  setup.sim = sim::load_sim_config((folder / "sim.toml").string());
  setup.sim.seed = seed;
  std::vector<std::string> files{(folder / "flight.toml").string()};
  files.insert(files.end(), extra.begin(), extra.end());
  setup.flight = scheduling::load_config(files, scheduling::names_of(all_behaviours()));
  setup.flight.camera = setup.sim.camera;
  setup.flight.camera_down.geometry = setup.sim.down.setup.geometry;
  setup.flight.camera_down.enabled = setup.sim.down.enabled;
  scheduling::check_streams(all_behaviours(), setup.flight);
  return setup;
}

sim::LockstepOptions lockstep_options(const MissionSetup& setup) {
  sim::LockstepOptions options;
  options.sim = setup.sim;
  options.control = setup.flight.control;
  options.control_period_ns = setup.flight.control_period_ns;
  const auto& table = all_behaviours();
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (!setup.flight.behaviours[i].enabled) continue;
    const auto& row = table[i];
    const auto& camera = looks_down(row.stream) ? setup.flight.camera_down.geometry : setup.flight.camera;
    sim::LockstepBehaviour b{static_cast<std::uint32_t>(i), row.stream, row.publishes, {}};
    b.step = [step = row.make_stepper(camera, setup.flight.behaviour_params[i])](const BehaviourInput& input) {
      const auto made = step(input);
      return sim::LockstepCue{made.body, made.flow};
    };
    options.behaviours.push_back(std::move(b));
  }
  return options;
}

}  // namespace wasp::missions
