// Response-time analysis of fixed-priority preemptive threads, each bound to one core: the smallest solution of
//   w_i = C_i + B_i + sum over j that may delay i of ceil((w_i + J_j) / T_j) C_j,   R_i = J_i + w_i,
// found by iteration from below (Joseph and Pandya 1986; with jitter and blocking: Audsley et al. 1993). Threads of
// equal priority are served first come first served; each is counted as if it went first, which bounds every order.
#pragma once

#include <string>
#include <vector>

#include "types/time.h"

namespace wasp::scheduling {

/// One thread of the table. `deadline_ns` <= `period_ns` (else the deadline is taken as the period).
struct AnalysedThread {
  std::string name;
  int core = 0;  ///< -1: any; it then counts on every core, and every core's threads delay it
  int priority = 1;
  DurationNs period_ns = 0;    ///< least time between two releases
  DurationNs deadline_ns = 0;  ///< from the intended release
  DurationNs cost_ns = 0;      ///< C: longest execution of one release
  DurationNs jitter_ns = 0;    ///< J: longest delay of the release itself
  DurationNs blocking_ns = 0;  ///< B: longest time something of lower priority may hold the core
};

/// What the analysis says of one thread.
struct ResponseTime {
  DurationNs response_ns = 0;  ///< R; when not bounded, how far the iteration had come
  bool bounded = true;         ///< false: it grew beyond the deadline
  bool meets_deadline = true;
  std::vector<std::size_t> delayed_by;  ///< indices of the threads that may delay it
  std::vector<DurationNs> delay_ns;     ///< by each of them within R
};

/// Row i of the result belongs to threads[i]. Realtime-safe: no.
std::vector<ResponseTime> response_times(const std::vector<AnalysedThread>& threads);

/// Share of `core` that the threads need, 1 is all of it; threads of core -1 count fully.
double utilisation(const std::vector<AnalysedThread>& threads, int core);

}  // namespace wasp::scheduling
