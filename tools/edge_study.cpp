// Worlds, images, fits, statistics. Rows are drawn at four times the resolution and averaged: far strips are thinner
// than a pixel.
#include "tools/edge_study.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <memory>
#include <numbers>
#include <stdexcept>

#include "sim/imu_model.h"
#include "sim/random.h"
#include "sim/renderer.h"
#include "sim/sensor_model.h"
#include "vision/edge_altitude.h"
#include "vision/kernels/camera_model.h"

namespace wasp::tools {
namespace {

constexpr int kFiner = 4;                                         // rows drawn for one of the image
constexpr double kFrom_m = -20, kTo_m = 500, kHalfWidth_m = 900;  // the strips' extent
constexpr double kLaneGrowth = 0.06;  // lanes far to the side are wider, for they are seen from farther away
constexpr double kFrame_s = 0.1, kImu_s = 0.005;
constexpr double kHover_s = 3;  // before and after the climb

double focal_px(const EdgeStudyOptions& o, double fov_deg) {
  return 0.5 * o.width_px / std::tan(fov_deg * std::numbers::pi / 360);
}

Intrinsics intrinsics_of(const EdgeStudyOptions& o, double fov_deg, int finer) {
  Intrinsics k;
  k.width_px = o.columns_px;
  k.height_px = o.height_px * finer;
  k.fx_px = static_cast<float>(focal_px(o, fov_deg) * o.columns_px / o.width_px);
  k.fy_px = static_cast<float>(focal_px(o, fov_deg) * finer);
  k.cx_px = 0.5f * static_cast<float>(k.width_px - 1);
  k.cy_px = 0.5f * static_cast<float>(k.height_px - 1);
  return k;
}

/// A level camera over one world.
class Eye {
 public:
  Eye(const EdgeStudyOptions& o, double fov_deg, int seed)
      : renderer_(poisson_strips(static_cast<std::uint32_t>(seed), o.edges_per_m, o.lane_m),
                  intrinsics_of(o, fov_deg, kFiner)),
        sensor_({}, o.columns_px, static_cast<float>(focal_px(o, fov_deg)), static_cast<std::uint32_t>(seed)),
        width_(o.columns_px),
        height_(o.height_px),
        pixels_(static_cast<std::size_t>(width_ * height_)) {}

  GrayView look(double north_m, double height_m) {
    const sim::CameraPose pose{Vec3(static_cast<float>(north_m), 0, static_cast<float>(-height_m)),
                               R_body_cam_from_pitch_down(Radians{0.0})};
    const auto width = static_cast<std::size_t>(width_);
    std::vector<float> luminance(width * kFiner), depth(luminance.size()), row(width);
    for (int v = 0; v < height_; ++v) {
      renderer_.render_band(pose, v * kFiner, luminance.data(), depth.data());
      for (std::size_t u = 0; u < width; ++u) {
        float sum = 0;
        for (std::size_t i = 0; i < kFiner; ++i) sum += luminance[i * width + u];
        row[u] = sum / kFiner;
      }
      sensor_.gray_row(frame_, v, row.data(), pixels_.data() + static_cast<std::ptrdiff_t>(v) * width_);
    }
    ++frame_;
    return {pixels_.data(), width_, height_, width_};
  }

