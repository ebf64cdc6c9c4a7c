// What every behaviour is given and what makes a type a behaviour.
#pragma once

#include <concepts>
#include <cstdint>
#include <string_view>

#include "types/image_view.h"
#include "types/messages.h"

namespace wasp {

/// Which frame ring releases a behaviour.
enum class Stream : std::uint8_t { kGray, kDepth };

/// The world as of one exposure. Views point into the ring and are valid for the duration of one step only.
struct BehaviourInput {
  TimeNs exposed_at_ns = 0;
  std::uint32_t frame_sequence = 0;
  GrayView gray;    ///< set when the behaviour's stream is kGray
  DepthView depth;  ///< set when the behaviour's stream is kDepth
  bool attitude_valid = false;
  AttitudeSample attitude;  ///< newest sample not after the exposure
};

/// Four plain structs, a name, a time budget, one static step. State holds all memory, so that
/// (Params, Input, State) replays to the bit.
template <class B>
concept Behaviour = requires(const typename B::Params& params, const BehaviourInput& input, typename B::State& state) {
  { B::kName } -> std::convertible_to<std::string_view>;
  { B::kBudgetNs } -> std::convertible_to<DurationNs>;
  { B::kStream } -> std::convertible_to<Stream>;
  { B::step(params, input, state) }
  noexcept->std::same_as<CueBody>;
};

}  // namespace wasp
