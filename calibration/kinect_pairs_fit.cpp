#include "calibration/kinect_pairs_fit.h"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>

namespace wasp::calibration {
namespace {

std::vector<Corners> corners_of(const BoardViews& views, const std::vector<std::size_t>& which) {
  std::vector<Corners> out;
  for (const std::size_t i : which) out.push_back(views.views[i].corners);
  return out;
}

struct Pose {
  cv::Matx33d R;
  cv::Vec3d T;
  double rms = 0;
  std::vector<double> pair_rms;
};

std::optional<Pose> stereo(const BoardPairs& pairs, const std::vector<cv::Point3f>& board, const LensFit& rgb,
                           const LensFit& ir, const std::vector<std::size_t>& which) {
  const std::vector<std::vector<cv::Point3f>> boards(which.size(), board);
  cv::Mat K_ir(ir.K), K_rgb(rgb.K), d_ir(ir.distortion, true), d_rgb(rgb.distortion, true), E, F, errors;
  cv::Mat R = cv::Mat::eye(3, 3, CV_64F), T = cv::Mat::zeros(3, 1, CV_64F);
  Pose pose;
  try {
    pose.rms = cv::stereoCalibrate(boards, corners_of(pairs.ir, which), corners_of(pairs.rgb, which), K_ir, d_ir, K_rgb,
                                   d_rgb, pairs.ir.image, R, T, E, F, errors, cv::CALIB_FIX_INTRINSIC,
                                   {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 200, 1e-9});
  } catch (const cv::Exception&) {
    return std::nullopt;
  }
  pose.R = cv::Matx33d(R.ptr<double>());
  pose.T = cv::Vec3d(T.ptr<double>());
  for (int i = 0; i < errors.rows; ++i)
    pose.pair_rms.push_back(std::sqrt((errors.at<double>(i, 0) * errors.at<double>(i, 0) +
                                       errors.at<double>(i, 1) * errors.at<double>(i, 1)) / 2));
  if (!std::isfinite(pose.rms) || !std::isfinite(cv::norm(pose.T))) return std::nullopt;
  return pose;
}

}  // namespace

std::optional<PairFit> fit_pairs(const BoardPairs& pairs, double square_mm, bool k3) {
  const std::vector<cv::Point3f> board = board_points(pairs.rgb.board, square_mm);
  std::vector<std::size_t> all(pairs.rgb.views.size());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = i;
  const LensModel lens{LensKind::kPinhole, k3};
  const auto solve = [&](const std::vector<std::size_t>& which, PairFit& out) {
    auto rgb = fit_lens(board, corners_of(pairs.rgb, which), pairs.rgb.image, lens);
    auto ir = fit_lens(board, corners_of(pairs.ir, which), pairs.ir.image, lens);
    if (!rgb || !ir) return false;
    const auto pose = stereo(pairs, board, *rgb, *ir, which);
    if (!pose) return false;
    out = {*std::move(rgb), *std::move(ir), pose->R, pose->T, pose->rms, pose->pair_rms, {}, {}};
    return true;
  };
  PairFit fit;
  if (!solve(all, fit)) return std::nullopt;
  // Everything again without each of five groups, lenses included: what they are wrong by moves the pose as well.
  constexpr std::size_t kGroups = 5;
  int groups = 0;
  cv::Vec3d T2(0, 0, 0), r2(0, 0, 0);
  for (std::size_t g = 0; g < kGroups; ++g) {
    std::vector<std::size_t> rest;
    for (const std::size_t i : all)
      if (i % kGroups != g) rest.push_back(i);
    PairFit part;
    if (rest.size() == all.size() || !solve(rest, part)) continue;
    cv::Vec3d turn;
    cv::Rodrigues(part.R * fit.R.t(), turn);
    const cv::Vec3d shift = part.T_mm - fit.T_mm;
    T2 += shift.mul(shift), r2 += turn.mul(turn);
    ++groups;
  }
  if (groups < 2) return std::nullopt;
  const double factor = (groups - 1.0) / groups;
  for (int k = 0; k < 3; ++k) {
    fit.T_sigma_mm[k] = std::sqrt(factor * T2[k]);
    fit.rotation_sigma_rad[k] = std::sqrt(factor * r2[k]);
  }
  return fit;
}

}  // namespace wasp::calibration