 private:
  static_assert(kFiner == sim::Renderer::kBandRows);
  sim::Renderer renderer_;
  sim::SensorModel sensor_;
  int width_, height_;
  std::uint32_t frame_ = 0;
  std::vector<std::uint8_t> pixels_;
};

vision::EdgeHeightParams height_params(const EdgeStudyOptions& o) {
  vision::EdgeHeightParams p;
  p.edges_per_m = static_cast<float>(o.edges_per_m);
  p.resolution_px = static_cast<float>(o.resolution_px);
  p.max_height_m = 100.f;
  p.min_edges = o.columns_px / 2;
  return p;
}

struct Look {
  EdgeSample sample;
  std::vector<double> cdf;  ///< by row below the horizon
};

Look judge(const EdgeStudyOptions& o, double fov_deg, double height_m, int seed, const GrayView& image) {
  auto rows = std::make_unique<vision::EdgeRows>();
  vision::count_edge_rows({}, image, {}, *rows);
  const Intrinsics k = intrinsics_of(o, fov_deg, 1);
  const auto e = vision::estimate_edge_height(height_params(o), k, Vec3(0, -1, 0), *rows);
  Look out;
  out.sample = {
      fov_deg, height_m, seed, e.valid, static_cast<double>(e.edges_per_height), 0, static_cast<double>(e.misfit)};
  double sum = 0;
  const int horizon = o.height_px / 2;
  for (int v = horizon; v < o.height_px - 1; ++v) out.cdf.push_back(sum += rows->count[static_cast<std::size_t>(v)]);
  for (double& c : out.cdf) c = sum > 0 ? c / sum : 0;
  const auto first = rows->count.begin() + e.first_row_px, end = rows->count.begin() + o.height_px;
  if (first < end)
    out.sample.peak_row_px = static_cast<double>(std::max_element(first, end) - rows->count.begin() - horizon);
  return out;
}

struct Moments {
  double mean = 0, std = 0;
};

Moments moments(const std::vector<double>& x) {
  Moments m;
  for (const double v : x) m.mean += v / static_cast<double>(x.size());
  for (const double v : x) m.std += (v - m.mean) * (v - m.mean) / static_cast<double>(x.size());
  m.std = std::sqrt(m.std);
  return m;
}

/// Least squares of mu / (lambda h) - 1.
EdgeFit fit_of(const EdgeStudy& study, double fov_deg) {
  double sum = 0, squares = 0, count = 0;
  for (const EdgeSample& s : study.samples) {
    if (s.fov_deg != fov_deg || !s.valid) continue;
    const double ratio = s.edges_per_height / s.height_m;
    sum += ratio, squares += ratio * ratio, count += 1;
  }
  if (!(sum > 0)) return {fov_deg, 0, 0};
  return {fov_deg, squares / sum, std::sqrt(std::max(0.0, 1 - sum * sum / (squares * count)))};
}

EdgeError error_of(const EdgeStudy& study, double fov_deg, double fitted_per_m, double height_m) {
  EdgeError e{.fov_deg = fov_deg, .height_m = height_m};
  std::vector<double> estimates, rows;
  double squares = 0, fitted_squares = 0;
  for (const EdgeSample& s : study.samples) {
    if (s.fov_deg != fov_deg || s.height_m != height_m) continue;
    ++e.images;
    rows.push_back(s.peak_row_px);
    if (!s.valid) continue;
    ++e.valid;
    estimates.push_back(s.edges_per_height / study.options.edges_per_m);
    squares += std::pow(estimates.back() / height_m - 1, 2);
    fitted_squares += std::pow(s.edges_per_height / (fitted_per_m * height_m) - 1, 2);
  }
  const Moments estimate = moments(estimates), row = moments(rows);
  e.mean_m = estimate.mean, e.std_m = estimate.std;
  if (e.valid > 0) e.rms_share = std::sqrt(squares / e.valid), e.rms_fitted_share = std::sqrt(fitted_squares / e.valid);
  e.mean_row_px = row.mean, e.std_row_px = row.std;
  return e;
}

EdgeDistribution distribution_of(const EdgeStudyOptions& o, double fov_deg, double height_m,
                                 const std::vector<double>& measured) {
  EdgeDistribution d;
  d.fov_deg = fov_deg, d.height_m = height_m, d.measured_cdf = measured;
  d.model_pdf = edge_row_density(o.edges_per_m, height_m, focal_px(o, fov_deg), o.resolution_px,
                                 static_cast<int>(measured.size()));
  double sum = 0;
  for (std::size_t i = 0; i < measured.size(); ++i) {
    d.row_px.push_back(static_cast<double>(i) + 1);
    d.model_cdf.push_back(sum += d.model_pdf[i]);
  }
  return d;
}

bool shown(const EdgeStudyOptions& o, double height_m) {
  return std::find(o.shown_heights_m.begin(), o.shown_heights_m.end(), height_m) != o.shown_heights_m.end();
}

/// Height and upward acceleration of the climb at t.
struct Climb {
  const EdgeStudyOptions& o;

