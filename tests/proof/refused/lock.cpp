// Refused: must not call non-'nonblocking' function 'std::mutex::lock'
#include <mutex>

#include "types/realtime.h"

namespace wasp {

void broken(std::mutex& mutex) WASP_REALTIME { mutex.lock(); }

}  // namespace wasp
