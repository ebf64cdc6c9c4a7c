#include "tools/report_page.h"

#include <fmt/format.h>

#include <array>
#include <iterator>

#include "tools/report_figures.h"
#include "tools/report_histogram.h"
#include "tools/report_plot.h"

namespace wasp::tools {
namespace {

using nlohmann::json;
using Out = std::back_insert_iterator<std::string>;

const json& list_at(const json& object, const char* key) {
  static const json kEmpty = json::array();
  return object.contains(key) && object.at(key).is_array() ? object.at(key) : kEmpty;
}

/// nullopt where nothing was to be met.
std::optional<bool> verdict(const json& result) {
  const bool judged =
      result.is_object() && !text_at(result, "bar").empty() && result.contains("ok") && result["ok"].is_boolean();
  return judged ? std::optional<bool>(result["ok"].get<bool>()) : std::nullopt;
}

/// What the launcher says, else what the flight process says of itself.
std::optional<bool> real_time(const ReportData& data) {
  if (data.run.contains("real_time") && data.run["real_time"].is_boolean()) return data.run["real_time"].get<bool>();
  return data.status.present ? std::optional<bool>(data.status.real_time) : std::nullopt;
}

std::string paragraph(const std::string& html, const char* style = "") {
  return html.empty() ? "" : fmt::format("<p class='{}'>{}</p>\n", style, html);
}

void heading(const ReportData& data, Out out) {
  std::string name = text_at(data.run, "name");
  if (name.empty()) name = std::filesystem::absolute(data.directory).lexically_normal().filename().string();
  const Outcome outcome = outcome_of(data);
  fmt::format_to(out, "<h1>Flight {}</h1>\n", escape_html(name));
  fmt::format_to(out, "<p class='outcome {}'>{}</p>\n",
                 !outcome.good   ? ""
                 : *outcome.good ? "good"
                                 : "bad",
                 escape_html(outcome.text));
  const std::string note = text_at(data.run, "mode_note");
  const auto is_real_time = real_time(data);
  if (is_real_time && !*is_real_time)
    fmt::format_to(
        out, "<p class='banner'>NOT REAL TIME{}. Every latency below was measured without real-time scheduling.</p>\n",
        note.empty() ? "" : ": " + escape_html(note));
  if (!is_real_time)
    fmt::format_to(out, "<p class='banner'>It is not recorded whether this flight was real time.</p>\n");
  if (data.status.faults_armed)
    fmt::format_to(out,
                   "<p class='banner'>FAULTS ARMED: fault points existed in this flight{}. What was thrown when is in "
                   "log/flight.txt.</p>\n",
                   text_at(data.run, "faults").empty() ? "" : ": " + escape_html(text_at(data.run, "faults")));
}

void facts(const ReportData& data, Out out) {
  constexpr std::array<std::array<const char*, 2>, 10> kFacts = {{{"Started", "started"},
                                                                  {"Mission", "mission"},
                                                                  {"Planned flight time [s]", "seconds"},
                                                                  {"Ended", "exit_reason"},
                                                                  {"Camera", "camera"},
                                                                  {"Seed", "seed"},
                                                                  {"Kernel", "kernel"},
                                                                  {"Scheduler", "scheduler"},
                                                                  {"Host", "host"},
                                                                  {"Command line", "command_line"}}};
  std::string rows;
  for (const auto& [name, key] : kFacts)
    if (const std::string value = text_at(data.run, key); !value.empty())
      rows += fmt::format("<dt>{}</dt><dd>{}</dd>", name, escape_html(value));
  if (!rows.empty()) fmt::format_to(out, "<div class='card'><dl>{}</dl></div>\n", rows);
}

void remarks(const ReportData& data, Out out) {
  if (data.remarks.empty()) return;
  fmt::format_to(out, "<h2>Missing or lost</h2>\n<div class='card'><ul>");
  for (const auto& remark : data.remarks) fmt::format_to(out, "<li>{}</li>", escape_html(remark));
  fmt::format_to(out, "</ul></div>\n");
}

void result_row(const json& r, Out out) {
  const auto met = verdict(r);
  fmt::format_to(out, "<tr><td>{}</td><td class='n'>{} {}</td><td class='n'>{}</td><td class='state {}'>{}</td></tr>\n",
                 escape_html(text_at(r, "name")), escape_html(text_at(r, "value")), escape_html(text_at(r, "unit")),
                 escape_html(text_at(r, "bar")),
                 !met   ? "soft"
                 : *met ? "good"
                        : "bad",
                 !met   ? "no bar"
                 : *met ? "&#10003; met"
                        : "&#10007; missed");
}

void results(const ReportData& data, Out out) {
  fmt::format_to(out, "<h2>Results against their bars</h2>\n");
  const json& rows = list_at(data.run, "results");
  if (rows.empty()) {
    fmt::format_to(out, "<p class='soft'>No results were recorded for this flight.</p>\n");
    return;
  }
  fmt::format_to(out,
                 "<div class='card scroll'><table><tr><th>Figure</th><th class='n'>Value</th><th "
                 "class='n'>Bar</th><th></th></tr>\n");
  for (const auto& r : rows) result_row(r, out);
  fmt::format_to(out, "</table></div>\n");
}

void figure(const char* title, const std::string& svg, const char* absent, Out out) {
  fmt::format_to(out, "<div class='card'><h3>{}</h3>{}</div>\n", title,
                 svg.empty() ? paragraph(absent, "soft small") : "<div class='scroll'>" + svg + "</div>");
}

void figures(const ReportData& data, Out out) {
  fmt::format_to(out, "<h2>The flight</h2>\n<div class='wide'>");
  figure("Altitude", altitude_figure(data), "No heights were recorded.", out);
  fmt::format_to(out, "</div>\n<div class='pair' style='margin-top:16px'>");
  figure("Error of the height estimates", height_error_figure(data), "Heights or truth were not recorded.", out);
  figure("Ground track (truth, from above)", path_figure(data), "No truth was recorded.", out);
  figure("Roll and pitch", attitude_figure(data), "No attitude was recorded.", out);
  figure("Thrust", thrust_figure(data), "No commands were recorded.", out);
  fmt::format_to(out, "</div>\n");
}

/// Each change of mode or reason, at most 60.
void mode_changes(const ReportData& data, Out out) {
  if (!data.commands || data.commands->rows() == 0) return;
  const auto t = data.commands->integers("due_at_ns");
  const auto mode = data.commands->texts("mode_name"), reason = data.commands->texts("reason_name");
  fmt::format_to(out,
                 "<h2>Changes of flight mode</h2>\n<div class='card scroll'><table><tr><th "
                 "class='n'>Time</th><th>Mode</th><th>Reason</th></tr>\n");
  std::size_t shown = 0, more = 0;
  for (std::size_t i = 0; i < t.size(); ++i) {
    if (i > 0 && mode[i] == mode[i - 1] && reason[i] == reason[i - 1]) continue;
    if (++shown > 60)
      ++more;
    else
      fmt::format_to(out, "<tr><td class='n'>{:.2f} s</td><td>{}</td><td>{}</td></tr>\n", data.seconds(t[i]),
                     escape_html(mode[i]), escape_html(reason[i]));
  }
  fmt::format_to(out, "</table>{}</div>\n", more > 0 ? fmt::format("<p class='soft small'>and {} more</p>", more) : "");
}

std::string machine_line(const ReportData& data) {
  std::string line;
  for (const char* key : {"kernel", "scheduler", "host"})
    if (const auto text = text_at(data.run, key); !text.empty()) line += (line.empty() ? "" : "; ") + text;
  if (line.empty()) line = "Kernel, scheduler and host are not recorded";
  const auto is_real_time = real_time(data);
  return escape_html(line) + (is_real_time && !*is_real_time ? "; <strong>not real time</strong>" : "") + ".";
}

void latency_table(const ReportData& data, Out out) {
  fmt::format_to(out, "<div class='card scroll'><table><tr><th>Owner</th><th>Stage</th>");
  for (const char* name : {"Count", "p50", "p99", "p99.9", "Max", "Budget", "Misses"})
    fmt::format_to(out, "<th class='n'>{}</th>", name);
  fmt::format_to(out, "</tr>\n");
  for (const auto& s : data.stages) {
    fmt::format_to(out, "<tr><td>{}</td><td>{}</td><td class='n'>{}</td>", escape_html(s.owner), escape_html(s.stage),
                   s.count);
    for (const auto ns : {s.p50_ns, s.p99_ns, s.p999_ns, s.max_ns})
      fmt::format_to(out, "<td class='n'>{}</td>", s.count > 0 ? duration_text(ns) : "-");
    fmt::format_to(out, "<td class='n'>{}</td><td class='n {}'>{}</td></tr>\n",
                   s.budget_ns > 0 ? duration_text(s.budget_ns) : "-", s.misses > 0 ? "bad" : "",
                   s.budget_ns > 0 ? std::to_string(s.misses) : "-");
  }
  fmt::format_to(out, "</table></div>\n");
}

void histograms(const ReportData& data, Out out) {
  const LogRange range = log_range_of(data.stages);
  fmt::format_to(out, "<div class='pair' style='margin-top:16px'>\n");
  for (const auto& s : data.stages) {
    if (s.count == 0 || s.buckets.empty()) continue;
    fmt::format_to(out,
                   "<div class='card'><h3>{}: {}</h3><p class='soft small'>{} samples, p50 {}, p99 {}, p99.9 {}, max "
                   "{}{}</p><div class='scroll'>{}</div></div>\n",
                   escape_html(s.owner), escape_html(s.stage), s.count, duration_text(s.p50_ns),
                   duration_text(s.p99_ns), duration_text(s.p999_ns), duration_text(s.max_ns),
                   s.budget_ns > 0 ? fmt::format("; budget {}, {} missed", duration_text(s.budget_ns), s.misses) : "",
                   histogram_svg(s, range));
  }
  fmt::format_to(out, "</div>\n");
}

void latencies(const ReportData& data, Out out) {
  fmt::format_to(out, "<h2>Latency</h2>\n{}", paragraph(machine_line(data), "soft small"));
  if (data.stages.empty()) {
    fmt::format_to(out, "<p class='soft'>No latencies were recorded.</p>\n");
    return;
  }
  latency_table(data, out);
  histograms(data, out);
}

void counters(const ReportData& data, Out out) {
  if (!data.status.present) return;
  const RunSummary& s = data.status;
  fmt::format_to(out, "<h2>Counters of the flight process</h2>\n<div class='card scroll'><table><tr>");
  for (const char* name : {"Ticks", "Skipped", "Deadline misses", "Minor faults", "Major faults", "Frames lost",
                           "Bad link frames", "Reconnects", "Incidents", "Refused as too old", "Setpoints flushed"})
    fmt::format_to(out, "<th class='n'>{}</th>", name);
  fmt::format_to(out, "</tr><tr>");
  for (const auto n : {s.ticks, s.skipped, s.deadline_misses, s.minor_faults, s.major_faults, s.frames_lost,
                       s.bad_frames, s.link_reconnects, s.incidents, s.commands_refused, s.setpoints_flushed})
    fmt::format_to(out, "<td class='n'>{}</td>", n);
  fmt::format_to(out, "</tr></table></div>\n");
  if (!s.autopilot.empty())
    fmt::format_to(out, "{}", paragraph("Check before arming: " + escape_html(s.autopilot), "soft small"));
}

}  // namespace

Outcome outcome_of(const ReportData& data) {
  std::size_t judged = 0, missed = 0;
  for (const auto& r : list_at(data.run, "results"))
    if (const auto met = verdict(r)) {
      ++judged;
      if (!*met) ++missed;
    }
  const std::string end = text_at(data.run, "exit_reason").empty() ? "" : "; " + text_at(data.run, "exit_reason");
  if (judged == 0) return {"Recorded, not judged: no result has a bar" + end + ".", std::nullopt};
  if (missed == 0) return {fmt::format("Succeeded: all {} bars met{}.", judged, end), true};
  return {fmt::format("Did not succeed: {} of {} bars missed{}.", missed, judged, end), false};
}

std::string report_page(const ReportData& data) {
  std::string page;
  const Out out(page);
  fmt::format_to(
      out,
      "<!DOCTYPE html>\n<html lang='en'><head><meta charset='utf-8'>\n"
      "<meta name='viewport' content='width=device-width, initial-scale=1'>\n<title>Flight {}</title>\n<style>",
      escape_html(text_at(data.run, "name")));
  page += report_style();
  fmt::format_to(out, "</style></head>\n<body><main>\n");
  heading(data, out);
  facts(data, out);
  results(data, out);
  remarks(data, out);
  figures(data, out);
  mode_changes(data, out);
  latencies(data, out);
  counters(data, out);
  fmt::format_to(
      out, "<p class='soft small'>Written by wasp-report from the logs beside this file.</p>\n</main></body></html>\n");
  return page;
}

}  // namespace wasp::tools