  [[nodiscard]] double height_m(double t) const {
    const double s = std::clamp((t - kHover_s) / o.climb_takes_s, 0.0, 1.0);
    return o.climb_from_m + o.climb_m * s * s * s * (10 + s * (6 * s - 15));
  }
  [[nodiscard]] double up_mps2(double t) const {
    const double s = std::clamp((t - kHover_s) / o.climb_takes_s, 0.0, 1.0);
    return o.climb_m * 60 * s * (1 + s * (2 * s - 3)) / (o.climb_takes_s * o.climb_takes_s);
  }
  [[nodiscard]] double end_s() const { return 2 * kHover_s + o.climb_takes_s; }
};

/// Mean of the accelerometer over a frame.
std::array<float, 3> measured_force(sim::ImuModel& imu, const Climb& climb, double until_s) {
  constexpr int kSamples = static_cast<int>(kFrame_s / kImu_s + 0.5);
  std::array<float, 3> mean{};
  for (int i = 0; i < kSamples; ++i) {
    sim::VehicleState state;
    state.specific_force_body_mps2.z() -= climb.up_mps2(until_s - (kSamples - i - 0.5) * kImu_s);
    const ImuSample sample = imu.sample(state, kImu_s, 0);
    for (std::size_t k = 0; k < 3; ++k) mean[k] += sample.accel_body_mps2[k] / kSamples;
  }
  return mean;
}

vision::EdgeAltitude::Params behaviour_params(const EdgeStudyOptions& o, double fov_deg, double edges_per_m,
                                              bool estimate) {
  vision::EdgeAltitude::Params p;
  p.camera.intrinsics = intrinsics_of(o, fov_deg, 1);
  p.height = height_params(o);
  p.height.edges_per_m = static_cast<float>(edges_per_m);
  p.max_misfit = 1.f;  // few edges at lambda = 0.35: what is studied is the estimate, not when to refuse
  p.estimate_lambda = estimate ? 1 : 0;
  p.density.window_s = static_cast<float>(o.climb_window_s);
  return p;
}

EdgeClimb fly_climb(const EdgeStudyOptions& o, double fov_deg, int seed) {
  using vision::EdgeAltitude;
  const Climb climb{o};
  EdgeClimb out{.fov_deg = fov_deg, .seed = seed, .guess_per_m = o.edges_per_m * (seed % 2 == 0 ? 1.5 : 1 / 1.5)};
  Eye eye(o, fov_deg, seed);
  sim::ImuModel imu({}, static_cast<std::uint32_t>(seed));
  const std::array params{behaviour_params(o, fov_deg, o.edges_per_m, false),
                          behaviour_params(o, fov_deg, out.guess_per_m, true),
                          behaviour_params(o, fov_deg, out.guess_per_m, false)};
  std::array<EdgeAltitude::State, 3> states;
  std::array<double, 3> squares{};
  std::array<int, 3> count{};
  for (int i = 0; i * kFrame_s < climb.end_s(); ++i) {
    const double t = i * kFrame_s;
    BehaviourInput input;
    input.exposed_at_ns = from_seconds(t);
    input.gray = eye.look(o.climb_speed_mps * t, climb.height_m(t));
    input.attitude_valid = input.accel_valid = true;
    input.accel_body_mps2 = measured_force(imu, climb, t);
    for (std::size_t k = 0; k < 3; ++k) {
      const CueBody cue = EdgeAltitude::step(params[k], input, states[k]);
      if (t < climb.end_s() - 1 || cue.validity != Validity::kValid) continue;
      squares[k] += std::pow(static_cast<double>(cue.height_m) - climb.height_m(t), 2);
      ++count[k];
    }
  }
  const auto rms = [&](std::size_t k) { return count[k] > 0 ? std::sqrt(squares[k] / count[k]) : 0; };
  out.rms_known_m = rms(0), out.rms_estimated_m = rms(1), out.rms_guess_m = rms(2);
  const vision::EdgeDensity& found = states[1].density.density;
  out.found = found.accepted > 0;
  out.edges_per_m = static_cast<double>(found.edges_per_m);
  out.sigma_per_m = static_cast<double>(found.sigma);
  return out;
}

void check(const EdgeStudyOptions& o) {
  const auto positive = [](const std::vector<double>& x) {
    return !x.empty() && std::all_of(x.begin(), x.end(), [](double v) { return v > 0; });
  };
  const bool good = o.edges_per_m > 0 && positive(o.assumed_per_m) && positive(o.fovs_deg) && positive(o.heights_m) &&
                    *std::max_element(o.fovs_deg.begin(), o.fovs_deg.end()) < 170 && o.seeds > 0 && o.climbs >= 0 &&
                    o.columns_px >= 4 && o.columns_px % 4 == 0 && o.height_px >= 32 && o.height_px % 2 == 0 &&
                    o.height_px <= vision::kMaxEdgeRows && o.width_px > 0 && o.resolution_px > 0 && o.lane_m >= 0 &&
                    o.climb_takes_s > 0 && o.climb_from_m > 0 && o.climb_window_s > 0;
  if (!good) throw std::invalid_argument("edge study: option out of range");
}

}  // namespace

sim::World poisson_strips(std::uint32_t seed, double edges_per_m, double lane_m) {
  sim::Random random(sim::mix(seed, 41));
  sim::World world;
  world.sky = 215;
  for (int i = 0; i < 2; ++i)  // texture 1 is what the renderer takes for its fine grain: none
    world.textures.emplace_back(4, [](int, int) { return 1.0; });
  const auto add_lane = [&](double left, double width) {
    double from = kFrom_m;
    for (std::uint32_t i = random.bits() & 1; from < kTo_m; ++i) {
      const double to = std::min(from + std::max(random.exponential(1 / edges_per_m), 1e-3), kTo_m);
      world.add_quad({static_cast<float>(from), static_cast<float>(left), 0}, {static_cast<float>(to - from), 0, 0},
                     {0, static_cast<float>(width), 0}, {0, 1.f, i % 2 == 0 ? 0.4f : 0.9f, 0.f});
      from = to;
    }
  };
  if (lane_m <= 0) {
    add_lane(-kHalfWidth_m, 2 * kHalfWidth_m);
    return world;
  }
  for (double y = 0, width = 0; y < kHalfWidth_m; y += width) {
    width = std::max(lane_m, kLaneGrowth * y);
    add_lane(y, width);
    add_lane(-y - width, width);
  }
  return world;
}

std::vector<double> edge_row_density(double edges_per_m, double height_m, double focal, double resolution_px,
                                     int rows) {
  std::vector<double> density;
  double sum = 0;
  const double lambda_k = edges_per_m * height_m * focal, last = rows;
  for (int i = 1; i <= rows; ++i) {
    const double v = i, next = std::min(v + resolution_px, last);
    density.push_back(lambda_k / (v * v) * std::exp(-lambda_k * (1 / v - 1 / next)));
    sum += density.back();
  }
  for (double& d : density) d /= sum;
  return density;
}

EdgeStudy run_edge_study(const EdgeStudyOptions& o) {
  check(o);
  EdgeStudy study;
  study.options = o;
  const int of = static_cast<int>(o.fovs_deg.size()) * (o.seeds + o.climbs);
  int done = 0;
  const auto tick = [&] {
    ++done;
    if (o.progress) o.progress(done, of);
  };
  for (const double fov : o.fovs_deg) {
    std::vector<std::vector<double>> cdf(o.heights_m.size());
    for (int seed = 0; seed < o.seeds; ++seed) {
      Eye eye(o, fov, seed);
      for (std::size_t i = 0; i < o.heights_m.size(); ++i) {
        const Look look = judge(o, fov, o.heights_m[i], seed, eye.look(0, o.heights_m[i]));
        study.samples.push_back(look.sample);
        cdf[i].resize(look.cdf.size());
        for (std::size_t k = 0; k < look.cdf.size(); ++k) cdf[i][k] += look.cdf[k] / o.seeds;
      }
      tick();
    }
    study.fits.push_back(fit_of(study, fov));
    for (std::size_t i = 0; i < o.heights_m.size(); ++i) {
      if (shown(o, o.heights_m[i])) study.distributions.push_back(distribution_of(o, fov, o.heights_m[i], cdf[i]));
      study.errors.push_back(error_of(study, fov, study.fits.back().edges_per_m, o.heights_m[i]));
    }
    for (int seed = 0; seed < o.climbs; ++seed) {
      study.climbs.push_back(fly_climb(o, fov, 1000 + seed));
      tick();
    }
  }
  return study;
}

void write_edge_study(const EdgeStudy& study, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  const auto write = [&](const char* name, const char* head, const auto& lines) {
    std::ofstream out(folder / name);
    out << head << '\n';
    lines(out);
    if (!out.flush()) throw std::runtime_error("cannot write " + (folder / name).string());
  };
  write("edge_samples.csv", "fov_deg,height_m,seed,valid,edges_per_height,peak_row_px,misfit", [&](std::ostream& out) {
    for (const EdgeSample& s : study.samples)
      out << s.fov_deg << ',' << s.height_m << ',' << s.seed << ',' << s.valid << ',' << s.edges_per_height << ','
          << s.peak_row_px << ',' << s.misfit << '\n';
  });
  write("edge_distributions.csv", "fov_deg,height_m,row_px,measured_cdf,model_cdf,model_pdf", [&](std::ostream& out) {
    for (const EdgeDistribution& d : study.distributions)
      for (std::size_t i = 0; i < d.row_px.size(); ++i)
        out << d.fov_deg << ',' << d.height_m << ',' << d.row_px[i] << ',' << d.measured_cdf[i] << ',' << d.model_cdf[i]
            << ',' << d.model_pdf[i] << '\n';
  });
  write("edge_errors.csv",
        "fov_deg,height_m,images,valid,mean_m,std_m,rms_share,rms_fitted_share,mean_row_px,std_row_px",
        [&](std::ostream& out) {
          for (const EdgeError& e : study.errors)
            out << e.fov_deg << ',' << e.height_m << ',' << e.images << ',' << e.valid << ',' << e.mean_m << ','
                << e.std_m << ',' << e.rms_share << ',' << e.rms_fitted_share << ',' << e.mean_row_px << ','
                << e.std_row_px << '\n';
        });
  write("edge_fits.csv", "fov_deg,edges_per_m,rms_share", [&](std::ostream& out) {
    for (const EdgeFit& f : study.fits) out << f.fov_deg << ',' << f.edges_per_m << ',' << f.rms_share << '\n';
  });
  write("edge_climbs.csv",
        "fov_deg,seed,guess_per_m,found,edges_per_m,sigma_per_m,rms_known_m,rms_estimated_m,rms_guess_m",
        [&](std::ostream& out) {
          for (const EdgeClimb& c : study.climbs)
            out << c.fov_deg << ',' << c.seed << ',' << c.guess_per_m << ',' << c.found << ',' << c.edges_per_m << ','
                << c.sigma_per_m << ',' << c.rms_known_m << ',' << c.rms_estimated_m << ',' << c.rms_guess_m << '\n';
        });
}

}  // namespace wasp::tools
