// Refused: must not call non-'nonblocking' function 'wasp::Forgotten::step'
#include "scheduling/behaviour_loop.h"

namespace wasp {

/// A behaviour whose step nobody marked cannot be flown: the adaptor's loop is marked.
struct Forgotten {
  static constexpr std::string_view kName = "forgotten";
  static constexpr DurationNs kBudgetNs = kMillisecond;
  static constexpr Stream kStream = Stream::kGray;
  struct Params {};
  struct State {};
  static CueBody step(const Params& params, const BehaviourInput& input, State& state) noexcept;
};

template class scheduling::BehaviourLoop<Forgotten>;

}  // namespace wasp
