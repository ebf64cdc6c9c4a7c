#include "missions/run_figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <stdexcept>

#include "missions/measures.h"
#include "vision/time_to_contact.h"

namespace wasp::missions {
namespace {

using tools::Series;

constexpr std::size_t kSlices = 300, kMostFlights = 100;

/// What a mission's figures are made of: which curves are taken from a trace, and the plots they go into.
struct CurveKind {
  const char* name;
  Series (*take)(const FlightTrace&, const WorldProbe&);
};
struct PlotKind {
  const char* file;
  const char* title;
  const char* x_label;
  const char* y_label;
  std::vector<const char*> curves;
  bool first_flight_only = false;
};
struct FigureSet {
  std::vector<const char*> missions;
  std::vector<CurveKind> curves;
  std::vector<PlotKind> plots;
};

bool in_flight(const FlightTrace& trace, TimeNs at_ns) {
  return trace.lift_off_ns != kNever && at_ns >= trace.lift_off_ns;
}

Series height_over_time(const FlightTrace& trace, const WorldProbe&) {
  Series s;
  for (const Truth& t : trace.truth)
    if (in_flight(trace, t.exposed_at_ns)) s.add(trace.seconds(t.exposed_at_ns), static_cast<double>(t.height_m));
  return s;
}
Series setpoint_over_time(const FlightTrace& trace, const WorldProbe&) {
  Series s;
  for (const Command& c : trace.commands)
    if (in_flight(trace, c.due_at_ns) && c.height_setpoint_m > 0)
      s.add(trace.seconds(c.due_at_ns), static_cast<double>(c.height_setpoint_m));
  return s;
}
Series height_over_way(const FlightTrace& trace, const WorldProbe&) {
  Series s;
  for (const Truth& t : trace.truth)
    if (in_flight(trace, t.exposed_at_ns))
      s.add(static_cast<double>(t.position_ned_m[0]), -static_cast<double>(t.position_ned_m[2]));
  return s;
}
Series setpoint_over_way(const FlightTrace& trace, const WorldProbe&) {
  Series s;
  for (const Command& c : trace.commands)
    if (in_flight(trace, c.due_at_ns) && c.height_setpoint_m > 0)
      s.add(static_cast<double>(trace.truth_at(c.due_at_ns).position_ned_m[0]),
            static_cast<double>(c.height_setpoint_m));
  return s;
}
Series skyline(const FlightTrace& trace, const WorldProbe& probe) {
  Series s;
  for (const Truth& t : trace.truth)
    if (in_flight(trace, t.exposed_at_ns))
      s.add(static_cast<double>(t.position_ned_m[0]), -static_cast<double>(t.position_ned_m[2]) - probe.height_over(t));
  return s;
}
Series path(const FlightTrace& trace, const WorldProbe& probe) {
  Series s;
  for (const Truth& t : trace.truth) {
    const Vec3 at = probe.in_world(t);
    if (in_flight(trace, t.exposed_at_ns)) s.add(static_cast<double>(at.x()), static_cast<double>(at.y()));
  }
  return s;
}
Series visual_yaw(const FlightTrace& trace, const WorldProbe&) { return yaw_rates(trace, "heading_rate").visual; }
Series printed_yaw(const FlightTrace& trace, const WorldProbe&) { return yaw_rates(trace, "heading_log_polar").visual; }
Series gyro_yaw(const FlightTrace& trace, const WorldProbe&) { return yaw_rates(trace, "heading_rate").gyro; }
constexpr double kFarthest_frames = 150, kRate_hz = 30;

/// What was measured over what was true, while the vehicle came near.
Series contact(const FlightTrace& trace, const WorldProbe& probe) {
  Series s;
  for (const Cue& c : trace.of("time_to_contact")) {
    const auto tau = static_cast<double>(c.body.detail[vision::TimeToContactFront::kContact_frames]);
    const Truth& t = trace.truth_at(c.exposed_at_ns);
    const double speed =
        std::hypot(static_cast<double>(t.velocity_ned_mps[0]), static_cast<double>(t.velocity_ned_mps[1]));
    if (c.body.validity != Validity::kValid || speed < 0.4 || tau <= 0 || tau > kFarthest_frames) continue;
    if (const double left = frames_to_impact(t, probe, kRate_hz); left <= kFarthest_frames) s.add(left, tau);
  }
  return s;
}
Series exact_contact(const FlightTrace&, const WorldProbe&) {
  Series s;
  s.add(0, 0);
  s.add(kFarthest_frames, kFarthest_frames);
  return s;
}
Series heading_wish(const FlightTrace& trace, const char* behaviour) {
  Series s;
  for (const Cue& c : trace.of(behaviour))
    if (c.body.validity == Validity::kValid && c.body.has_heading_rate != 0 && in_flight(trace, c.exposed_at_ns))
      s.add(trace.seconds(c.exposed_at_ns), static_cast<double>(c.body.heading_rate_radps));
  return s;
}
Series balance_wish(const FlightTrace& trace, const WorldProbe&) { return heading_wish(trace, "flow_balance"); }
Series obstacle_wish(const FlightTrace& trace, const WorldProbe&) { return heading_wish(trace, "obstacle_depth"); }
Series edge_height_cue(const FlightTrace& trace, const WorldProbe&) {
  Series s;
  for (const Cue& c : trace.of("edge_altitude"))
    if (c.body.has_height != 0 && in_flight(trace, c.exposed_at_ns))
      s.add(trace.seconds(c.exposed_at_ns), static_cast<double>(c.body.height_m));
  return s;
}
Series ground_height_cue(const FlightTrace& trace, const WorldProbe&) {
  Series s;
  for (const Cue& c : trace.of("ground_altitude"))
    if (c.body.has_height != 0 && in_flight(trace, c.exposed_at_ns))
      s.add(trace.seconds(c.exposed_at_ns), static_cast<double>(c.body.height_m));
  return s;
}

const std::vector<FigureSet>& sets() {
  static const std::vector<FigureSet> kSets{
      {{"turntable", "hover-yaw", "aggressive"},
       {{"gyro", &gyro_yaw}, {"visual: similarity fit", &visual_yaw}, {"visual: log-polar maps", &printed_yaw}},
       {{"yaw_rate",
         "Yaw rate, inertial and visual",
         "time [s]",
         "yaw rate [rad/s]",
         {"gyro", "visual: similarity fit", "visual: log-polar maps"}}}},
      {{"wall"},
       {{"measured", &contact}, {"exact", &exact_contact}},
       {{"time_to_contact",
         "Time to contact in each approach, until it brakes",
         "true frames to impact",
         "time to contact [frames]",
         {"measured", "exact"}}}},
      {{"corridor", "corridor-empty", "bee"},
       {{"path", &path}, {"gross (flow balance)", &balance_wish}, {"fine (obstacles)", &obstacle_wish}},
       {{"path", "Ways through the corridor, from above", "along [m]", "across [m]", {"path"}},
        {"heading",
         "Heading wishes of the gross and the fine process",
         "time [s]",
         "yaw rate [rad/s]",
         {"gross (flow balance)", "fine (obstacles)"}}}},
      {{"arena"},
       {{"height", &height_over_time}},
       {{"height", "Height after the edge has moved", "time since lift-off [s]", "height [m]", {"height"}}}},
      {{"city-max", "city-near", "city-defocus"},
       {{"height", &height_over_way}, {"setpoint", &setpoint_over_way}, {"roofs and ground below", &skyline}},
       {{"single",
         "One flight over the boxes below it",
         "along [m]",
         "height [m]",
         {"height", "setpoint", "roofs and ground below"},
         true},
        {"height", "Height along the way, all flights", "along [m]", "height [m]", {"height"}}}},
      {{"hover", "edge-height", "landing", "all"},
       {{"truth", &height_over_time},
        {"setpoint", &setpoint_over_time},
        {"from the ground plane", &ground_height_cue},
        {"from edges", &edge_height_cue}},
       {{"height",
         "Height",
         "time since lift-off [s]",
         "height [m]",
         {"truth", "setpoint", "from the ground plane", "from edges"}}}},
  };
  return kSets;
}

const FigureSet* set_of(const std::string& mission) {
  for (const FigureSet& s : sets())
    for (const char* name : s.missions)
      if (mission == name) return &s;
  return nullptr;
}

}  // namespace

RunFigures::RunFigures(std::string mission) : mission_(std::move(mission)) {}

void RunFigures::add(std::uint32_t seed, const FlightTrace& trace, const WorldProbe& probe) {
  const FigureSet* set = set_of(mission_);
  if (set == nullptr || flights_.size() >= kMostFlights) return;
  Flight flight{seed, {}};
  for (const CurveKind& c : set->curves)
    flight.series.emplace_back(c.name, tools::thin_envelope(c.take(trace, probe), kSlices));
  const auto after = std::upper_bound(flights_.begin(), flights_.end(), seed,
                                      [](std::uint32_t s, const Flight& f) { return s < f.seed; });
  flights_.insert(after, std::move(flight));
}

std::vector<Figure> RunFigures::figures() const {
  std::vector<Figure> out;
  const FigureSet* set = set_of(mission_);
  if (set == nullptr || flights_.empty()) return out;
  for (const PlotKind& kind : set->plots) {
    Figure f{mission_ + "-" + kind.file, kind.title, {}};
    f.plot.title = kind.title, f.plot.x_label = kind.x_label, f.plot.y_label = kind.y_label;
    for (std::size_t c = 0; c < kind.curves.size(); ++c)
      for (std::size_t i = 0; i < (kind.first_flight_only ? 1 : flights_.size()); ++i)
        for (const auto& [name, series] : flights_[i].series) {
          if (name != kind.curves[c] || series.size() == 0) continue;
          f.plot.curves.push_back({i == 0 ? name : std::string(), {fmt::format("c{}", c), "thin"}, series});
        }
    if (!f.plot.curves.empty()) out.push_back(std::move(f));
  }
  return out;
}

void RunFigures::write(const std::filesystem::path& folder) const {
  for (const Figure& f : figures()) {
    const auto file = folder / (f.file + ".svg");
    std::ofstream out(file);
    out << tools::standalone_svg(f.plot.svg());
    if (!out.flush()) throw std::runtime_error("cannot write " + file.string());
  }
}

}  // namespace wasp::missions
