// Breaks the contract inside a real-time function, in a way the compiler cannot see: RealtimeSanitizer must end it.
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "types/realtime.h"

namespace {

void* (*volatile allocate)(std::size_t) = &std::malloc;

#pragma clang diagnostic ignored "-Wfunction-effects"
void step(bool broken) WASP_REALTIME {
  if (broken) std::free(allocate(64));
}

}  // namespace

int main(int argc, char** argv) {
  step(argc > 1 && std::strcmp(argv[1], "malloc") == 0);
  std::puts("nothing noticed");
  return 0;
}
