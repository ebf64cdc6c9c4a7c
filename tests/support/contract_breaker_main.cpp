// Allocates inside a RealtimeSection as often as its argument says; the preloaded malloc guard must count just that.
#include <cstdlib>

#include "rt/contract.h"

extern "C" int wasp_realtime_depth() { return wasp::rt::realtime_depth; }

int main(int argc, char** argv) {
  const int wanted = argc > 1 ? std::atoi(argv[1]) : 1;
  void* volatile keep = std::malloc(64);  // outside: allowed
  std::free(keep);
  const wasp::rt::RealtimeSection section;
  for (int i = 0; i < wanted; ++i) keep = std::malloc(64);
  return keep == nullptr ? 1 : 0;
}
