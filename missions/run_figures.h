// Figures of a mission's flights, drawn the way the thesis draws them: many flights in one plot.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "missions/flight_trace.h"
#include "missions/world_probe.h"
#include "tools/report_plot.h"

namespace wasp::missions {

struct Figure {
  std::string file;  ///< stem of its SVG
  std::string title;
  tools::Plot plot;
};

/// Collects flights (thinned) and draws them, in the order of their seeds.
class RunFigures {
 public:
  explicit RunFigures(std::string mission);
  void add(std::uint32_t seed, const FlightTrace& trace, const WorldProbe& probe);
  [[nodiscard]] std::vector<Figure> figures() const;
  /// Writes each figure as FOLDER/STEM.svg. Throws naming the file.
  void write(const std::filesystem::path& folder) const;

 private:
  struct Flight {
    std::uint32_t seed = 0;
    std::vector<std::pair<std::string, tools::Series>> series;
  };
  std::string mission_;
  std::vector<Flight> flights_;
};

}  // namespace wasp::missions
