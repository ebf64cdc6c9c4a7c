// The table of contents: config -> shared memory -> drivers -> thread table -> run. The behaviours are listed in
// behaviours.cpp.
//
// `wasp flight` is the flying process, alone in this binary so that it stays lean; every other subcommand is a program
// of its own beside it (`wasp top` runs `wasp-top`).
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <string>

#include "behaviours.h"
#include "rt/contract.h"
#include "scheduling/flight.h"
#include "scheduling/plan.h"

namespace {

using namespace wasp;

constexpr const char* kUsage =
    "usage: wasp SUBCOMMAND [options]    (wasp SUBCOMMAND --help for each)\n"
    "  fly      fly a mission, in the simulator or on a recording, and write a report\n"
    "  campaign a mission many times in lockstep on virtual time, held against its bars\n"
    "  reproduce every experiment of the thesis, and one page with its figures beside ours\n"
    "  judge    a recorded flight held against the bars of its mission\n"
    "  flight   the flying process alone\n"
    "  guard    the same, under a guardian that answers for it when it dies or hangs (fly starts it so)\n"
    "  plan     can the thread table keep its deadlines? response times, before any flight\n"
    "  sim      the simulator: camera and autopilot as another process, or the camera of another autopilot (--follow)\n"
    "  world    make and look at simulated worlds, VRML97 files\n"
    "  camera   a real camera (V4L2, IIDC, Kinect) into shared memory; --list shows what is plugged in\n"
    "  top      live rates, ages and latencies of a running flight, read-only\n"
    "  record   log a running flight, read-only\n"
    "  report   make report.html of a logged flight\n"
    "  link     who is on a line, what comes how often, and whether that autopilot can be flown by setpoints\n"
    "  doctor   find out by doing whether this machine can fly real time, and what would change that\n"
    "  eval     run one vision kernel over a folder of recordings\n"
    "  iceoryx  export topics to iceoryx, or import a camera from it\n"
    "  bench    benchmarks: latency, ipc, vision, micro\n"
    "  faults   every fault of the catalogue done to flights in the simulator, judged on the serial line\n"
    "  rt-guest the flight on a PREEMPT_RT kernel in an emulator, on virtual time\n";

int run_sister(const char* name, char** argv) {
  const std::string program =
      (std::filesystem::read_symlink("/proc/self/exe").parent_path() / (std::string("wasp-") + name)).string();
  execv(program.c_str(), argv);
  std::fprintf(stderr, "wasp: no subcommand '%s' (%s: %s)\n%s", name, program.c_str(), std::strerror(errno), kUsage);
  return 2;
}

}  // namespace

/// Depth of real-time sections of the calling thread, for an allocator guard loaded beside this program.
extern "C" int wasp_realtime_depth() { return rt::realtime_depth; }

int main(int argc, char** argv) {
  if (argc < 2 || std::strcmp(argv[1], "--help") == 0 || std::strcmp(argv[1], "-h") == 0) {
    std::fputs(kUsage, argc < 2 ? stderr : stdout);
    return argc < 2 ? 2 : 0;
  }
  if (std::strcmp(argv[1], "flight") == 0) return scheduling::flight_main(all_behaviours(), argc - 1, argv + 1);
  if (std::strcmp(argv[1], "plan") == 0) return scheduling::plan_main(all_behaviours(), argc - 1, argv + 1);
  return run_sister(argv[1], argv + 1);
}
