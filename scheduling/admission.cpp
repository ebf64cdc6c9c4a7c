#include "scheduling/admission.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>

#include "rt/thread.h"

namespace wasp::scheduling {
namespace {

double milliseconds(DurationNs ns) { return static_cast<double>(ns) / kMillisecond; }

AnalysedThread analysed(const ThreadRow& row, DurationNs period_ns, DurationNs deadline_ns, const Config& c) {
  AnalysedThread t;
  t.name = row.name;
  t.core = rt::nearest_usable_core(row.core);
  t.priority = row.priority;
  t.period_ns = period_ns;
  t.deadline_ns = std::min(deadline_ns, period_ns);
  t.cost_ns = row.budget_ns;
  t.blocking_ns = c.blocking_ns;
  return t;
}

std::vector<AnalysedThread> table_of(const Config& c, DurationNs frame_period_ns, bool with_camera) {
  std::vector<AnalysedThread> threads;
  threads.push_back(analysed(c.control_thread, c.control_period_ns, c.control_deadline_ns, c));
  threads.push_back(analysed(c.link_thread, c.link_period_ns, c.link_period_ns, c));
  if (with_camera) threads.push_back(analysed(c.camera_thread, frame_period_ns, frame_period_ns, c));
  const DurationNs down_period_ns = from_seconds(1.0 / c.camera_down.rate_hz);
  for (const auto& b : c.behaviours) {
    const DurationNs period_ns = b.looks_down ? down_period_ns : frame_period_ns;
    if (b.enabled) threads.push_back(analysed(b, period_ns, period_ns, c));
  }
  std::stable_sort(threads.begin(), threads.end(),
                   [](const auto& a, const auto& b) { return a.priority > b.priority; });
  return threads;
}

/// "edge_altitude: R > 33.3 ms = its deadline; delayed by control 2.0 ms, ...".
std::string reason_of(const Plan& plan, std::size_t i) {
  const PlanRow& row = plan.rows[i];
  const DurationNs deadline_ns = row.thread.deadline_ns;
  std::string text =
      row.response.bounded
          ? fmt::format("{}: R = {:.3f} ms is beyond its deadline of {:.3f} ms", row.thread.name,
                        milliseconds(row.response.response_ns), milliseconds(deadline_ns))
          : fmt::format("{}: R grows beyond its deadline of {:.3f} ms (reached {:.3f} ms)", row.thread.name,
                        milliseconds(deadline_ns), milliseconds(row.response.response_ns));
  text += fmt::format("; its own {:.3f} ms", milliseconds(row.thread.cost_ns));
  if (row.thread.blocking_ns > 0) text += fmt::format(", blocking {:.3f} ms", milliseconds(row.thread.blocking_ns));
  for (std::size_t k = 0; k < row.response.delayed_by.size(); ++k)
    text += fmt::format(", {} {:.3f} ms", plan.rows[row.response.delayed_by[k]].thread.name,
                        milliseconds(row.response.delay_ns[k]));
  return text;
}

}  // namespace

MeasuredCosts read_measured_costs(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error("cannot read measured stages '" + path + "'");
  MeasuredCosts costs;
  try {
    const auto document = nlohmann::json::parse(file);
    for (const auto& row : document.at("stages")) {
      const std::string stage = row.at("stage");
      if (row.at("count").get<std::uint64_t>() > 0 && (stage == "compute" || stage == "write"))
        costs[row.at("owner").get<std::string>()] += row.at("max_ns").get<DurationNs>();
    }
  } catch (const nlohmann::json::exception& e) {
    throw std::runtime_error("measured stages '" + path + "': " + e.what());
  }
  if (costs.empty()) throw std::runtime_error("measured stages '" + path + "': no thread has a measured 'compute'");
  return costs;
}

Plan make_plan(const Config& config, DurationNs frame_period_ns, bool with_camera, const MeasuredCosts& measured) {
  std::vector<AnalysedThread> threads = table_of(config, frame_period_ns, with_camera);
  Plan plan;
  std::set<int> cores;
  for (auto& t : threads) {
    const auto it = measured.find(t.name);
    if (it != measured.end()) t.cost_ns = std::max<DurationNs>(it->second, 1);
    plan.rows.push_back({t, {}, it != measured.end()});
    cores.insert(t.core);
  }
  plan.cores.assign(cores.begin(), cores.end());
  const auto responses = response_times(threads);
  for (std::size_t i = 0; i < responses.size(); ++i) plan.rows[i].response = responses[i];
  for (std::size_t i = 0; i < responses.size(); ++i)
    if (!responses[i].meets_deadline) {
      plan.schedulable = false;
      plan.reasons.push_back(reason_of(plan, i));
    }
  return plan;
}

std::string plan_json(const Plan& plan) {
  nlohmann::json doc{{"schedulable", plan.schedulable}, {"reasons", plan.reasons}};
  std::vector<AnalysedThread> threads;
  for (const auto& row : plan.rows) {
    nlohmann::json delays = nlohmann::json::object();
    for (std::size_t k = 0; k < row.response.delayed_by.size(); ++k)
      delays[plan.rows[row.response.delayed_by[k]].thread.name] = row.response.delay_ns[k];
    const AnalysedThread& t = row.thread;
    threads.push_back(t);
    doc["threads"].push_back({{"name", t.name},
                              {"core", t.core},
                              {"priority", t.priority},
                              {"period_ns", t.period_ns},
                              {"deadline_ns", t.deadline_ns},
                              {"cost_ns", t.cost_ns},
                              {"cost_source", row.measured ? "measured" : "configured"},
                              {"jitter_ns", t.jitter_ns},
                              {"blocking_ns", t.blocking_ns},
                              {"response_ns", row.response.response_ns},
                              {"response_bounded", row.response.bounded},
                              {"delays_ns", delays},
                              {"schedulable", row.response.meets_deadline}});
  }
  for (const int core : plan.cores)
    doc["cores"].push_back({{"core", core}, {"utilisation", utilisation(threads, core)}});
  return doc.dump();
}

}  // namespace wasp::scheduling
