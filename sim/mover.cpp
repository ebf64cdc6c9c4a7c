#include "sim/mover.h"

#include <algorithm>
#include <cmath>

namespace wasp::sim {

MoverPlace Mover::at(double t_s) const {
  const double cycle_s = static_cast<double>(keys.back().at_s);
  double t = std::max(t_s, 0.0);
  if (looped && cycle_s > 0) t = std::fmod(t, cycle_s);
  const auto after =
      std::find_if(keys.begin(), keys.end(), [t](const MoverKey& k) { return static_cast<double>(k.at_s) > t; });
  if (after == keys.begin()) return keys.front().place;
  if (after == keys.end()) return keys.back().place;
  const MoverKey &a = *(after - 1), &b = *after;
  const auto share = static_cast<float>((t - static_cast<double>(a.at_s)) / static_cast<double>(b.at_s - a.at_s));
  return {a.place.position_ned_m + share * (b.place.position_ned_m - a.place.position_ned_m),
          a.place.yaw_rad + share * (b.place.yaw_rad - a.place.yaw_rad)};
}

}  // namespace wasp::sim
