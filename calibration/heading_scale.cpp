#include "calibration/heading_scale.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "vision/heading_rate.h"
#include "vision/kernels/flow_grid.h"
#include "vision/kernels/frame_rotation.h"

namespace wasp::calibration {
namespace {

using Eigen::VectorXd;

constexpr int kBlocks = 8;
constexpr double kFarthest = 4.5;

double degrees(double rad) { return rad * 180 / std::numbers::pi; }

/// What the behaviour is given: the flow, the times, and the camera's turn where both attitudes are known.
FlowMessage message_of(const vision::FlowField& flow, TimeNs first_ns, TimeNs second_ns, const Mat3& R_body_cam,
                       const std::optional<AttitudeSample>& first, const std::optional<AttitudeSample>& second) {
  FlowMessage message;
  message.first_exposed_at_ns = first_ns;
  message.exposed_at_ns = second_ns;
  message.seen = message.still = flow;
  if (!first || !second) return message;
  const Mat3 R = vision::frame_rotation(R_body_cam, first->q_ned_body, second->q_ned_body);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) message.R_second_first[static_cast<std::size_t>(3 * i + j)] = R(i, j);
  message.q_ned_body = second->q_ned_body;
  message.derotated = 1;
  return message;
}

Eigen::Vector3d down_in_camera(const Mat3& R_body_cam, const AttitudeSample& attitude) {
  const auto& q = attitude.q_ned_body;
  const Mat3 R_ned_cam = Quat(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix() * R_body_cam;
  return R_ned_cam.transpose().col(2).cast<double>();
}

struct Series {
  std::vector<double> time_s, seen, known;
};

Series gather(const std::vector<SeenYaw>& seen, const TurnSource& source, double delay_s) {
  Series s;
  const DurationNs delay_ns = from_seconds(delay_s);
  for (const SeenYaw& pair : seen) {
    if (!pair.valid) continue;
    const auto rate = source.mean_rate(pair.first_ns - delay_ns, pair.second_ns - delay_ns);
    if (!rate) continue;
    s.time_s.push_back(to_seconds(pair.second_ns - seen.front().first_ns));
    s.seen.push_back(pair.yaw_radps);
    s.known.push_back(rate->head<3>().dot(pair.down_cam));
  }
  return s;
}

struct Line {
  double scale = 1, low = 0, high = 0, bias = 0, correlation = 0;
};

/// known = bias + scale * seen over the pairs of weight one.
Line line_through(const VectorXd& seen, const VectorXd& known, const VectorXd& weights) {
  const double n = std::max(weights.sum(), 1.0), mx = weights.dot(seen) / n, my = weights.dot(known) / n;
  const VectorXd x = seen.array() - mx, y = known.array() - my;
  const double xx = weights.dot(x.cwiseProduct(x)), yy = weights.dot(y.cwiseProduct(y)),
               xy = weights.dot(x.cwiseProduct(y));
  Line line;
  if (!(xx > 0 && yy > 0 && xy > 0)) return line;
  line.low = xy / xx, line.high = yy / xy;
  line.scale = std::sqrt(line.low * line.high);
  line.bias = my - line.scale * mx;
  line.correlation = xy / std::sqrt(xx * yy);
  return line;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

VectorXd inliers(const VectorXd& residual) {
  std::vector<double> sizes;
  for (const double r : residual) sizes.push_back(std::abs(r));
  const double limit = std::max(kFarthest * 1.4826 * median(sizes), 1e-6);
  return (residual.array().abs() <= limit).cast<double>();
}

double jackknife(const VectorXd& seen, const VectorXd& known, const VectorXd& weights) {
  std::array<double, kBlocks> scales{};
  double mean = 0, squares = 0;
  for (int b = 0; b < kBlocks; ++b) {
    VectorXd rest = weights;
    const Eigen::Index first = seen.size() * b / kBlocks, last = seen.size() * (b + 1) / kBlocks;
    rest.segment(first, last - first).setZero();
    scales[static_cast<std::size_t>(b)] = line_through(seen, known, rest).scale;
  }
  for (const double s : scales) mean += s / kBlocks;
  for (const double s : scales) squares += (s - mean) * (s - mean);
  return std::sqrt(squares * (kBlocks - 1) / kBlocks);
}

double share_beyond(const VectorXd& rates, double limit_radps, bool positive) {
  const double count = positive ? static_cast<double>((rates.array() > limit_radps).count())
                                : static_cast<double>((rates.array() < -limit_radps).count());
  return count / static_cast<double>(std::max<Eigen::Index>(rates.size(), 1));
}

std::string refusal_of(const HeadingScale& h, const VectorXd& known, const HeadingScaleParams& p) {
  const double limit = h.rms_radps / 3, right = share_beyond(known, limit, true),
               left = share_beyond(known, limit, false);
  if (h.valid_share < p.least_valid)
    return fmt::format(
        "the floor was followed between {:.0f} % of the frames only (at least {:.0f} %): too little texture, or too "
        "fast",
        100 * h.valid_share, 100 * p.least_valid);
  if (h.rms_radps < p.least_rms_radps)
    return fmt::format(
        "the yaw rate varies by {:.2f} deg/s rms only; at least {:.1f} are needed: turn both ways, with rests",
        degrees(h.rms_radps), degrees(p.least_rms_radps));
  if (std::min(right, left) < p.least_each_way)
    return fmt::format(
        "it turned one way: {:.0f} % of the frames to the right, {:.0f} % to the left (at least {:.0f} % each), and "
        "a bias of the gyro cannot be told from the scale",
        100 * right, 100 * left, 100 * p.least_each_way);
  if (h.correlation < p.least_correlation)
    return fmt::format("seen and known yaw rate correlate by {:.4f} only; at least {:.2f}", h.correlation,
                       p.least_correlation);
  if (h.sigma > p.most_sigma)
    return fmt::format(
        "the scale, {:.4f}, is known to {:.4f} only (one standard deviation; at most {:.3f}): turn longer or faster",
        h.scale, h.sigma, p.most_sigma);
  if (!(h.scale >= 0.5 && h.scale <= 2))
    return fmt::format(
        "a scale of {:.3f} is no scale: camera, lens or axes of the gyro are not what the recording says", h.scale);
  return "";
}

}  // namespace

std::vector<SeenYaw> seen_yaw(const drivers::Recording& recording, const std::vector<TimeNs>& stamps) {
  const auto size = recording.gray_size();
  if (size.pixels() == 0) throw std::runtime_error(recording.folder().string() + ": holds no grey images");
  vision::HeadingRateDown::Params params;
  params.camera = recording.geometry();
  vision::HeadingRateDown::State state;
  vision::FlowGrid grid(size.width_px, size.height_px, {});
  vision::FlowField flow;
  std::array<std::vector<std::uint8_t>, 2> pixels{std::vector<std::uint8_t>(size.pixels()),
                                                  std::vector<std::uint8_t>(size.pixels())};
  const auto view = [&](std::size_t i) {
    return GrayView{pixels[i].data(), size.width_px, size.height_px, size.width_px};
  };
  const auto attitude = [&](std::size_t i) {
    return drivers::attitude_of(recording.motion(), params.camera.R_body_cam,
                                recording.time_ns(recording.entries()[i]));
  };
  std::vector<SeenYaw> seen;
  std::optional<std::size_t> last;
  std::size_t now = 0;
  for (std::size_t i = 0; i < recording.entries().size(); ++i) {
    if (!recording.entries()[i].has_gray()) continue;
    try {
      recording.load_gray(i, pixels[now]);
    } catch (const std::runtime_error&) {
      continue;
    }
    if (last) {
      grid.track(view(1 - now), view(now), flow);
      const auto second = attitude(i);
      const FlowMessage message =
          message_of(flow, stamps[*last], stamps[i], params.camera.R_body_cam, attitude(*last), second);
      BehaviourInput input;
      input.exposed_at_ns = stamps[i];
      input.flow = &message;
      const CueBody cue = vision::HeadingRateDown::step(params, input, state);
      SeenYaw pair{stamps[*last], stamps[i], cue.validity == Validity::kValid,
                   static_cast<double>(cue.detail[vision::HeadingDetail::kYawRate_radps])};
      pair.down_cam = down_in_camera(params.camera.R_body_cam, second.value_or(AttitudeSample{}));
      seen.push_back(pair);
    }
    last = i;
    now = 1 - now;
  }
  return seen;
}

HeadingScale fit_heading_scale(const std::vector<SeenYaw>& seen, const TurnSource& source, double delay_s,
                               const HeadingScaleParams& params) {
  HeadingScale h;
  const Series s = gather(seen, source, delay_s);
  h.pairs = s.seen.size();
  if (s.seen.size() < static_cast<std::size_t>(params.least_pairs)) {
    h.refusal = fmt::format("{} pairs of frames show the floor and lie within the sensor's record; {} are the least",
                            h.pairs, params.least_pairs);
    return h;
  }
  const auto n = static_cast<Eigen::Index>(s.seen.size());
  const VectorXd x = Eigen::Map<const VectorXd>(s.seen.data(), n), y = Eigen::Map<const VectorXd>(s.known.data(), n);
  VectorXd weights = VectorXd::Ones(n);
  Line line = line_through(x, y, weights);
  for (int round = 0; round < 3; ++round) {
    weights = inliers(y - line.scale * x - VectorXd::Constant(n, line.bias));
    line = line_through(x, y, weights);
  }
  const VectorXd residual = y - line.scale * x - VectorXd::Constant(n, line.bias);
  h.scale = line.scale, h.low = line.low, h.high = line.high, h.bias_radps = line.bias,
  h.correlation = line.correlation;
  h.sigma = std::max(jackknife(x, y, weights), 0.5 * (line.high - line.low));
  h.residual_radps = std::sqrt(weights.dot(residual.cwiseProduct(residual)) / std::max(weights.sum(), 1.0));
  h.rms_radps = std::sqrt((y.array() - y.mean()).square().mean());
  const auto valid = std::count_if(seen.begin(), seen.end(), [](const SeenYaw& p) { return p.valid; });
  h.valid_share = static_cast<double>(valid) / static_cast<double>(seen.size());
  h.outliers = static_cast<std::size_t>(n) - static_cast<std::size_t>(weights.sum());
  h.time_s = s.time_s, h.seen_radps = s.seen, h.known_radps = s.known;
  h.residuals_radps.assign(residual.begin(), residual.end());
  h.refusal = refusal_of(h, y, params);
  return h;
}

}  // namespace wasp::calibration
