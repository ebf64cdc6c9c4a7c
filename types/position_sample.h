// Where the autopilot says the vehicle is. Nothing that flies uses it; it is published for whoever must show the world
// to a vehicle that an autopilot of others flies (`wasp sim --follow flight`), and for logs.
#pragma once

#include <array>
#include <cstdint>
#include <type_traits>

#include "types/time.h"

namespace wasp {

/// 48 bytes, in the autopilot's own local frame.
struct PositionSample {
  TimeNs exposed_at_ns = 0;
  std::array<float, 3> position_ned_m{}, velocity_ned_mps{};
  std::uint32_t sequence = 0;
  std::uint32_t armed = 0;
  std::uint32_t reserved[2] = {};
};
static_assert(sizeof(PositionSample) == 48 && std::is_trivially_copyable_v<PositionSample>);

}  // namespace wasp
