// `wasp guard`: the guardian. Its options are those of `wasp flight`, which it starts with them.
#include <cstdio>
#include <filesystem>

#include "scheduling/flight_options.h"
#include "scheduling/guardian.h"

int main(int argc, char** argv) {
  using namespace wasp::scheduling;
  FlightOptions options;
  if (const auto code = parse_flight_options(argc, argv, options)) return *code;
  try {
    std::vector<std::string> command{(std::filesystem::read_symlink("/proc/self/exe").parent_path() / "wasp").string(),
                                     "flight"};
    command.insert(command.end(), argv + 1, argv + argc);
    command.push_back("--guarded");
    Guardian guardian(load_guard_plan(options.configs), std::move(command), !options.no_rt);
    return guardian.run();
  } catch (const std::exception& e) {
    std::fprintf(stderr, "wasp guard: %s\n", e.what());
    return 1;
  }
}
