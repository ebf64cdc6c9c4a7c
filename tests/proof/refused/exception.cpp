// Refused: must not throw or catch exceptions
#include "types/realtime.h"

namespace wasp {

int broken(int value) WASP_REALTIME {
  if (value < 0) throw value;
  return value;
}

}  // namespace wasp
