#include "tools/camera_section.h"

#include <fmt/format.h>

#include <cmath>

namespace wasp::tools {

std::string camera_keys(const CameraGeometry& camera) {
  const Intrinsics& k = camera.intrinsics;
  const Mat3& R = camera.R_body_cam;
  const double pitch_down = std::atan2(static_cast<double>(R(2, 2)), static_cast<double>(R(0, 2)));
  const auto& f = camera.fisheye_k;
  const Vec3& p = camera.position_body_m;
  return fmt::format("width_px = {}\nheight_px = {}\nfx_px = {}\nfy_px = {}\ncx_px = {}\ncy_px = {}\n", k.width_px,
                     k.height_px, k.fx_px, k.fy_px, k.cx_px, k.cy_px) +
         fmt::format("k1 = {}\nk2 = {}\np1 = {}\np2 = {}\nk3 = {}\n", k.k1, k.k2, k.p1, k.p2, k.k3) +
         fmt::format("lens = \"{}\"\nfisheye_k = [{}, {}, {}, {}]\n",
                     camera.lens_kind == LensKind::kFisheye ? "fisheye" : "pinhole", f[0], f[1], f[2], f[3]) +
         fmt::format("pitch_down_deg = {:.5g}\nposition_body_m = [{}, {}, {}]\n", to_degrees(Radians{pitch_down}).value,
                     p.x(), p.y(), p.z());
}

}  // namespace wasp::tools
