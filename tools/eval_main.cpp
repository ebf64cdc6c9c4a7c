// wasp-eval KERNEL DIR: runs one vision kernel over a recording and prints how well and how fast it did.
// Exit code 0: all bars met; 1: a bar missed; 2: the recording or a file in it is no good; others: usage (CLI11).
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <string_view>

#include "tools/eval_kernels.h"
#include "tools/eval_mavlink.h"

namespace {

using namespace wasp::tools;

std::string kernel_help() {
  std::string text = "Kernels:\n";
  for (const EvalKernel& kernel : kEvalKernels) text += fmt::format("  {:<14}{}\n", kernel.name, kernel.what);
  return text + "And: mavlink, over recorded MAVLink logs, with options of its own (mavlink --help).\n";
}

std::string check_kernel(const std::string& name) {
  const bool known =
      std::any_of(kEvalKernels.begin(), kEvalKernels.end(), [&](const auto& k) { return k.name == name; });
  return known ? "" : fmt::format("unknown kernel '{}'\n{}", name, kernel_help());
}

const EvalKernel& find_kernel(const std::string& name) {
  return *std::find_if(kEvalKernels.begin(), kEvalKernels.end(), [&](const auto& k) { return k.name == name; });
}

int run(const EvalKernel& kernel, const std::string& folder, const EvalOptions& options, bool json) {
  if (kernel.run_folder != nullptr) return print(kernel.run_folder(folder, options), json) ? 0 : 1;
  const auto recording = wasp::drivers::Recording::open(folder);
  for (const std::string& problem : recording.problems()) fmt::print(stderr, "skipped: {}\n", problem);
  if (!json)
    fmt::print("{} on {} ({} layout, {} entries, {} skipped)\n", kernel.name, folder, recording.layout(),
               recording.entries().size(), recording.problems().size());
  return print(kernel.run(recording, options), json) ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 1 && std::string_view(argv[1]) == "mavlink") return eval_mavlink_main(argc - 1, argv + 1);
  CLI::App app{"Runs a vision kernel over a recording and prints detection, error and time per frame.", "wasp-eval"};
  app.footer(kernel_help());
  std::string kernel, folder;
  bool json = false;
  EvalOptions options;
  app.add_option("KERNEL", kernel, "what to run (see below)")->required()->check(check_kernel);
  app.add_option("DIR", folder, "folder of the recording")->required();
  app.add_flag("--json", json, "one JSON object a figure and line");
  app.add_option("--repeat", options.repeat, "passes over the recording")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  app.add_flag("--cold", options.cold, "forget the previous frame before each one");
  CLI11_PARSE(app, argc, argv);
  try {
    return run(find_kernel(kernel), folder, options, json);
  } catch (const std::exception& error) {
    fmt::print(stderr, "wasp-eval: {}\n", error.what());
    return 2;
  }
}
