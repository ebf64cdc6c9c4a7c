// Refused: must not call non-'nonblocking' function 'std::vector<int>::push_back'
#include <vector>

#include "types/realtime.h"

namespace wasp {

void broken(std::vector<int>& values) WASP_REALTIME { values.push_back(1); }

}  // namespace wasp
