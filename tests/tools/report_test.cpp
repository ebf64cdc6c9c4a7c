// The real wasp-report on folders written here, and the parts it is made of.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/tools/fake_flight.h"
#include "tests/tools/program.h"
#include "tools/csv_rows.h"
#include "tools/report_data.h"
#include "tools/report_page.h"
#include "tools/report_plot.h"
#include "tools/report_series.h"

namespace wasp {
namespace {

using nlohmann::json;
using test::FakeFlight;
namespace fs = std::filesystem;

/// A run of 25 s as the recorder and the launcher leave it.
void write_run(const fs::path& folder, bool all_met) {
  fs::create_directories(folder / "log");
  std::ofstream commands(folder / "log/commands.csv"), cues(folder / "log/cues.csv"), truth(folder / "log/truth.csv"),
      attitude(folder / "log/attitude.csv");
  commands << tools::command_columns() << "\n";
  cues << tools::cue_columns() << "\n";
  truth << tools::truth_columns() << "\n";
  attitude << tools::attitude_columns() << "\n";
  const TimeNs start = 1000 * kSecond;
  for (std::uint32_t n = 0; n < 25 * 500; ++n) {
    const double t = n * 0.002;
    const TimeNs now = start + static_cast<TimeNs>(n) * 2'000'000;
    const tools::RingStamp stamp{n + 1, now};
    Truth state;
    state.exposed_at_ns = now;
    state.height_m = static_cast<float>(FakeFlight::height_m(t));
    state.position_ned_m = {static_cast<float>(0.2 * std::sin(0.6 * t)),
                            static_cast<float>(0.1 * std::cos(0.43 * t) + 0.003 * t), -state.height_m};
    truth << tools::csv_row(state, stamp) << "\n";
    AttitudeSample sample;
    sample.exposed_at_ns = now;
    sample.q_ned_body = FakeFlight::tilt(t);
    if (n % 5 == 0) attitude << tools::csv_row(sample, stamp) << "\n";
    if (n % 25 == 0) commands << tools::csv_row(FakeFlight::make_command(now, n / 25, t), stamp) << "\n";
    if (n % 16 == 0) cues << tools::csv_row(FakeFlight::make_cue(0, now, n / 16, t), stamp, "ground_altitude") << "\n";
    if (n % 16 == 8) cues << tools::csv_row(FakeFlight::make_cue(1, now, n / 16, t), stamp, "edge_altitude") << "\n";
  }
  scheduling::StageTable table;
  const auto fill = [&table](const char* owner, const char* stage, DurationNs budget, DurationNs typical, int samples) {
    auto* row = table.add(owner, stage, budget);
    for (int i = 0; i < samples; ++i) {
      const double u = (i * 0.754877666 - std::floor(i * 0.754877666)),
                   v = (i * 0.569840291 - std::floor(i * 0.569840291));
      row->record(static_cast<DurationNs>(static_cast<double>(typical) *
                                          std::exp(0.18 * std::sqrt(-2 * std::log(u + 1e-9)) * std::cos(6.283 * v))));
    }
    row->record(typical * 9);
  };
  fill("control", "wake-up", 1'000'000, 45'000, 500);
  fill("control", "release to byte", 5'000'000, 210'000, 500);
  for (const char* owner : {"ground_altitude", "edge_altitude"}) {
    fill(owner, "wake-up", 0, 60'000, 780);
    fill(owner, "compute", 10'000'000, 3'400'000, 780);
    fill(owner, "age when used", 100'000'000, 22'000'000, 500);
  }
  json stages = {{"stages", json::array()}, {"run", {{"ticks", 500}, {"real_time", false}}}};
  for (std::uint32_t i = 0; i < table.count; ++i) {
    const auto& s = table.stages[i];
    json buckets = json::array();
    for (std::size_t b = 0; b < rt::Histogram::kBuckets; ++b)
      if (s.histogram.bucket(b) != 0) buckets.push_back({rt::Histogram::bucket_low(b), s.histogram.bucket(b)});
    stages["stages"].push_back({{"owner", s.owner_view()},
                                {"stage", s.stage_view()},
                                {"count", s.histogram.count()},
                                {"budget_ns", s.budget_ns},
                                {"misses", s.misses.load()},
                                {"min_ns", s.histogram.min_ns()},
                                {"max_ns", s.histogram.max_ns()},
                                {"p50_ns", s.histogram.quantile_ns(0.5)},
                                {"p99_ns", s.histogram.quantile_ns(0.99)},
                                {"p999_ns", s.histogram.quantile_ns(0.999)},
                                {"buckets", buckets}});
  }
  std::ofstream(folder / "log/stages.json") << stages;
  const auto phase = [start](const char* name, double height, int from, int to) {
    return json{
        {"name", name}, {"setpoint_m", height}, {"start_ns", start + from * kSecond}, {"end_ns", start + to * kSecond}};
  };
  const json run = {
      {"name", "hover <demo> & more"},
      {"started", "2026-01-02T03:04:05+0000"},
      {"mission", "hover"},
      {"seconds", 25},
      {"kernel", "6.1.0-test amd64 PREEMPT_DYNAMIC"},
      {"host", "a test, 2 cores"},
      {"scheduler", "SCHED_OTHER"},
      {"real_time", false},
      {"mode_note", "right to SCHED_FIFO missing"},
      {"seed", 7},
      {"camera", "simulated Kinect"},
      {"exit_reason", "mission ended in order"},
      {"command_line", "wasp fly --name demo"},
      {"phases",
       {phase("ground", 0, 0, 2), phase("hover 1 at 0.5 m", 0.5, 2, 12), phase("hover 2 at 1 m", 1, 12, 22),
        phase("landing", 0, 22, 25)}},
      {"results",
       {{{"name", "hover 1: RMS height error"}, {"value", 0.0123}, {"unit", "m"}, {"bar", "<= 0.05"}, {"ok", true}},
        {{"name", "control deadlines missed"}, {"value", 3}, {"unit", ""}, {"bar", "<= 0"}, {"ok", all_met}},
        {{"name", "frames lost"}, {"value", 0}, {"unit", ""}, {"bar", nullptr}, {"ok", true}}}}};
  std::ofstream(folder / "run.json") << run;
}

std::size_t count_of(const std::string& text, const std::string& what) {
  std::size_t n = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++n;
  return n;
}

std::pair<std::string, int> report(const fs::path& folder) {
  return test::run_shell(test::program_path("wasp-report") + " " + folder.string() + " 2>&1");
}

TEST(Report, HoldsFiguresTablesAndNames) {
  test::TemporaryFolder folder;
  write_run(folder.path, false);
  const auto [text, code] = report(folder.path);
  ASSERT_EQ(code, 0) << text;
  const std::string page = test::read_text(folder.path / "report.html");
  EXPECT_LT(page.size(), 2'000'000u);
  EXPECT_EQ(count_of(page, "<svg"), 5u + 8u);  // altitude, error, track, attitude, thrust; eight stages
  EXPECT_EQ(count_of(page, "<svg"), count_of(page, "</svg>"));
  EXPECT_EQ(count_of(page, ">budget</text>"), 6u);
  EXPECT_EQ(count_of(page, "nan"), 0u);
  for (const char* wanted : {"NOT REAL TIME", "not real time", "1 of 2 bars missed", "ground_altitude", "edge_altitude",
                             "setpoint", "p99.9", "6.1.0-test", "SCHED_OTHER", "a test, 2 cores", "hover 1 at 0.5 m",
                             "&lt;= 0.05", "hover &lt;demo&gt; &amp; more"})
    EXPECT_NE(page.find(wanted), std::string::npos) << wanted;
  for (const char* unwanted : {"http://", "https://", "<script", "@import", "<link", "<demo>"})
    EXPECT_EQ(page.find(unwanted), std::string::npos) << unwanted;
}

TEST(Report, SaysSuccessWhenAllBarsAreMet) {
  test::TemporaryFolder folder;
  write_run(folder.path, true);
  ASSERT_EQ(report(folder.path).second, 0);
  EXPECT_NE(test::read_text(folder.path / "report.html").find("Succeeded: all 2 bars met"), std::string::npos);
}

TEST(Report, EveryMissingFileIsNamedAndTheRestIsThere) {
  for (const char* gone :
       {"run.json", "log/commands.csv", "log/cues.csv", "log/truth.csv", "log/attitude.csv", "log/stages.json"}) {
    test::TemporaryFolder folder;
    write_run(folder.path, true);
    fs::remove(folder.path / gone);
    ASSERT_EQ(report(folder.path).second, 0) << gone;
    const std::string page = test::read_text(folder.path / "report.html");
    EXPECT_NE(page.find(std::string(gone) + " is missing"), std::string::npos);
    EXPECT_NE(page.find("<svg"), std::string::npos) << gone;
  }
}

TEST(Report, DamagedFilesAreToldNotFatal) {
  test::TemporaryFolder folder;
  write_run(folder.path, true);
  std::ofstream(folder.path / "log/stages.json") << "{\"stages\": [{\"owner\": 5}]}";
  std::ofstream(folder.path / "run.json") << "{\"name\": \"cut";
  std::ofstream(folder.path / "log/truth.csv", std::ios::app) << "1,2,3\n4,5";
  ASSERT_EQ(report(folder.path).second, 0);
  const std::string page = test::read_text(folder.path / "report.html");
  for (const char* wanted : {"stages.json has an unexpected form", "run.json cannot be read",
                             "1 lines could not be read", "ends in the middle of a line"})
    EXPECT_NE(page.find(wanted), std::string::npos) << wanted;
}

TEST(Report, EmptyFolderGivesAReportMissingFolderAnError) {
  test::TemporaryFolder folder;
  EXPECT_EQ(report(folder.path).second, 0);
  EXPECT_TRUE(fs::exists(folder.path / "report.html"));
  const auto [text, code] = report(folder.path / "absent");
  EXPECT_EQ(code, 1);
  EXPECT_NE(text.find("is not a folder"), std::string::npos);
}

TEST(ReportSeries, ThinningKeepsPeaksAndBreaks) {
  tools::Series s;
  for (int i = 0; i < 100'000; ++i)
    s.add(i, i == 54'321 ? 9.0 : i == 12'345 ? -7.0 : i == 77'777 ? std::nan("") : std::sin(i * 0.001));
  const auto thin = tools::thin_envelope(s, 500);
  EXPECT_LE(thin.size(), 1500u);
  EXPECT_EQ(tools::range_of({&thin.y}).high, 9.0);
  EXPECT_EQ(tools::range_of({&thin.y}).low, -7.0);
  EXPECT_EQ(std::count_if(thin.y.begin(), thin.y.end(), [](double v) { return std::isnan(v); }), 1);
  EXPECT_TRUE(std::is_sorted(thin.x.begin(), thin.x.end()));
}

TEST(ReportSeries, TicksAreRoundAndCover) {
  const auto ticks = tools::nice_ticks({-0.13, 1.22}, 6);
  ASSERT_GE(ticks.size(), 4u);
  EXPECT_NEAR(ticks[1] - ticks[0], 0.5, 0.3);
  for (const double t : ticks) EXPECT_NEAR(t * 10, std::round(t * 10), 1e-9);
  EXPECT_EQ(tools::nice_ticks({2, 2}, 5).size(), 1u);
}

TEST(ReportPlot, LogarithmicAxesShowWholeDecades) {
  tools::Plot plot;
  plot.x_scale = tools::Scale::kLogDuration;
  plot.y_scale = tools::Scale::kLog;
  plot.curves.push_back({"c", {}, {{4.3, 5.2}, {0, -1.5}}});  // 20 us ... 160 us; 1 ... 0.03
  const std::string svg = plot.svg();
  for (const char* label : {">10 us<", ">100 us<", ">1 ms<", ">1<", ">0.1<", ">0.01<"})
    EXPECT_NE(svg.find(label), std::string::npos) << label;
  const std::string file = tools::standalone_svg(svg);
  EXPECT_EQ(file.find("<svg xmlns="), 0u);
  EXPECT_NE(file.find("<style>"), std::string::npos);
}

TEST(ReportPlot, EqualAxesKeepShapes) {
  tools::Plot plot;
  plot.equal_axes = true;
  plot.curves.push_back({"square", {}, {{0, 1, 1, 0, 0}, {0, 0, 1, 1, 0}}});
  const std::string svg = plot.svg();
  const std::size_t d = svg.find("class='line c0 thin' d='M");
  double x0 = 0, y0 = 0, x1 = 0, y1 = 0, x2 = 0, y2 = 0;
  ASSERT_EQ(
      std::sscanf(svg.c_str() + d, "class='line c0 thin' d='M%lf %lfL%lf %lfL%lf %lf", &x0, &y0, &x1, &y1, &x2, &y2),
      6);
  EXPECT_NEAR(x1 - x0, y1 - y2, 0.25);
}

}  // namespace
}  // namespace wasp
