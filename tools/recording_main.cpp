// wasp-recording DIR: what a folder of recorded data is: layout, frames, rate, gaps, streams beside them, and
// everything that is wrong with it, by file and line, with a count of each kind. Exit code 0: whole; 1: usable, with
// problems; 2: no recording; others: usage (CLI11).
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

#include "tools/recording_facts.h"

int main(int argc, char** argv) {
  using namespace wasp;
  CLI::App app{"Says what a folder of recorded data is and what is wrong with it. docs/recordings.md",
               "wasp-recording"};
  std::string folder;
  bool json = false, decode = false;
  app.add_option("DIR", folder, "folder of the recording")->required();
  app.add_flag("--json", json, "one JSON object");
  app.add_flag("--decode", decode, "decode every image, not only its header and end");
  CLI11_PARSE(app, argc, argv);
  try {
    const auto recording = drivers::Recording::open(folder);
    const tools::RecordingFacts facts = tools::facts_of(recording, decode);
    fmt::print("{}", json ? tools::facts_json(recording, facts) : tools::facts_text(recording, facts));
    return facts.problems > 0 ? 1 : 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "wasp-recording: {}\n", error.what());
    return 2;
  }
}
