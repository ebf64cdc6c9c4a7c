// flow_grid beside what one calls in OpenCV: calcOpticalFlowPyrLK at the same 108 centres, pyramid included, with the
// thesis' window (10 x 10) and OpenCV's own (21 x 21). Also, once and without a bar, the two classes the thesis reviews:
// block matching (SAD) at the centres and dense Horn-Schunck.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <utility>
#include <vector>

#include "benchmarks/vision_rows.h"
#include "vision/kernels/flow_grid.h"

namespace wasp::bench {
namespace {

constexpr int kColumns = 12, kRows = 9;

cv::Mat mat(const GrayView& v) {
  return cv::Mat(v.height_px, v.width_px, CV_8U, const_cast<std::uint8_t*>(v.data),
                 static_cast<std::size_t>(v.stride_px));
}

struct PyrLk {
  std::vector<cv::Point2f> from, to;
  std::vector<std::uint8_t> status;
  std::vector<float> error;

  cv::Size window;

  explicit PyrLk(int window_px) : window(window_px, window_px) {
    for (int r = 0; r < kRows; ++r)
      for (int c = 0; c < kColumns; ++c)
        from.emplace_back((static_cast<float>(c) + 0.5f) * kVisionWidth / kColumns - 0.5f,
                          (static_cast<float>(r) + 0.5f) * kVisionHeight / kRows - 0.5f);
  }
  void run(const GrayView& first, const GrayView& second) {
    cv::calcOpticalFlowPyrLK(mat(first), mat(second), from, to, status, error, window, 3);
    keep(to);
  }
};

/// Least sum of absolute differences of a 16 x 16 block within +-7 px, about each centre.
struct BlockMatching {
  std::array<cv::Point, kColumns * kRows> best;

  static int difference(const GrayView& a, const GrayView& b, int u, int v, int du, int dv) {
    int sum = 0;
    for (int y = 0; y < 16; ++y)
      for (int x = 0; x < 16; ++x) sum += std::abs(a.row(v + y)[u + x] - b.row(v + dv + y)[u + du + x]);
    return sum;
  }
  void run(const GrayView& a, const GrayView& b) {
    for (int i = 0; i < kColumns * kRows; ++i) {
      const int u = (2 * (i % kColumns) + 1) * kVisionWidth / (2 * kColumns) - 8;
      const int v = (2 * (i / kColumns) + 1) * kVisionHeight / (2 * kRows) - 8;
      int least = difference(a, b, u, v, 0, 0);
      best[static_cast<std::size_t>(i)] = {};
      for (int dv = -7; dv <= 7; ++dv)
        for (int du = -7; du <= 7; ++du)
          if (const int d = difference(a, b, u, v, du, dv); d < least)
            least = d, best[static_cast<std::size_t>(i)] = {du, dv};
    }
    keep(best);
  }
};

/// Horn and Schunck (1981), dense, 10 Jacobi rounds at 1/2 size: the fewest that move information at all.
struct HornSchunck {
  cv::Mat small_a, small_b, a, b, ix, iy, it, u, v, mean_u, mean_v, gain;

  void run(const GrayView& first, const GrayView& second) {
    cv::resize(mat(first), small_a, {}, 0.5, 0.5, cv::INTER_AREA);
    cv::resize(mat(second), small_b, {}, 0.5, 0.5, cv::INTER_AREA);
    small_a.convertTo(a, CV_32F);
    small_b.convertTo(b, CV_32F);
    cv::Sobel(a, ix, CV_32F, 1, 0, 3, 0.125);
    cv::Sobel(a, iy, CV_32F, 0, 1, 3, 0.125);
    cv::subtract(b, a, it);
    u = cv::Mat::zeros(a.size(), CV_32F);
    v = u.clone();
    for (int i = 0; i < 10; ++i) {
      cv::blur(u, mean_u, {3, 3});
      cv::blur(v, mean_v, {3, 3});
      gain = (ix.mul(mean_u) + iy.mul(mean_v) + it) / (ix.mul(ix) + iy.mul(iy) + 100.0);
      u = mean_u - ix.mul(gain);
      v = mean_v - iy.mul(gain);
    }
    keep(u);
  }
};

}  // namespace

std::vector<VisionRow> flow_grid_rows(const VisionData& data) {
  const auto grid = std::make_shared<vision::FlowGrid>(kVisionWidth, kVisionHeight, vision::FlowGridParams{});
  const auto field = std::make_shared<vision::FlowField>();
  const auto first = [&data](int i) {
    return data.gray[static_cast<std::size_t>(data.pairs[static_cast<std::size_t>(i)].first)].view();
  };
  const auto second = [&data](int i) {
    return data.gray[static_cast<std::size_t>(data.pairs[static_cast<std::size_t>(i)].second)].view();
  };
  VisionRow row;
  row.name = "flow_grid";
  row.what = "12x9 grid on 640x480, both pyramids included";
  row.floor_us = 120;
  for (const GrayPair& pair : data.pairs)
    row.inputs.push_back(data.gray[static_cast<std::size_t>(pair.first)].name + " > " +
                         data.gray[static_cast<std::size_t>(pair.second)].name);
  row.ours = [=](int i) {
    grid->track(first(i), second(i), *field);
    keep(*field);
  };
  const auto worst = grid->worst_case();
  for (const auto& [text, count] : {std::pair{"blocks at most ", worst.blocks}, std::pair{", passes ", worst.passes},
                                    std::pair{", first guesses ", worst.guesses}})
    row.bound.append(text).append(std::to_string(count));
  row.trips = [=](int i) {
    grid->track(first(i), second(i), *field);
    return grid->trips().passes;
  };
  const auto lk = std::make_shared<PyrLk>(10), lk21 = std::make_shared<PyrLk>(21);
  const auto matching = std::make_shared<BlockMatching>();
  const auto schunck = std::make_shared<HornSchunck>();
  row.peers.push_back({"cv::calcOpticalFlowPyrLK", [=](int i) { lk->run(first(i), second(i)); }, 4});
  row.peers.push_back({"PyrLK 21x21", [=](int i) { lk21->run(first(i), second(i)); }, 0});
  row.peers.push_back({"block matching", [=](int i) { matching->run(first(i), second(i)); }, 0});
  row.peers.push_back({"Horn-Schunck", [=](int i) { schunck->run(first(i), second(i)); }, 0});
  return {row};
}

}  // namespace wasp::bench
