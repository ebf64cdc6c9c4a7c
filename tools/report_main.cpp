// wasp-report: turns the logs of a run into DIR/report.html.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>

#include "tools/report_data.h"
#include "tools/report_page.h"

int main(int argc, char** argv) {
  std::filesystem::path directory, output;
  CLI::App app{"Writes DIR/report.html from DIR/run.json and DIR/log/. The page needs no network."};
  app.name("wasp-report");
  app.add_option("DIR", directory, "Folder of the run")->required();
  app.add_option("--out", output, "Another file to write");
  CLI11_PARSE(app, argc, argv);
  if (output.empty()) output = directory / "report.html";
  try {
    const auto data = wasp::tools::read_report_data(directory);
    std::ofstream file(output, std::ios::binary | std::ios::trunc);
    file << wasp::tools::report_page(data) << std::flush;
    if (!file) throw std::runtime_error("cannot write '" + output.string() + "'");
    for (const auto& remark : data.remarks) fmt::print(stderr, "wasp-report: {}\n", remark);
    fmt::print("{}\n", output.string());
  } catch (const std::exception& error) {
    fmt::print(stderr, "wasp-report: {}\n", error.what());
    return 1;
  }
  return 0;
}
