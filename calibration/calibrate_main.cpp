// wasp-calibrate CALIBRATION ...: fits what a sensor needs from recorded data, writes TOML and pictures, or refuses.
// Exit code 0: written; 1: refused, the data do not determine the answer (nothing is written); 2: the data cannot be
// read; others: usage (CLI11).
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <memory>

#include "calibration/calibrations.h"
#include "calibration/solution_file.h"

namespace {

using namespace wasp::calibration;

struct Chosen {
  const Calibration* row = nullptr;
  std::function<Solution(ProgressBar&)> run;
  std::string out;
};

/// One subcommand: the options of the row, and --out.
void add_subcommand(CLI::App& app, const Calibration& row, Chosen& chosen) {
  CLI::App* sub = app.add_subcommand(std::string(row.name), std::string(row.what));
  sub->option_defaults()->always_capture_default();
  auto run = row.prepare(*sub);
  auto out = std::make_shared<std::string>(std::string(row.name) + ".toml");
  sub->add_option("--out", *out, "TOML file to write; pictures come beside it");
  sub->callback([&chosen, &row, run, out] { chosen = {&row, run, *out}; });
}

void print(const Solution& s, const std::vector<std::filesystem::path>& files) {
  for (const auto& section : s.flight) fmt::print("{}\n", section.toml());
  for (const auto& line : s.evidence.lines()) fmt::print("  {}\n", line);
  fmt::print("  {} samples, residual {:.4g} {} rms\n", s.samples, s.residual_rms, s.residual_unit);
  for (const auto& note : s.notes) fmt::print("note: {}\n", note);
  for (const auto& file : files) fmt::print("written: {}\n", file.string());
}

int run(const Chosen& chosen) {
  ProgressBar bar(fmt::format("wasp calibrate {}", chosen.row->name));
  const Solution solution = chosen.run(bar);
  bar.show(1, "done");
  print(solution, write_solution(solution, chosen.row->name, chosen.out));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Calibrates sensors from recorded data: writes a TOML file that `wasp flight --config` takes and a picture of "
      "the\n"
      "residuals, or refuses (exit code 1) where the data do not determine the answer. docs/calibration.md",
      "wasp-calibrate"};
  app.require_subcommand(1);
  Chosen chosen;
  for (const Calibration& row : calibrations()) add_subcommand(app, row, chosen);
  CLI11_PARSE(app, argc, argv);
  try {
    return run(chosen);
  } catch (const Refusal& refusal) {
    fmt::print(stderr, "\nwasp-calibrate {}: refused: {}\n", chosen.row->name, refusal.what());
    return 1;
  } catch (const std::exception& error) {
    fmt::print(stderr, "\nwasp-calibrate {}: {}\n", chosen.row->name, error.what());
    return 2;
  }
}
