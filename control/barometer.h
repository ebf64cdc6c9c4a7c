// Height from air pressure: the last resort among the height sources, because weather and rotor wash move it. Its zero
// is learned while something sees the ground; before that it is where the vehicle stands.
#pragma once

#include "types/messages.h"
#include "types/realtime.h"

namespace wasp::control {

struct BarometerParams {
  bool enabled = false;
  float standing_height_m = 0.2f;  ///< camera above the ground while standing, for flights that never see the ground
  float learning_gain = 0.05f;     ///< per tick with a visual height, 0 ... 1
  float max_jump_m = 5.f;          ///< a zero further away is not learned ...
  int jumps_to_accept = 20;        ///< ... unless it stays for so many ticks in a row: then it is the new one
};

struct BarometerState {
  bool started = false;
  float zero_m = 0;  ///< pressure altitude where height is 0
  int jumps = 0;
};

/// Standard atmosphere near the ground [m above the 1013.25 hPa level]. Realtime-safe: yes.
float pressure_altitude_m(float pressure_hpa) WASP_REALTIME;

/// Mean of the pressures among inertial samples; those that carry none do not count.
class PressureMean {
 public:
  /// Realtime-safe: yes.
  void add(const ImuSample& sample) WASP_REALTIME;
  /// [hPa], 0 if there was none; the next mean starts anew. Realtime-safe: yes.
  float take() WASP_REALTIME;

 private:
  double sum_hpa_ = 0;
  int count_ = 0;
};

/// One tick with the mean pressure since the last. `standing`: not yet armed. `seen`: something sees the ground, and
/// `height_m_now` is the height filter's present estimate, not a cue that grows old. Returns the barometric height;
/// false where there is none (disabled, no believable pressure). Realtime-safe: yes.
bool barometer_step(const BarometerParams& params, float pressure_hpa, bool standing, bool seen, float height_m_now,
                    BarometerState& state, float& height_m) WASP_REALTIME;

}  // namespace wasp::control
