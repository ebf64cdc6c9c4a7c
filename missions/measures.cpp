#include "missions/measures.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "control/mission.h"
#include "sim/scene_generators.h"
#include "tools/quantiles.h"
#include "vision/edge_altitude.h"
#include "vision/heading_rate.h"

namespace wasp::missions {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kSettle_s = 5;

double north_m(const Truth& t) { return static_cast<double>(t.position_ned_m[0]); }
double east_m(const Truth& t) { return static_cast<double>(t.position_ned_m[1]); }
double height_m(const Truth& t) { return static_cast<double>(t.height_m); }

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

/// Distances along the flight from lift-off + `skip_s` to the end of the legs, at most 20 a second.
struct Nearest {
  double around_m = kNone;
  double over_sum_m = 0;
  int looks = 0;
  TimeNs first_hit_ns = kNever;
};

Nearest nearest_along(const FlightTrace& trace, WorldProbe& probe, double skip_s) {
  Nearest out;
  double looked_s = -1;
  for (const Truth* t : on_legs(trace)) {
    const double s = trace.seconds(t->exposed_at_ns);
    if (s < skip_s || s - looked_s < 0.045) continue;
    looked_s = s;
    const auto look = probe.look(*t, s);
    out.around_m = std::fmin(out.around_m, look.around_m);
    out.over_sum_m += probe.height_over(*t);
    ++out.looks;
    const bool aloft = height_m(*t) > 0.6;
    if ((aloft ? look.collides_in_flight : look.collides) && out.first_hit_ns == kNever) out.first_hit_ns = t->exposed_at_ns;
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

int avoids_raised(const FlightTrace& trace) {
  int raised = 0;
  for (std::size_t i = 1; i < trace.commands.size(); ++i)
    raised += trace.commands[i].avoid != 0 && trace.commands[i - 1].avoid == 0 ? 1 : 0;
  return raised;
}

}  // namespace

double flown_to_its_end(const FlightTrace& trace) {
  if (trace.commands.empty()) return 0;
  const auto phase = static_cast<control::MissionPhase>(trace.commands.back().mission_phase);
  return phase == control::MissionPhase::kDone ? 1 : 0;
}

Measures measure_hover(const FlightTrace& trace, const MissionSetup& setup, WorldProbe&) {
  std::vector<double> worst_rms{0}, worst{0};
  for (const LegSpan& leg : legs_of(trace)) {
    const TimeNs from_ns = trace.commands[leg.first].due_at_ns + from_seconds(kSettle_s);
    const TimeNs to_ns = trace.commands[leg.last].due_at_ns;
    const double setpoint_m = static_cast<double>(setup.flight.control.mission.legs[static_cast<std::size_t>(leg.leg)].height_m);
    std::vector<double> errors;
    for (const Truth& t : trace.truth)
      if (t.exposed_at_ns >= from_ns && t.exposed_at_ns <= to_ns) errors.push_back(height_m(t) - setpoint_m);
    if (errors.empty()) continue;
    worst_rms.push_back(rms(errors));
    for (const double e : errors) worst.push_back(std::fabs(e));
  }
  return {{"flown to its end", flown_to_its_end(trace)},
          {"RMS height error", *std::max_element(worst_rms.begin(), worst_rms.end())},
          {"greatest excursion", *std::max_element(worst.begin(), worst.end())}};
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

Measures measure_wall(const FlightTrace& trace, const MissionSetup& setup, WorldProbe& probe) {
  double frames = kNone, speed = kNone;
  for (const Cue& c : trace.of("time_to_contact")) {
    if (c.body.avoid == 0) continue;
    const Truth& t = trace.truth_at(c.exposed_at_ns);
    const double yaw = euler_of(t).yaw_rad;
    speed = static_cast<double>(t.velocity_ned_mps[0]) * std::cos(yaw) + static_cast<double>(t.velocity_ned_mps[1]) * std::sin(yaw);
    // The way left is read from the trace itself: fly on at this speed until the probe touches something.
    Truth ahead = t;
    for (double d = 0; d < 15; d += 0.02) {
      ahead.position_ned_m[0] = t.position_ned_m[0] + static_cast<float>(d * std::cos(yaw));
      ahead.position_ned_m[1] = t.position_ned_m[1] + static_cast<float>(d * std::sin(yaw));
      if (!probe.look(ahead, trace.seconds(t.exposed_at_ns)).collides) continue;
      frames = d / std::max(speed, 0.05) * setup.sim.camera_rate_hz;
      break;
    }
    break;
  }
  const Nearest near = nearest_along(trace, probe, 0);
  return {{"collisions", near.first_hit_ns != kNever ? 1 : 0},
          {"frames from avoid to impact", frames},
          {"speed at avoid", speed},
          {"closest approach", near.around_m}};
}

Measures measure_corridor(const FlightTrace& trace, const MissionSetup&, WorldProbe& probe) {
  const Nearest near = nearest_along(trace, probe, 1);
  std::vector<double> lateral;
  double way_m = 0;
  for (const Truth* t : on_legs(trace)) {
    way_m = std::max(way_m, north_m(*t));
    if (north_m(*t) > 4) lateral.push_back(east_m(*t));
  }
  return {{"collisions", near.first_hit_ns != kNever ? 1 : 0},
          {"false avoids", avoids_raised(trace)},
          {"least distance", near.around_m},
          {"lateral RMS by width", rms(lateral) / static_cast<double>(sim::kCorridorWidth_m)},
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
  return {{"height follows the edge", share > 0.7 && share < 1.3 ? 1 : 0},
          {"share of the step followed", share},
          {"time to follow half the step", half_s},
          {"edge step", edge_m},
          {"height before the step", before_m}};
}

Measures measure_city(const FlightTrace& trace, const MissionSetup&, WorldProbe& probe) {
  const Nearest near = nearest_along(trace, probe, 3);
  double height_sum = 0, overshoot = 0, way_m = 0;
  int n = 0;
  for (const Truth* t : on_legs(trace)) {
    if (trace.seconds(t->exposed_at_ns) < 3) continue;
    height_sum += -static_cast<double>(t->position_ned_m[2]);
    way_m = std::max(way_m, north_m(*t));
    ++n;
  }
  for (const Command& c : trace.commands)
    if (c.height_setpoint_m > 0 && trace.seconds(c.due_at_ns) > 3 && c.mission_phase < 20)
      overshoot = std::max(overshoot, height_m(trace.truth_at(c.due_at_ns)) - static_cast<double>(c.height_setpoint_m));
  return {{"collisions", near.first_hit_ns != kNever ? 1 : 0},
          {"least distance to a box", near.around_m},
          {"mean height over obstacles", near.looks > 0 ? near.over_sum_m / near.looks : kNone},
          {"mean height", n > 0 ? height_sum / n : kNone},
          {"overshoot above the setpoint", overshoot},
          {"way flown", way_m}};
}

Measures measure_edge_height(const FlightTrace& trace, const MissionSetup& setup, WorldProbe&) {
  using Detail = vision::EdgeAltitude::Detail;
  std::vector<double> error;
  double lambda = kNone, sigma = kNone;
  int estimates = 0;
  for (const Cue& c : trace.of("edge_altitude")) {
    const auto now = static_cast<double>(c.body.detail[Detail::kEdgesPerMSigma]);
    if (now > 0) {
      estimates += now != sigma ? 1 : 0;
      lambda = static_cast<double>(c.body.detail[Detail::kEdgesPerM]), sigma = now;
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

Measures measure_landing(const FlightTrace& trace, const MissionSetup&, WorldProbe&) {
  std::vector<double> flow;
  double end_m = kNone, sink = kNone;
  for (const Cue& c : trace.of("landing")) {
    if (c.body.validity != Validity::kValid) continue;
    const Truth& t = trace.truth_at(c.exposed_at_ns);
    const double speed = std::hypot(static_cast<double>(t.velocity_ned_mps[0]), static_cast<double>(t.velocity_ned_mps[1]));
    flow.push_back(speed / std::max(0.05, -static_cast<double>(t.position_ned_m[2])));
  }
  for (const Truth* t : on_legs(trace)) end_m = height_m(*t), sink = static_cast<double>(t->velocity_ned_mps[2]);
  const double middle = tools::median(flow);
  std::vector<double> off;
  for (std::size_t i = flow.size() / 4; i < flow.size(); ++i) off.push_back(flow[i] / middle - 1);
  return {{"ventral flow held, mean error", rms(off)}, {"ventral flow", middle}, {"height at the end", end_m}, {"sink rate at the end", sink}};
}

Measures measure_all(const FlightTrace& trace, const MissionSetup&, WorldProbe& probe) {
  double ran = 0, steps = 0, over = 0;
  for (const auto& [name, cues] : trace.cues) {
    ran += cues.size() > 10 ? 1 : 0;
    for (const Cue& c : cues) over += c.over_budget != 0 ? 1 : 0, ++steps;
  }
  return {{"flown to its end", flown_to_its_end(trace)},
          {"collisions", nearest_along(trace, probe, 1).first_hit_ns != kNever ? 1 : 0},
          {"behaviours that ran", ran},
          {"share of steps over budget", steps > 0 ? over / steps : kNone}};
}

}  // namespace wasp::missions
