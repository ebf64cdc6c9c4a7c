// One behaviour as programs know it: what releases it, what it makes, and two ways to run its `step` - on a real-time
// thread of the flying process, or called in lockstep on virtual time.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "scheduling/behaviour_loop.h"
#include "scheduling/toml_table.h"
#include "types/camera.h"

namespace wasp::scheduling {

/// What one step gave. `flow` is set by flow sources only and points into the stepper, valid until its next step.
struct SteppedCue {
  CueBody body;
  const FlowMessage* flow = nullptr;
};
/// Steps a behaviour with a state of its own. One thread at a time.
using Stepper = std::function<SteppedCue(const BehaviourInput&)>;

/// A row of the list of behaviours; made by behaviour_row. Geometry is that of the camera the stream comes from
/// (`looks_down(stream)`). Parameters are [behaviour.NAME.params]; both factories throw ConfigError for a key or value
/// that the behaviour does not take.
struct BehaviourRow {
  std::string name;
  Stream stream = Stream::kGray;
  std::optional<Stream> publishes;  ///< the flow fields it makes for others
  DurationNs budget_ns = 0;         ///< its own word; the configuration's holds in flight
  /// Builds the adaptor (before arming); the result is its thread's body.
  std::function<std::function<void(LoopControl&)>(const CameraGeometry&, TomlTable params, const BehaviourWiring&)>
      make;
  /// The same step function without thread or ring.
  std::function<Stepper(const CameraGeometry&, TomlTable params)> make_stepper;
};
using BehaviourTable = std::vector<BehaviourRow>;

/// Parameters of a behaviour from its defaults, its camera and its table. Throws ConfigError.
template <Behaviour B>
typename B::Params read_params(const CameraGeometry& camera, TomlTable table) {
  typename B::Params params;
  params.camera = camera;
  B::visit_params(params,
                  [&](const char* key, auto& field, double low, double high) { table.number(key, field, low, high); });
  table.finish();
  return params;
}

template <Behaviour B>
Stepper make_stepper(const CameraGeometry& camera, TomlTable table) {
  const auto params = read_params<B>(camera, std::move(table));
  const auto state = std::make_shared<typename B::State>(make_state<B>(params));
  return [params, state](const BehaviourInput& input) {
    SteppedCue cue{B::step(params, input, *state)};
    if constexpr (FlowSource<B>) cue.flow = B::flow(*state);
    return cue;
  };
}

template <Behaviour B>
BehaviourRow behaviour_row() {
  BehaviourRow row;
  row.name = B::kName;
  row.stream = B::kStream;
  if constexpr (FlowSource<B>) row.publishes = B::kPublishes;
  row.budget_ns = B::kBudgetNs;
  row.make = [](const CameraGeometry& camera, TomlTable table, const BehaviourWiring& wiring) {
    auto loop = std::make_shared<BehaviourLoop<B>>(read_params<B>(camera, std::move(table)), wiring);
    return [loop](LoopControl& control) { loop->run(control); };
  };
  row.make_stepper = [](const CameraGeometry& camera, TomlTable table) {
    return make_stepper<B>(camera, std::move(table));
  };
  return row;
}

/// Names in the order of the table, which is that of Cue::behaviour.
std::vector<std::string> names_of(const BehaviourTable& table);

}  // namespace wasp::scheduling
