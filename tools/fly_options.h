// The command line of `wasp fly`.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace wasp::tools {

struct FlyOptions {
  std::string config;                 ///< extra configuration, read after the default
  std::string replay;                 ///< recording to fly on, empty: the simulator's camera
  std::string name;                   ///< of the run and its folder
  std::filesystem::path out = "out";  ///< parent of the run's folder
  std::string mission = "hover";
  std::string world;      ///< VRML97 file to fly in, empty: that of the mission
  std::string autopilot;  ///< whose autopilot flies: px4, ardupilot; empty: as configured, and wasp's own simulated
  std::string follow;  ///< the configured autopilot is another program: where its pose is read; empty: it is simulated
  int udp_port = 0;    ///< link by datagrams to this port of ours; 0: a serial line
  double seconds = 0;  ///< total flight time, 0: as configured
  std::uint64_t seed = 1;
  bool no_rt = false;    ///< never ask for real time
  bool enforce = false;  ///< refuse to fly without it
  bool record = false;   ///< keep frames too
  bool strict_syscalls = false;
  bool json = false;
  bool safety_pilot = true;
  bool faults = false;         ///< arm the fault points, with a control socket in the run's folder
  std::string fault_timeline;  ///< and this timeline; empty: none
};

/// Parses; on --help or an error prints what is due and returns the exit code instead.
std::optional<int> parse_fly_options(int argc, char** argv, FlyOptions& options);

}  // namespace wasp::tools
