#include "calibration/solution_file.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <ctime>
#include <fstream>
#include <stdexcept>

namespace wasp::calibration {
namespace {

namespace fs = std::filesystem;

void write_whole(const fs::path& file, const std::string& text) {
  if (file.has_parent_path()) fs::create_directories(file.parent_path());
  fs::path beside = file;
  beside += ".part";
  std::ofstream out(beside, std::ios::binary | std::ios::trunc);
  out << text << std::flush;
  if (!out) throw std::runtime_error(file.string() + ": cannot be written");
  out.close();
  fs::rename(beside, file);
}

}  // namespace

std::string solution_toml(const Solution& solution, std::string_view name, const std::string& date) {
  std::string out = fmt::format("# By `wasp calibrate {}`. A flight takes it: --config FILE.\n", name);
  for (const auto& note : solution.notes) out += "# " + note + "\n";
  for (const auto& section : solution.flight) out += "\n" + section.toml();
  TomlSection head(fmt::format("calibration.{}", name));
  head.text("date", date)
      .text("source", solution.source)
      .whole("samples", static_cast<long long>(solution.samples))
      .number("residual_rms", solution.residual_rms, solution.residual_unit);
  out += "\n" + head.toml();
  for (const auto& line : solution.evidence.lines()) out += line + "\n";
  return out;
}

std::vector<fs::path> write_solution(const Solution& solution, std::string_view name, const fs::path& out) {
  std::vector<fs::path> written{out};
  write_whole(out,
              solution_toml(solution, name, fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)))));
  for (const Picture& picture : solution.pictures) {
    fs::path file = out;
    file.replace_extension();
    file += "_" + picture.name + ".svg";
    write_whole(file, picture.svg);
    written.push_back(file);
  }
  return written;
}

}  // namespace wasp::calibration
