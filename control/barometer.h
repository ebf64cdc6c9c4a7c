// Height from air pressure: the last resort among the height sources, because weather and rotor wash move it. Its zero
// is learned while something sees the ground; before that it is where the vehicle stands.
#pragma once

#include "types/realtime.h"

namespace wasp::control {

struct BarometerParams {
  bool enabled = false;
  float standing_height_m = 0.2f;  ///< camera above the ground while standing, for flights that never see the ground
  float learning_gain = 0.05f;     ///< per tick with a visual height, 0 ... 1
};

struct BarometerState {
  bool started = false;
  float zero_m = 0;  ///< pressure altitude where height is 0
};

/// Standard atmosphere near the ground [m above the 1013.25 hPa level]. Realtime-safe: yes.
float pressure_altitude_m(float pressure_hpa) WASP_REALTIME;

/// One tick with the mean pressure since the last. `standing`: not yet armed. `seen_height_m` where `seen`. Returns the
/// barometric height; false where there is none (disabled, no believable pressure). Realtime-safe: yes.
bool barometer_step(const BarometerParams& params, float pressure_hpa, bool standing, bool seen, float seen_height_m,
                    BarometerState& state, float& height_m) WASP_REALTIME;

}  // namespace wasp::control
