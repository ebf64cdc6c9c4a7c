// Edges per metre, from a change of height that inertia measures (thesis 8.1.3). Edge statistics see only
// mu = lambda h; while the vehicle rises by Z, mu rises by lambda Z. Z is the vertical acceleration integrated twice,
// which leaves an unknown climb rate at the start and the accelerometer's bias, so over a window of some seconds
//     mu(t) = lambda Z(t) + c0 + c1 t + c2 t^2 / 2,     c1 = lambda w,  c2 = lambda b,
// a linear regression with priors on w and b. What identifies lambda is the part of Z that no such quadratic explains:
// a climb that begins and ends within the window.
#pragma once

#include <array>

#include "types/realtime.h"
#include "types/time.h"

namespace wasp::vision {

struct EdgeDensityParams {
  float window_s = 8.f;             ///< > 0: of samples regressed
  float climb_sigma_mps = 0.3f;     ///< prior of w: climb rate at the window's start; 0.05 if it always starts at hover
  float bias_sigma_mps2 = 0.05f;    ///< prior of b: accelerometer bias, and what a wrong attitude leaves of gravity
  float correlation_s = 0.5f;       ///< errors of mu this near in time count as one
  float min_excitation_m = 0.3f;    ///< range of Z that the quadratic does not explain, below which nothing is said
  float max_sigma_share = 0.15f;    ///< of lambda: a less certain result is dropped
  float drift_share_sqrts = 0.01f;  ///< lambda wanders from place to place: sigma grows by this share per root second
};

/// An estimate and how far it is to be trusted, one standard deviation; `sigma` is 0 before the first.
struct EdgeDensity {
  float edges_per_m = 0, sigma = 0;
  int accepted = 0;  ///< windows that went into it
};

struct EdgeDensityState {
  static constexpr int kSamples = 128;
  struct Sample {
    TimeNs at_ns = 0;
    double mu = 0;
    double speed = 0, way = 0;  ///< integrals of the upward acceleration since the start [m/s, m]
  };
  EdgeDensity density;
  std::array<Sample, kSamples> ring{};
  int next = 0, count = 0;
  TimeNs last_at_ns = kNever, refined_at_ns = kNever;
  double speed_mps = 0, way_m = 0;
};

/// What one window says.
struct EdgeDensityFit {
  bool valid = false;
  double edges_per_m = 0, sigma = 0;
  double excitation_m = 0;
};

/// Regression over the samples in the ring. Trip counts are bounded. Realtime-safe: yes.
EdgeDensityFit fit_edge_density(const EdgeDensityParams& params, const EdgeDensityState& state,
                                double start_edges_per_m) WASP_REALTIME;

/// Takes mu (<= 0 or not finite: none in this frame) and the mean upward acceleration since the last call (gravity
/// removed) [m/s^2], and refines `state.density` when a window allows it: then that window's samples are dropped, so
/// that no sample counts twice. A call not after the last, more than half a second after it, or without acceleration
/// starts a new window. `start_edges_per_m` is what is assumed before the first estimate. Realtime-safe: yes.
void observe_edge_density(const EdgeDensityParams& params, TimeNs at_ns, double mu, bool accel_valid,
                          double up_accel_mps2, float start_edges_per_m, EdgeDensityState& state) WASP_REALTIME;

}  // namespace wasp::vision
