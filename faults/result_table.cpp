#include "faults/result_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <span>

#include "control/flight_mode.h"
#include "faults/catalogue.h"
#include "rt/process.h"

namespace wasp::faults {
namespace {

std::string ms(const std::optional<double>& value) { return value ? fmt::format("{:.1f}", *value) : "-"; }

std::string response(const CellResult& r) {
  if (r.verdict == Verdict::kSkipped || r.cell.fault->injector == Injector::kStart) return "-";
  if (r.reaction.guardian) return "guardian";
  if (r.reaction.stream_ended && r.reaction.detected_ms) return "stop";
  return r.reaction.alarmed ? control::name_of(r.reaction.mode) : r.reaction.detected_ms ? "told" : "none";
}

nlohmann::json number(const std::optional<double>& value) { return value ? nlohmann::json(*value) : nlohmann::json(); }

}  // namespace

std::string table_head() {
  return fmt::format("{:<30} {:<8} {:>4} {:>9} {:<9} {:>9} {:>10} {:<22} {:>5} {}", "fault", "phase", "seed",
                     "detected", "response", "after", "recovered", "outcome", "lost", "verdict");
}

std::string table_row(const CellResult& r) {
  const bool flown = r.verdict != Verdict::kSkipped && r.cell.fault->injector != Injector::kStart;
  const Reaction& a = r.reaction;
  return fmt::format("{:<30} {:<8} {:>4} {:>9} {:<9} {:>9} {:>10} {:<22} {:>5} {}{}", r.cell.fault->id,
                     r.cell.fault->injector == Injector::kStart ? "start" : name_of(r.cell.phase), r.cell.seed,
                     flown ? ms(a.detected_ms) : "-", response(r), flown && a.detected_ms ? ms(a.response_ms) : "-",
                     flown ? ms(a.recovered_ms) : "-", r.outcome, r.records_lost, name_of(r.verdict),
                     r.why.empty() ? "" : ": " + r.why);
}

std::string table_foot(const std::vector<CellResult>& results) {
  std::array<std::size_t, 4> counts{};
  std::string text;
  for (const CellResult& r : results) {
    ++counts[static_cast<std::size_t>(r.verdict)];
    constexpr std::size_t kMost = 5;  // of a cell; the JSON file has all
    for (const Violation& v : std::span(r.violations).first(std::min(kMost, r.violations.size())))
      text += fmt::format("  {} {}: {} at {:.6f} s, {:.4g}, {}\n", r.cell.fault->id, name_of(r.cell.phase),
                          name_of(v.offence), to_seconds(v.at_ns), v.value, v.bytes);
  }
  if (!text.empty()) text = "violations on the wire:\n" + text;
  return text + fmt::format("{} cells: {} ok, {} MISS, {} host noise, {} skipped\n", results.size(), counts[0],
                            counts[1], counts[2], counts[3]);
}

std::string catalogue_list() {
  std::string text = fmt::format("{:<30} {:>5} {:<14} {:>8} {:>8} {:>9}  {}\n", "fault", "class", "promise", "detected",
                                 "response", "recovered", "phases");
  const auto bar = [](double limit_ms) { return limit_ms > 0 ? fmt::format("{:.0f} ms", limit_ms) : std::string("-"); };
  for (const Fault& f : catalogue()) {
    std::string phases;
    for (const Phase phase : kPhases)
      if (f.injector != Injector::kStart && (f.phases & bit(phase)) != 0) phases += std::string(name_of(phase)) + " ";
    text += fmt::format("{:<30} {:>5} {:<14} {:>8} {:>8} {:>9}  {}\n", f.id, f.class_number, name_of(f.promise),
                        bar(f.detected_ms), bar(f.response_ms), bar(f.recovered_ms), phases.empty() ? "start" : phases);
  }
  return text + fmt::format("{} faults\n", catalogue().size());
}

std::string to_json(const std::vector<CellResult>& results, const Abilities& abilities) {
  nlohmann::json cells = nlohmann::json::array();
  for (const CellResult& r : results) {
    nlohmann::json violations = nlohmann::json::array();
    for (const Violation& v : r.violations)
      violations.push_back({{"offence", name_of(v.offence)},
                            {"at_ns", v.at_ns},
                            {"value", v.value},
                            {"held_ms", v.held_ms},
                            {"bytes", v.bytes}});
    cells.push_back({{"fault", r.cell.fault->id},
                     {"class", r.cell.fault->class_number},
                     {"phase", name_of(r.cell.phase)},
                     {"seed", r.cell.seed},
                     {"promise", name_of(r.cell.fault->promise)},
                     {"detected_ms", number(r.reaction.detected_ms)},
                     {"response", response(r)},
                     {"response_ms", number(r.reaction.response_ms)},
                     {"recovered_ms", number(r.reaction.recovered_ms)},
                     {"reason", control::name_of(r.reaction.reason)},
                     {"outcome", r.outcome},
                     {"records_lost", r.records_lost},
                     {"verdict", name_of(r.verdict)},
                     {"why", r.why},
                     {"folder", r.folder.string()},
                     {"violations", violations}});
  }
  return nlohmann::json({{"host", rt::host_description()},
                         {"kernel", rt::kernel_description()},
                         {"real_time", abilities.real_time},
                         {"guardian", abilities.guardian},
                         {"fault_points", abilities.fault_points},
                         {"cells", cells}})
      .dump(1);
}

}  // namespace wasp::faults
