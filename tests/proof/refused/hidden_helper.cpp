// Refused: must not call non-'nonblocking' function 'wasp::elsewhere'
#include "types/realtime.h"

namespace wasp {

int elsewhere(int value) noexcept;  // not marked, and its body is in another source

int broken(int value) WASP_REALTIME { return elsewhere(value); }

}  // namespace wasp
