#include "faults/blame.h"

#include <fmt/format.h>

namespace wasp::faults {

void Blame::late(const std::string& why, double excess_ms, const Stretch& waited) {
  const double late_ms = excess_ms < kNotExplained ? host_late_ms_(waited) : 0;
  const bool explained = late_ms > 0 && excess_ms <= late_ms + 1;
  if (r_.verdict == Verdict::kMiss || (r_.verdict == Verdict::kHostNoise && explained)) return;
  r_.verdict = explained ? Verdict::kHostNoise : Verdict::kMiss;
  r_.why = explained ? fmt::format("{} (the host stood still for {:.1f} ms)", why, late_ms) : why;
}

void Blame::noise(const std::string& why) {
  if (r_.verdict == Verdict::kOk) r_.verdict = Verdict::kHostNoise, r_.why = why;
}

}  // namespace wasp::faults
