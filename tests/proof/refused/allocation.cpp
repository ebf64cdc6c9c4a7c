// Refused: must not call non-'nonblocking' function 'malloc'
#include <cstdlib>

#include "types/realtime.h"

namespace wasp {

void* broken() WASP_REALTIME { return std::malloc(64); }

}  // namespace wasp
