// cluster beside cv::kmeans: 108 observations (a 12 x 9 grid's depths), k = 3, three starts each.
#include <cmath>
#include <memory>
#include <opencv2/core.hpp>
#include <random>

#include "benchmarks/vision_rows.h"
#include "vision/kernels/cluster.h"

namespace wasp::bench {
namespace {

constexpr int kObservations = 108;

struct PointSet {
  std::string name;
  std::vector<float> x, y;
  cv::Mat rows;  ///< the same, one observation a row
};

template <class Draw>
PointSet points(const std::string& name, const Draw& draw) {
  PointSet set{name, {}, {}, cv::Mat(kObservations, 2, CV_32F)};
  for (int i = 0; i < kObservations; ++i) {
    const auto [x, y] = draw(i);
    set.x.push_back(set.rows.at<float>(i, 0) = x);
    set.y.push_back(set.rows.at<float>(i, 1) = y);
  }
  return set;
}

/// Depths as flow gives them (three walls and noise), and what hurts: no clusters, one point, a line, two far points.
std::vector<PointSet> point_sets() {
  std::mt19937 random(3);
  std::normal_distribution<float> noise;
  std::uniform_real_distribution<float> uniform;
  using Point = std::pair<float, float>;
  std::vector<PointSet> sets;
  for (int n = 0; n < 40; ++n) {
    const float spread = 0.1f + 0.1f * static_cast<float>(n % 10);
    sets.push_back(points("walls" + std::to_string(n), [&](int i) {
      const float depth_m = 1.5f + 2.f * static_cast<float>(i % 3);
      return Point{depth_m + spread * noise(random), depth_m + spread * noise(random)};
    }));
    sets.push_back(points("uniform" + std::to_string(n), [&](int) { return Point{uniform(random), uniform(random)}; }));
  }
  sets.push_back(points("one_point", [](int) { return Point{2.f, 3.f}; }));
  sets.push_back(points("two_points", [](int i) { return i == 0 ? Point{1e6f, -1e6f} : Point{2.f, 3.f}; }));
  sets.push_back(points("line", [](int i) { return Point{static_cast<float>(i), static_cast<float>(i)}; }));
  sets.push_back(points("geometric", [](int i) { return Point{std::pow(1.15f, static_cast<float>(i)), 0.f}; }));
  return sets;
}

}  // namespace

std::vector<VisionRow> cluster_rows(const VisionData&) {
  const auto sets = std::make_shared<std::vector<PointSet>>(point_sets());
  const auto at = [sets](int i) -> const PointSet& { return (*sets)[static_cast<std::size_t>(i)]; };
  const auto peer = [at](int flags) {
    return [at, flags](int i) {
      thread_local cv::Mat labels, centres;
      const cv::TermCriteria until(cv::TermCriteria::EPS + cv::TermCriteria::COUNT, 20, 1e-6);
      keep(cv::kmeans(at(i).rows, 3, labels, until, 3, flags, centres));
    };
  };
  VisionRow row{.name = "cluster",
                .what = "k-means of 108 points, k = 3, 3 starts of at most 20 iterations",
                .floor_us = 1,
                .inputs = {},
                .ours = [at](int i) { keep(vision::cluster_points({}, at(i).x, at(i).y)); },
                .peers = {{"cv::kmeans", peer(cv::KMEANS_PP_CENTERS), 10},
                          {"cv::kmeans_random", peer(cv::KMEANS_RANDOM_CENTERS), 0}},
                .trips = [at](int i) { return vision::cluster_points({}, at(i).x, at(i).y).iterations; },
                .bound = "at most 3 x 20 passes"};
  for (const PointSet& set : *sets) row.inputs.push_back(set.name);
  return {row};
}

}  // namespace wasp::bench
