#include "missions/measures.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "control/mission.h"
#include "sim/scene_generators.h"
#include "tools/quantiles.h"
#include "vision/edge_altitude.h"
#include "vision/heading_rate.h"
#include "vision/landing.h"

namespace wasp::missions {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kSettle_s = 5;

double north_m(const Truth& t) { return static_cast<double>(t.position_ned_m[0]); }
double height_m(const Truth& t) { return static_cast<double>(t.height_m); }

/// Forward speed over ground along the heading.
double forward_mps(const Truth& t) {
  const double yaw = euler_of(t).yaw_rad;
  return static_cast<double>(t.velocity_ned_mps[0]) * std::cos(yaw) +
         static_cast<double>(t.velocity_ned_mps[1]) * std::sin(yaw);
}

/// Truth of the stretch on mission legs.
std::vector<const Truth*> on_legs(const FlightTrace& trace) {
  std::vector<const Truth*> rows;
  for (const LegSpan& leg : legs_of(trace)) {
    const TimeNs from_ns = trace.commands[leg.first].due_at_ns, to_ns = trace.commands[leg.last].due_at_ns;
    for (const Truth& t : trace.truth)
      if (t.exposed_at_ns >= from_ns && t.exposed_at_ns <= to_ns) rows.push_back(&t);
  }
  return rows;
}

/// Distances along the legs from `skip_s` after lift-off on, at most 20 a second; NaN where none was taken.
struct Nearest {
  double around_m = kNone;
  double over_sum_m = 0;
  int looks = 0, hits = 0;
  [[nodiscard]] double collisions() const { return looks == 0 ? kNone : hits > 0 ? 1 : 0; }
  [[nodiscard]] double mean_over_m() const { return looks == 0 ? kNone : over_sum_m / looks; }
};

Nearest nearest_along(const FlightTrace& trace, const WorldProbe& probe, double skip_s) {
  constexpr double kAloft_m = 0.6;  // lower down the floor is no obstacle
  Nearest out;
  double looked_s = -1;
  for (const Truth* t : on_legs(trace)) {
    const double s = trace.seconds(t->exposed_at_ns);
    if (trace.lift_off_ns == kNever || s < skip_s || s - looked_s < 0.045) continue;
    looked_s = s;
    const auto look = probe.look(*t);
    out.around_m = std::fmin(out.around_m, look.around_m);
    out.over_sum_m += probe.height_over(*t);
    out.hits += (height_m(*t) > kAloft_m ? look.collides_in_flight : look.collides) ? 1 : 0;
    ++out.looks;
  }
  return out;
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.size() < 10) return kNone;
  double sa = 0, sb = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sa += a[i], sb += b[i];
  const double n = static_cast<double>(a.size()), ma = sa / n, mb = sb / n;
  double aa = 0, bb = 0, ab = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    aa += (a[i] - ma) * (a[i] - ma), bb += (b[i] - mb) * (b[i] - mb), ab += (a[i] - ma) * (b[i] - mb);
  }
  return aa > 0 && bb > 0 ? ab / std::sqrt(aa * bb) : kNone;
}

double rms(const std::vector<double>& v) {
  double sum = 0;
  for (const double x : v) sum += x * x;
  return v.empty() ? kNone : std::sqrt(sum / static_cast<double>(v.size()));
}

double mean(const std::vector<double>& v) {
  return v.empty() ? kNone : std::accumulate(v.begin(), v.end(), 0.0) / static_cast<double>(v.size());
}

double greatest(const std::vector<double>& v) { return v.empty() ? kNone : *std::max_element(v.begin(), v.end()); }

int avoids_raised(const FlightTrace& trace) {
  int raised = 0;
  for (std::size_t i = 1; i < trace.commands.size(); ++i)
    raised += trace.commands[i].avoid != 0 && trace.commands[i - 1].avoid == 0 ? 1 : 0;
  return raised;
}

}  // namespace

double flown_to_its_end(const FlightTrace& trace) {
  constexpr double kAloft_m = 0.25, kShare = 0.7;
  const auto legs = on_legs(trace);
  if (trace.commands.empty() || legs.empty()) return 0;
  const auto phase = static_cast<control::MissionPhase>(trace.commands.back().mission_phase);
  const auto aloft = std::count_if(legs.begin(), legs.end(), [](const Truth* t) { return height_m(*t) > kAloft_m; });
  const bool flew = static_cast<double>(aloft) >= kShare * static_cast<double>(legs.size());
  return phase == control::MissionPhase::kDone && flew ? 1 : 0;
}

