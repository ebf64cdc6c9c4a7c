#include "messages/source_counts.h"

namespace wasp::mavlink {

std::uint64_t SourceTable::add_good(std::uint8_t system_id, std::uint8_t component_id, std::uint8_t sequence,
                                    std::uint64_t& untracked) WASP_REALTIME {
  SourceCounts* row = find(system_id, component_id);
  const bool first = row == nullptr;
  if (first && used_ == rows_.size()) {
    ++untracked;
    return 0;
  }
  if (first) {
    row = &rows_[used_++];
    row->system_id = system_id;
    row->component_id = component_id;
  }
  const auto step = static_cast<std::uint8_t>(sequence - row->last_sequence);
  const std::uint32_t passed = row->unverified_since_good + 1;
  const std::uint64_t lost = first || step < passed ? 0 : step - passed;  // a repeated number is not a loss
  if (!first && step == 0) ++row->repeated;
  row->last_sequence = sequence;
  row->unverified_since_good = 0;
  row->sequence_lost += lost;
  ++row->good;
  return lost;
}

}  // namespace wasp::mavlink
