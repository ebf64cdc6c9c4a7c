// The flying process: config -> shared memory -> drivers -> thread table -> run -> land -> say what happened.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "scheduling/behaviour_loop.h"
#include "scheduling/config.h"

namespace wasp::scheduling {

/// One behaviour as the flight process knows it; made by behaviour_row.
struct BehaviourRow {
  std::string name;
  Stream stream;
  /// Builds the adaptor (before arming) with its parameters from the configuration; the result is its thread's body.
  std::function<std::function<void(LoopControl&)>(const CameraGeometry&, TomlTable params, const BehaviourWiring&)>
      make;
};
using BehaviourTable = std::vector<BehaviourRow>;

template <Behaviour B>
BehaviourRow behaviour_row() {
  return {std::string(B::kName), B::kStream,
          [](const CameraGeometry& camera, TomlTable table, const BehaviourWiring& wiring) {
            typename B::Params params;
            params.camera = camera;
            B::visit_params(params, [&](const char* key, auto& field, double low, double high) {
              table.number(key, field, low, high);
            });
            table.finish();
            auto loop = std::make_shared<BehaviourLoop<B>>(params, wiring);
            return [loop](LoopControl& control) { loop->run(control); };
          }};
}

std::vector<std::string> names_of(const BehaviourTable& table);

/// `wasp flight`: parses its command line and flies. Exit codes: scheduling/flight_options.cpp, its --help.
int flight_main(const BehaviourTable& behaviours, int argc, char** argv);

}  // namespace wasp::scheduling
