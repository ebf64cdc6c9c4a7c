// Judges what the guest measured against the bars. Pure: plan and outcomes in, results out.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "tools/result.h"
#include "tools/rt_guest/console.h"
#include "tools/rt_guest/plan.h"

namespace wasp::tools::rt_guest {

/// One line of the table: the figures of one flight.
struct Row {
  Job job;
  bool present = false;  ///< the guest handed back figures
  std::int64_t cycles = 0, missed_releases = 0, missed_deadlines = 0, page_faults = 0;
  double release_p999_us = 0, release_max_us = 0, last_byte_max_us = 0;
};

std::vector<Row> read_rows(const Plan& plan, const std::map<std::string, JobOutcome>& outcomes);

/// Every bar of every flight. A flight without figures misses all its bars: nothing counts as met that was not
/// measured.
std::vector<Result> judge(const Plan& plan, const std::map<std::string, JobOutcome>& outcomes);

/// The rows as text.
std::string table(const std::vector<Row>& rows);

}  // namespace wasp::tools::rt_guest
