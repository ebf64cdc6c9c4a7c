// What each mission must show: figures taken from one flight's trace, and the bars they are held against, over one
// flight or a hundred. The same judge judges lockstep and the real process.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "missions/flight_trace.h"
#include "missions/mission_setup.h"
#include "missions/world_probe.h"
#include "tools/result.h"

namespace wasp::missions {

/// Figures of one flight by name; NaN: the flight does not tell.
using Measures = std::vector<std::pair<std::string, double>>;

/// How the figures of many flights become one.
enum class Over { kWorstHigh, kWorstLow, kMean, kMedian, kSum };

struct Bar {
  const char* measure;
  Over over;
  const char* unit;
  bool at_most;          ///< else at least
  double bound;          ///< NaN: no bar, only reported
  bool if_told = false;  ///< left out where no flight tells it (what lockstep cannot measure)
};

struct Judge {
  const char* mission;
  Measures (*measure)(const FlightTrace&, const MissionSetup&, WorldProbe&);
  std::vector<Bar> bars;
};

/// The judge of a mission; one that has no row of its own must be flown to its end.
const Judge& judge_of(const std::string& mission);

/// Holds the figures of `runs` flights against the bars. A figure that is NaN in any run misses its bar; no runs miss
/// all.
std::vector<tools::Result> verdict(const Judge& judge, const std::vector<Measures>& runs);

/// NaN when there is no such figure.
double value_of(const Measures& measures, const std::string& name);

}  // namespace wasp::missions
