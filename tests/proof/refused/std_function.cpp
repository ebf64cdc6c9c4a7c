// Refused: must not call non-'nonblocking' function 'std::function<void \(\)>::operator\(\)'
#include <functional>

#include "types/realtime.h"

namespace wasp {

void broken(const std::function<void()>& action) WASP_REALTIME { action(); }

}  // namespace wasp
