// What every behaviour is given and what makes a type a behaviour.
#pragma once

#include <concepts>
#include <cstdint>
#include <string_view>
#include <type_traits>

#include "types/flow_field.h"
#include "types/image_view.h"
#include "types/messages.h"

namespace wasp {

/// Which ring releases a behaviour, and what it is given.
enum class Stream : std::uint8_t {
  kGray,       ///< grey frames of the front camera
  kDepth,      ///< its depth frames
  kGrayDepth,  ///< its grey frames, each with the depth frame of the same exposure where there is one
  kDown,       ///< grey frames of the camera that looks down
  kFlow,       ///< flow fields of the front camera, made by the behaviour `flow_field`
  kFlowDown,   ///< flow fields of the camera that looks down, made by `flow_field_down`
};

/// True for the streams of the camera that looks down.
constexpr bool looks_down(Stream stream) { return stream == Stream::kDown || stream == Stream::kFlowDown; }
/// True for the streams of flow fields.
constexpr bool is_flow(Stream stream) { return stream == Stream::kFlow || stream == Stream::kFlowDown; }

/// The world as of one exposure. Views point into the ring and are valid for the duration of one step only.
struct BehaviourInput {
  TimeNs exposed_at_ns = 0;
  std::uint32_t frame_sequence = 0;
  GrayView gray;                      ///< set when the behaviour's stream is kGray, kGrayDepth or kDown
  DepthView depth;                    ///< set when it is kDepth, and for kGrayDepth unless that frame is missing
  const FlowMessage* flow = nullptr;  ///< set when it is kFlow or kFlowDown
  bool attitude_valid = false;
  AttitudeSample attitude;  ///< at the exposure: the newest sample not after it, turned on by its rates
  bool accel_valid = false;
  std::array<float, 3> accel_body_mps2{};  ///< mean specific force since the previous step's exposure
};

/// Four plain structs, a name, a time budget, one static step. State holds all memory, so that
/// (Params, Input, State) replays to the bit. A State that needs memory of the camera's size takes it in a constructor
/// `explicit State(const Params&)`, before arming.
template <class B>
concept Behaviour = requires(const typename B::Params& params, const BehaviourInput& input, typename B::State& state) {
  { B::kName } -> std::convertible_to<std::string_view>;
  { B::kBudgetNs } -> std::convertible_to<DurationNs>;
  { B::kStream } -> std::convertible_to<Stream>;
  { B::step(params, input, state) }
  noexcept->std::same_as<CueBody>;
};

/// A behaviour that also makes flow fields for others: `flow` gives the field of the last step, nullptr if it made
/// none.
template <class B>
concept FlowSource = Behaviour<B> && requires(const typename B::State& state) {
  { B::kPublishes } -> std::convertible_to<Stream>;
  { B::flow(state) }
  noexcept->std::same_as<const FlowMessage*>;
};

/// The state a behaviour starts with. Realtime-safe: no.
template <Behaviour B>
typename B::State make_state(const typename B::Params& params) {
  if constexpr (std::is_constructible_v<typename B::State, const typename B::Params&>)
    return typename B::State(params);
  else
    return {};
}

}  // namespace wasp
