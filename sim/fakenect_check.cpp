#include "sim/fakenect_check.h"

#include <array>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <stdexcept>

namespace wasp::sim {
namespace {

namespace fs = std::filesystem;

struct Kind {
  char letter;
  const char* header;  ///< of its files; "": none
  std::uintmax_t payload_bytes;
};
constexpr std::array<Kind, 3> kKinds{{{'r', "P6 640 480 255\n", 640 * 480 * 3},
                                      {'d', "P5 640 480 65535\n", 640 * 480 * 2},
                                      {'a', "", 12}}};

/// Empty: nothing.
std::string problem_of(const fs::path& folder, const std::string& name, double& last_arrival_s) {
  char letter = 0;
  double arrival_s = 0;
  unsigned ticks = 0;
  if (name.find('/') != std::string::npos || std::sscanf(name.c_str(), "%c-%lf-%u.", &letter, &arrival_s, &ticks) != 3)
    return "no name of the form KIND-TIME-TICKS.EXTENSION";
  const Kind* kind = nullptr;
  for (const Kind& k : kKinds)
    if (k.letter == letter) kind = &k;
  if (kind == nullptr) return std::string("kind '") + letter + "' is none of r, d, a";
  std::ifstream in(folder / name, std::ios::binary);
  if (!in || !fs::is_regular_file(folder / name)) return "missing";
  const std::string header = kind->header;
  std::string begin(header.size(), '\0');
  in.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  if (begin != header) return "does not begin with \"" + header.substr(0, header.size() - (header.empty() ? 0 : 1)) + '"';
  if (fs::file_size(folder / name) != header.size() + kind->payload_bytes)
    return std::to_string(fs::file_size(folder / name)) + " bytes instead of " +
           std::to_string(header.size() + kind->payload_bytes);
  if (arrival_s < last_arrival_s) return "arrived before the entry above it";
  last_arrival_s = arrival_s;
  return {};
}

}  // namespace

FakenectReport check_fakenect(const fs::path& folder) {
  std::ifstream index(folder / "INDEX.txt");
  if (!index) throw std::runtime_error((folder / "INDEX.txt").string() + ": cannot open");
  FakenectReport report;
  double last_arrival_s = 0;
  std::string name;
  while (std::getline(index, name)) {
    ++report.entries;
    const std::string problem = problem_of(folder, name, last_arrival_s);
    if (problem.empty())
      report.good.push_back(name);
    else
      report.problems.push_back((folder / "INDEX.txt").string() + ":" + std::to_string(report.entries) + ": " + name +
                                ": " + problem);
  }
  return report;
}

void write_fakenect_index(const fs::path& folder, const FakenectReport& report) {
  const fs::path index = folder / "INDEX.txt", before = folder / "INDEX.txt.before";
  if (!fs::exists(before)) fs::rename(index, before);
  std::ofstream out(index);
  for (const auto& name : report.good) out << name << '\n';
  out.flush();
  if (!out) throw std::runtime_error(index.string() + ": cannot write");
}

}  // namespace wasp::sim
