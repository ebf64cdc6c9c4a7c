// Refused: must not call non-'nonblocking' function 'wasp::Sensor::read'
#include "types/realtime.h"

namespace wasp {

struct Sensor {
  virtual ~Sensor() = default;
  virtual int read() noexcept = 0;
};

int broken(Sensor& sensor) WASP_REALTIME { return sensor.read(); }

}  // namespace wasp
