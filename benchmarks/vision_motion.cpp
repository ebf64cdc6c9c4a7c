// What reads a flow grid, each call on one field of 12 x 9 cells: similarity_fit beside OpenCV's robust fit of the same
// four parameters, the focus of expansion, time to contact, derotation, depth from flow, the balance force. The fields
// are approaches over noise and outliers, and what hurts: still, all noise, one cell, not finite.
#include <cmath>
#include <limits>
#include <memory>
#include <opencv2/calib3d.hpp>
#include <random>

#include "benchmarks/vision_rows.h"
#include "vision/kernels/balance_template.h"
#include "vision/kernels/flow_depth.h"
#include "vision/kernels/foe.h"
#include "vision/kernels/time_to_contact.h"

namespace wasp::bench {
namespace {

struct NamedField {
  std::string name;
  vision::FlowField flow;
  std::vector<cv::Point2f> from, to;  ///< the same, for OpenCV
};

template <class Motion>
NamedField field(const std::string& name, const Motion& motion) {
  NamedField f{name, {}, {}, {}};
  for (int r = 0; r < f.flow.rows; ++r)
    for (int c = 0; c < f.flow.columns; ++c) {
      vision::FlowCell& cell = f.flow.at(c, r);
      cell.x_px = (static_cast<float>(c) + 0.5f) * 640.f / 12.f,
      cell.y_px = (static_cast<float>(r) + 0.5f) * 480.f / 9.f;
      std::tie(cell.u_px, cell.v_px) = motion(cell.x_px, cell.y_px);
      cell.quality = 1.f, cell.valid = 1;
      f.from.emplace_back(cell.x_px, cell.y_px);
      f.to.emplace_back(cell.x_px + cell.u_px, cell.y_px + cell.v_px);
    }
  return f;
}

std::vector<NamedField> fields() {
  using Uv = std::pair<float, float>;
  std::mt19937 random(11);
  std::normal_distribution<float> noise;
  std::uniform_real_distribution<float> uniform(0.f, 1.f);
  std::vector<NamedField> all;
  for (int n = 0; n < 40; ++n) {
    const float growth = 0.002f * static_cast<float>(1 + n % 20), turn = 0.001f * static_cast<float>(n % 7 - 3);
    const float fx = 200.f + 6.f * static_cast<float>(n), fy = 240.f, spoilt = 0.05f * static_cast<float>(n % 6);
    all.push_back(field("approach" + std::to_string(n), [&](float x, float y) {
      const float near = 0.5f + uniform(random);  // depth differs from cell to cell
      if (uniform(random) < spoilt) return Uv{20.f * noise(random), 20.f * noise(random)};
      return Uv{near * growth * (x - fx) - turn * (y - fy) + 0.1f * noise(random),
                near * growth * (y - fy) + turn * (x - fx) + 0.1f * noise(random)};
    }));
  }
  all.push_back(field("still", [](float, float) { return Uv{0.f, 0.f}; }));
  all.push_back(field("noise", [&](float, float) { return Uv{5.f * noise(random), 5.f * noise(random)}; }));
  all.push_back(field("sideways", [](float, float) { return Uv{9.f, 0.f}; }));
  const float nan = std::numeric_limits<float>::quiet_NaN();
  all.push_back(field("not_finite", [&](float x, float) { return Uv{x > 320.f ? nan : 1.f, 0.f}; }));
  NamedField& last = all.back();
  for (std::size_t i = 0; i < last.to.size(); ++i)  // OpenCV is spared what it cannot take
    if (!std::isfinite(last.to[i].x)) last.to[i] = last.from[i];
  return all;
}

}  // namespace

std::vector<VisionRow> motion_rows(const VisionData&) {
  const auto all = std::make_shared<std::vector<NamedField>>(fields());
  const auto at = [all](int i) -> const NamedField& { return (*all)[static_cast<std::size_t>(i)]; };
  const auto flow = [at](int i) -> const vision::FlowField& { return at(i).flow; };
  const auto depths = std::make_shared<vision::DepthGrid>();
  const auto still = std::make_shared<vision::FlowField>();
  const vision::Lens lens;
  const vision::CameraStep camera{Vec3(0.05f, 0.f, 0.5f), Vec3(0.01f, -0.02f, 0.03f), 1.f / 30.f};
  std::vector<VisionRow> rows;
  const auto row = [&](const char* name, const char* what, const char* bound, std::function<void(int)> ours) {
    VisionRow& added = rows.emplace_back();
    added.name = name, added.what = what, added.bound = bound, added.ours = std::move(ours);
    for (const NamedField& f : *all) added.inputs.push_back(f.name);
  };
  row("similarity_fit", "rotation, scale and shift of 108 cells, robust", "96 pairs, 8 rounds",
      [=](int i) { keep(vision::fit_similarity({}, flow(i))); });
  rows.back().peers.push_back(
      {"cv::estimateAffinePartial2D",
       [=](int i) { keep(cv::estimateAffinePartial2D(at(i).from, at(i).to, cv::noArray(), cv::RANSAC, 2.0)); }});
  row("foe", "focus of expansion of 108 cells, robust", "96 pairs, 12 rounds",
      [=](int i) { keep(vision::find_foe({}, flow(i))); });
  row("foe_and_rotation", "the same with the camera's turn solved for", "121 starts, 12 rounds",
      [=](int i) { keep(vision::find_foe_and_rotation({}, flow(i), lens.intrinsics)); });
  row("time_to_contact", "rings about a focus, 108 cells", "fixed trip counts",
      [=](int i) { keep(vision::contact_from_rings({}, flow(i), 320.f, 240.f)); });
  row("derotate", "108 cells, pinhole", "fixed trip counts, Newton's at most 10 steps a cell with distortion",
      [=](int i) {
        vision::derotate(lens, flow(i), camera.rate_cam_rad_s, camera.interval_s, *still);
        keep(*still);
      });
  row("flow_depth", "depth of 108 cells from flow and motion", "4 rounds", [=](int i) {
    vision::flow_depth({}, lens, flow(i), camera, *depths);
    keep(*depths);
  });
  row("balance_force", "gross force of 108 cells", "fixed trip counts",
      [=](int i) { keep(vision::gross_force({}, flow(i), 320.f, 240.f)); });
  return rows;
}

}  // namespace wasp::bench
