// One flight that faults share: each is done, answered and recovered from before the next; what none recovers from ends
// it. Judged when it is over, from the wire.
#pragma once

#include <deque>
#include <functional>
#include <vector>

#include "faults/blame.h"
#include "faults/campaign.h"
#include "faults/flight_under_test.h"

namespace wasp::faults {

class SharedFlight {
 public:
  SharedFlight(const CampaignOptions& options, const FlightPlan& plan, const CampaignHooks& hooks);

  /// Takes cells from the front of `queue` as long as the flight is fit for them, at least one; returns what came of
  /// them. `before` of `total` cells were tried in other flights: for the progress.
  std::vector<CellResult> fly(std::deque<Cell>& queue, std::size_t before, std::size_t total);

 private:
  struct Done {
    Cell cell;
    Trial trial = {};
    std::string error = {};  ///< it could not be done
    std::string outcome = {};
    bool crashed = false, interrupted = false;
    FlightCounts counts = {};
  };
  bool sleep_until(TimeNs until_ns);
  Done try_cell(const Cell& cell);
  void wait_for_answer(const Cell& cell);
  [[nodiscard]] std::string outcome();
  std::vector<CellResult> judge();
  Reaction reaction_of(const Done& done, const std::vector<LogLine>& log);
  [[nodiscard]] std::vector<Violation> violations_of(const Done& done, const std::vector<Violation>& all) const;
  void judge_breach(const Done& done, const CellResult& result, Blame& blame);
  void judge_outcome(const Done& done, const CellResult& result, Blame& blame);
  void judge_words(const Done& done, const std::vector<LogLine>& log, CellResult& result, Blame& blame);
  CellResult judge(const Done& done, const WireLimits& limits, const std::vector<Violation>& violations,
                   const std::vector<tools::Wakeup>& reference);
  [[nodiscard]] WireEvidence evidence() const;

  const CampaignOptions& options_;
  FlightPlan plan_;
  const CampaignHooks& hooks_;
  FlightUnderTest flight_;
  std::vector<Done> done_;
  RecorderAccount account_;  ///< of the recorder, when it is over
};

}  // namespace wasp::faults
