#include "missions/reproduce.h"

#include <fmt/format.h>

#include <cmath>

#include "tools/report_page.h"

namespace wasp::missions {

const std::vector<Experiment>& experiments() {
  static const std::vector<Experiment> kExperiments{
      {"turntable", 5, 1, "Yaw rate on a turntable", "fig. 5.6a",
       "The one constant of the visual yaw rate was fitted here. No error is given."},
      {"hover-yaw", 5, 1, "Yaw rate in stable hover", "fig. 5.6b",
       "The visual estimate of the yaw rate correlates with the actual yaw rate; no number is given."},
      {"aggressive", 5, 1, "Yaw rate in aggressive flight", "fig. 5.6c",
       "As before, flown hard in a busy environment."},
      {"wall", 100, 4, "Time to contact: straight at a wall", "figs 5.9, 5.10",
       "Time to contact fell to zero at the true frame of impact; it was cut down to one bit, 'avoid', raised when the "
       "line "
       "through five estimates meets zero within 30 frames with p < 0.05."},
      {"corridor-empty", 100, 4, "Balance: straight empty corridor", "figs 6.8, 6.9",
       "'The real flight performance was disappointing': it 'oscillated in a stable limit-cycle manner between "
       "opposite "
       "sides of the corridor'."},
      {"corridor", 100, 4, "Balance and obstacles: corridor with cartons and walking people", "figs 6.8, 6.9",
       "'The large magnitude of motion from the limit cycling exceeded the signal from small obstacles, so they were "
       "not "
       "detected reliably.'"},
      {"bee", 20, 2, "As a bee: centring, speed and heading by image motion alone", "2.1.4.1, 2.1.4.3, 2.1.4.4",
       "Described of honeybees and flies; not flown."},
      {"hover", 5, 1, "Hover by the ground plane", "fig. 6.20",
       "Regulated its altitude at 0.5 m and 1.0 m for 40 s each, swinging by about 10 cm, quantised by the Hough "
       "bins."},
      {"edge-height", 10, 2, "Height from edges in flight, lambda found from climbs", "8.1.3",
       "Named as future work: estimate lambda from a change of height that the IMU measures."},
      {"arena", 50, 4, "Straw's arena: height follows the edge", "fig. 7.19",
       "The simulated vehicle adjusts its altitude to the changing position of a horizontal edge, as flies do."},
      {"city-max", 100, 4, "City: maximum peak avoidance", "fig. 7.20",
       "100 of 100 runs avoided the buildings, flying unnecessarily high."},
      {"city-near", 100, 4, "City: maximum near-peak avoidance by depth", "fig. 7.21",
       "Avoided obstacles without flying unnecessarily high; 'sometimes a strong response and overshoot is observed'."},
      {"city-defocus", 100, 4, "City: maximum near-peak avoidance by defocus", "fig. 7.24",
       "Flew over the benches; the second trial 'overshoots the setpoint and flies too high'."},
      {"landing", 10, 2, "Grazing landing at constant ventral flow", "2.1.4.6", "Described of honeybees; not flown."},
      {"all", 1, 0, "All behaviours at once", "ch. 8", "Proposed as the next step; not flown."},
  };
  return kExperiments;
}

namespace {

using tools::escape_html;

std::string results_table(const CampaignResult& c) {
  std::string t = "<table><tr><th>Figure</th><th class='n'>Value</th><th class='n'>Bar</th><th></th></tr>\n";
  for (const auto& r : c.results)
    t += fmt::format(
        "<tr><td>{}</td><td class='n'>{:.4g} {}</td><td class='n'>{}</td><td class='state {}'>{}</td></tr>\n",
        escape_html(r.name), r.value, escape_html(r.unit), escape_html(r.bar),
        r.bar.empty() ? "soft"
        : r.ok        ? "good"
                      : "bad",
        r.bar.empty() ? "no bar"
        : r.ok        ? "&#10003; met"
                      : "&#10007; missed");
  return t + "</table>";
}

std::string how_flown(const CampaignResult& c) {
  const std::size_t n = c.runs.size();
  const std::uint32_t first = c.options.first_seed;
  return fmt::format(
      "<p class='soft small'>{} flight{}, seeds {} to {}; {:.0f} s of flight in {:.0f} s, {:.1f} &times; real time. "
      "Again: "
      "<code>wasp campaign {} --runs {} --seed {}</code>; one of them: <code>--only SEED --out DIR</code>; in real "
      "time: "
      "<code>./fly --mission {} --seed SEED</code>.</p>\n",
      n, n == 1 ? "" : "s", first, first + n - 1, c.flown_s(), c.wall_s, c.speed_up(), c.options.mission, n, first,
      c.options.mission);
}

std::string section(const ExperimentResult& r) {
  const Experiment& e = *r.experiment;
  std::string s = fmt::format("<h2 id='{}'>{} <span class='soft'>({})</span></h2>\n", e.mission, escape_html(e.title),
                              escape_html(e.thesis_figures));
  s += fmt::format("<p><strong>The thesis:</strong> {}</p>\n<div class='card scroll'>{}</div>\n",
                   escape_html(e.thesis_result), results_table(r.campaign));
  if (!r.campaign.runs.empty()) s += how_flown(r.campaign);
  for (const auto& run : r.campaign.runs)
    if (!run.error.empty()) s += fmt::format("<p class='bad'>Seed {}: {}</p>\n", run.seed, escape_html(run.error));
  for (const auto& remark : r.remarks) s += fmt::format("<p>{}</p>\n", escape_html(remark));
  for (const auto& [caption, svg] : r.figures)
    s += fmt::format("<div class='card'><h3>{}</h3><div class='scroll'>{}</div></div>\n", escape_html(caption), svg);
  return s;
}

std::string overview(const std::vector<ExperimentResult>& results) {
  std::string t =
      "<div class='card scroll'><table><tr><th>Experiment</th><th>Thesis</th><th "
      "class='n'>Flights</th><th>Outcome</th></tr>\n";
  for (const auto& r : results) {
    int judged = 0, met = 0;
    for (const auto& x : r.campaign.results) judged += x.bar.empty() ? 0 : 1, met += !x.bar.empty() && x.ok ? 1 : 0;
    const bool good = r.campaign.passed();
    t += fmt::format(
        "<tr><td><a href='#{}'>{}</a></td><td>{}</td><td class='n'>{}</td><td class='state {}'>{} of {} bars "
        "met</td></tr>\n",
        r.experiment->mission, escape_html(r.experiment->title), escape_html(r.experiment->thesis_figures),
        r.campaign.runs.size(), good ? "good" : "bad", met, judged);
  }
  return t + "</table></div>\n";
}

}  // namespace

std::string reproduction_page(const std::vector<ExperimentResult>& results, const std::string& machine) {
  std::string page = fmt::format(
      "<!doctype html><html lang='en'><head><meta charset='utf-8'><meta name='viewport' "
      "content='width=device-width,initial-scale=1'><title>wasp: the thesis' "
      "experiments</title><style>{}</style></head>"
      "<body><main><h1>The thesis' experiments, flown again</h1>\n"
      "<p>Every flight is simulated in lockstep on virtual time: the behaviours' own <code>step</code> functions, the "
      "same "
      "control, the same MAVLink bytes, in generated worlds with ground truth. {}</p>\n",
      tools::report_style(), escape_html(machine));
  page += overview(results);
  for (const auto& r : results) page += section(r);
  return page + "</main></body></html>\n";
}

}  // namespace wasp::missions