Measures measure_flight(const FlightTrace& trace, const MissionSetup&, WorldProbe&) {
  return {{"flown to its end", flown_to_its_end(trace)}};
}

Measures measure_hover(const FlightTrace& trace, const MissionSetup& setup, WorldProbe&) {
  std::vector<double> worst_rms, worst;
  for (const LegSpan& leg : legs_of(trace)) {
    const TimeNs from_ns = trace.commands[leg.first].due_at_ns + from_seconds(kSettle_s);
    const TimeNs to_ns = trace.commands[leg.last].due_at_ns;
    const double setpoint_m =
        static_cast<double>(setup.flight.control.mission.legs[static_cast<std::size_t>(leg.leg)].height_m);
    std::vector<double> errors;
    for (const Truth& t : trace.truth)
      if (t.exposed_at_ns >= from_ns && t.exposed_at_ns <= to_ns) errors.push_back(height_m(t) - setpoint_m);
    if (errors.empty()) continue;
    worst_rms.push_back(rms(errors));
    for (const double e : errors) worst.push_back(std::fabs(e));
  }
  return {{"flown to its end", flown_to_its_end(trace)},
          {"RMS height error", greatest(worst_rms)},
          {"greatest excursion", greatest(worst)}};
}

YawRates yaw_rates(const FlightTrace& trace, const std::string& behaviour) {
  YawRates out;
  const auto& cues = trace.of(behaviour);
  std::size_t i = 0;
  for (std::size_t k = 1; k < cues.size(); ++k) {
    const Cue& c = cues[k];
    const TimeNs from_ns = cues[k - 1].exposed_at_ns;
    double sum = 0;
    int n = 0;
    while (i < trace.imu.size() && trace.imu[i].exposed_at_ns <= from_ns) ++i;
    for (std::size_t j = i; j < trace.imu.size() && trace.imu[j].exposed_at_ns <= c.exposed_at_ns; ++j, ++n)
      sum += static_cast<double>(trace.imu[j].gyro_body_radps[2]);
    if (c.body.validity != Validity::kValid || n == 0 || c.exposed_at_ns - from_ns > 100 * kMillisecond) continue;
    const double t = trace.seconds(c.exposed_at_ns);
    out.visual.add(t, static_cast<double>(c.body.detail[vision::HeadingDetail::kYawRate_radps]));
    out.gyro.add(t, sum / n);
  }
  return out;
}

Measures measure_yaw(const FlightTrace& trace, const MissionSetup&, WorldProbe&) {
  const YawRates rates = yaw_rates(trace, "heading_rate");
  std::vector<double> difference;
  for (std::size_t i = 0; i < rates.gyro.size(); ++i) difference.push_back(rates.visual.y[i] - rates.gyro.y[i]);
  const auto& cues = trace.of("heading_rate");
  Measures m{{"flown to its end", flown_to_its_end(trace)},
             {"yaw rate correlation", correlation(rates.visual.y, rates.gyro.y)},
             {"yaw rate RMS error", rms(difference)},
             {"share of frames with a yaw rate",
              cues.empty() ? kNone : static_cast<double>(rates.gyro.size()) / static_cast<double>(cues.size())}};
  const YawRates printed = yaw_rates(trace, "heading_log_polar");
  if (printed.gyro.size() > 0)
    m.push_back({"correlation by log-polar maps", correlation(printed.visual.y, printed.gyro.y)});
  return m;
}

double frames_to_impact(const Truth& t, const WorldProbe& probe, double rate_hz) {
  const double yaw = euler_of(t).yaw_rad, speed = forward_mps(t);
  Truth ahead = t;
  for (double d = 0; d < 15 && speed > 0; d += 0.02) {
    ahead.position_ned_m[0] = t.position_ned_m[0] + static_cast<float>(d * std::cos(yaw));
    ahead.position_ned_m[1] = t.position_ned_m[1] + static_cast<float>(d * std::sin(yaw));
    if (probe.look(ahead).collides) return d / speed * rate_hz;
  }
  return kNone;
}

Measures measure_wall(const FlightTrace& trace, const MissionSetup& setup, WorldProbe& probe) {
  const auto& legs = setup.flight.control.mission.legs;
  double frames = kNone, speed = kNone;
  int early = 0;
  for (const LegSpan& leg : legs_of(trace)) {
    const double wanted_mps = static_cast<double>(legs[static_cast<std::size_t>(leg.leg)].forward_mps);
    for (std::size_t i = leg.first; i <= leg.last && std::isnan(speed); ++i) {
      if (trace.commands[i].avoid == 0) continue;
      const Truth& t = trace.truth_at(trace.commands[i].due_at_ns);
      if (wanted_mps <= 0 || forward_mps(t) < 0.5 * wanted_mps) {
        ++early;  // before there was anything to avoid
        continue;
      }
      speed = forward_mps(t);
      frames = frames_to_impact(t, probe, setup.sim.camera_rate_hz);
    }
  }
  const Nearest near = nearest_along(trace, probe, 0);
  return {{"flown to its end", flown_to_its_end(trace)},
          {"collisions", near.collisions()},
          {"ticks with avoid before the approach", early},
          {"frames from avoid to impact", frames},
          {"speed at avoid", speed},
          {"closest approach", near.around_m}};
}

Measures measure_corridor(const FlightTrace& trace, const MissionSetup&, WorldProbe& probe) {
  const Nearest near = nearest_along(trace, probe, 1);
  std::vector<double> lateral, speed;
  double way_m = 0;
  for (const Truth* t : on_legs(trace)) {
    const Vec3 at = probe.in_world(*t);
    way_m = std::max(way_m, static_cast<double>(at.x()));
    if (at.x() <= 4) continue;  // what the start was astray is steered away by then
    lateral.push_back(static_cast<double>(at.y()));
    speed.push_back(forward_mps(*t));
  }
  return {{"flown to its end", flown_to_its_end(trace)},
          {"collisions", near.collisions()},
          {"false avoids", avoids_raised(trace)},
          {"least distance", near.around_m},
          {"lateral RMS by width", rms(lateral) / static_cast<double>(sim::kCorridorWidth_m)},
          {"mean speed", mean(speed)},
          {"way flown", way_m}};
}

/// Mean height over a stretch of the flight [s since lift-off].
double mean_height(const FlightTrace& trace, double from_s, double to_s) {
  double sum = 0;
  int n = 0;
  for (const Truth& t : trace.truth) {
    const double s = trace.seconds(t.exposed_at_ns);
    if (s >= from_s && s <= to_s) sum += height_m(t), ++n;
  }
  return n > 0 ? sum / n : kNone;
}

Measures measure_arena(const FlightTrace& trace, const MissionSetup& setup, WorldProbe&) {
  const double at_s = setup.sim.world.arena_step_at_s;
  const sim::ArenaStep step = sim::arena_step_of(setup.sim.seed, at_s);
  const double edge_m = static_cast<double>(step.to_m - step.from_m);
  const double before_m = mean_height(trace, at_s - 2, at_s);
  const double share = (mean_height(trace, at_s + 8, at_s + 11) - before_m) / edge_m;
  double half_s = kNone;
  for (const Truth& t : trace.truth) {
    const double s = trace.seconds(t.exposed_at_ns);
    if (s < at_s || (height_m(t) - before_m) / edge_m < 0.5) continue;
    half_s = s - at_s;
    break;
  }
  return {{"flown to its end", flown_to_its_end(trace)},
          {"height follows the edge", share > 0.7 && share < 1.3 ? 1 : 0},
          {"share of the step followed", share},
          {"time to follow half the step", half_s},
          {"edge step", edge_m},
          {"height before the step", before_m}};
}

Measures measure_city(const FlightTrace& trace, const MissionSetup&, WorldProbe& probe) {
  constexpr double kTakenOff_s = 3;
  const Nearest near = nearest_along(trace, probe, kTakenOff_s);
  std::vector<double> heights;
  double way_m = 0, overshoot_m = 0;
  for (const Truth* t : on_legs(trace)) {
    if (trace.seconds(t->exposed_at_ns) < kTakenOff_s) continue;
    heights.push_back(height_m(*t));
    way_m = std::max(way_m, north_m(*t));
  }
  // Above the greatest setpoint of the last three seconds: what lags behind a falling one is no overshoot.
  const auto& commands = trace.commands;
  for (const LegSpan& leg : legs_of(trace))
    for (std::size_t i = leg.first; i <= leg.last; ++i) {
      if (trace.seconds(commands[i].due_at_ns) < kTakenOff_s) continue;
      double setpoint_m = 0;
      for (std::size_t k = i > 60 ? i - 60 : 0; k <= i; ++k)
        setpoint_m = std::max(setpoint_m, static_cast<double>(commands[k].height_setpoint_m));
      overshoot_m = std::max(overshoot_m, height_m(trace.truth_at(commands[i].due_at_ns)) - setpoint_m);
    }
  return {{"flown to its end", flown_to_its_end(trace)},
          {"collisions", near.collisions()},
          {"least distance to a box", near.around_m},
          {"mean height over obstacles", near.mean_over_m()},
          {"mean height", mean(heights)},
          {"overshoot above the setpoint", heights.empty() ? kNone : overshoot_m},
          {"way flown", way_m}};
}

Measures measure_edge_height(const FlightTrace& trace, const MissionSetup& setup, WorldProbe&) {
  using Detail = vision::EdgeAltitude::Detail;
  std::vector<double> error;
  double lambda = kNone, sigma = kNone;
  for (const Cue& c : trace.of("edge_altitude")) {
    if (c.body.detail[Detail::kEdgesPerMSigma] > 0) {
      lambda = static_cast<double>(c.body.detail[Detail::kEdgesPerM]);
      sigma = static_cast<double>(c.body.detail[Detail::kEdgesPerMSigma]);
    }
    if (c.body.validity != Validity::kValid || c.body.has_height == 0 || !(sigma > 0)) continue;
    const double truth_m = height_m(trace.truth_at(c.exposed_at_ns));
    error.push_back(std::fabs(static_cast<double>(c.body.height_m) - truth_m) / truth_m);
  }
  return {{"flown to its end", flown_to_its_end(trace)},
          {"lambda estimated", lambda},
          {"its sigma", sigma},
          {"lambda of the ground", setup.sim.world.ground_edges_per_m},
          {"height error once lambda is known, median share", error.empty() ? kNone : tools::median(error)}};
}

Measures measure_landing(const FlightTrace& trace, const MissionSetup& setup, WorldProbe&) {
  constexpr double kSettled_s = 4, kLow_m = 0.45;
  const double wanted_radps = static_cast<double>(vision::Landing::Params{}.flow_radps);
  const auto& legs = setup.flight.control.mission.legs;
  std::vector<double> off;
  double end_m = kNone, sink_mps = kNone;
  for (const LegSpan& leg : legs_of(trace)) {
    if (!legs[static_cast<std::size_t>(leg.leg)].behaviours_climb) continue;
    const TimeNs from_ns = trace.commands[leg.first].due_at_ns + from_seconds(kSettled_s);
    for (const Truth& t : trace.truth) {
      if (t.exposed_at_ns < from_ns || t.exposed_at_ns > trace.commands[leg.last].due_at_ns) continue;
      end_m = height_m(t), sink_mps = static_cast<double>(t.velocity_ned_mps[2]);
      if (end_m > kLow_m) off.push_back(forward_mps(t) / end_m / wanted_radps - 1);
    }
  }
  return {{"flown to its end", flown_to_its_end(trace)},
          {"ventral flow off its setpoint, RMS share", off.empty() ? kNone : rms(off)},
          {"height at the end", end_m},
          {"sink rate at the end", sink_mps}};
}

Measures measure_all(const FlightTrace& trace, const MissionSetup& setup, WorldProbe& probe) {
  constexpr std::size_t kSpoke = 10;
  double steps = 0, over = 0, silent = 0;
  bool timed = false;
  for (const auto& row : setup.flight.behaviours) silent += row.enabled && trace.of(row.name).size() < kSpoke ? 1 : 0;
  for (const auto& [name, cues] : trace.cues)
    for (const Cue& c : cues) {
      over += c.over_budget != 0 ? 1 : 0, ++steps;
      timed = timed || c.finished_at_ns != c.started_at_ns;
    }
  Measures m = measure_hover(trace, setup, probe);
  m.push_back({"collisions", nearest_along(trace, probe, 1).collisions()});
  m.push_back({"enabled behaviours that were silent", silent});
  if (timed) m.push_back({"share of steps over budget", over / steps});
  return m;
}

}  // namespace wasp::missions
