// The judge: a good run passes, and every way a run can be bad makes it fail, doctored one figure at a time.
#include "tools/rt_guest/verdict.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

namespace wasp::tools::rt_guest {
namespace {

using Outcomes = std::map<std::string, JobOutcome>;

nlohmann::json stage(const char* name, std::int64_t max_ns) {
  return {{"owner", "control"}, {"stage", name}, {"count", 36100}, {"p999_ns", max_ns / 2}, {"max_ns", max_ns}};
}

JobOutcome flown(std::uint64_t ticks, bool real_time, std::int64_t release_ns) {
  nlohmann::json figures{{"stages", {stage("wake-up", release_ns), stage("tick to byte", release_ns + 50'000)}},
                         {"run",
                          {{"real_time", real_time},
                           {"preempt_rt", true},
                           {"ticks", ticks},
                           {"skipped", 0},
                           {"deadline_misses", 0},
                           {"minor_faults", 0},
                           {"major_faults", 0},
                           {"finished", true}}}};
  return {0, std::move(figures), {}};
}

Outcomes good() {
  const nlohmann::json rights{
      {"root", 0}, {"user", 3}, {"user_rights_missing", 2}, {"user_flight", 1}, {"user_flight_refusals", 1}};
  nlohmann::json faults{{"cells", nlohmann::json::array()}};
  for (const char* fault : {"a", "b", "c", "d", "e", "f", "h"})
    faults["cells"].push_back({{"fault", fault}, {"verdict", "ok"}, {"response_ms", 66.7}});
  faults["cells"].push_back({{"fault", "g"}, {"verdict", "skipped"}, {"response_ms", nullptr}});
  return {{"rights", {0, rights, {}}},
          {"faults", {0, faults, {}}},
          {"quiet", flown(36'030, true, 39'000)},
          {"stressed", flown(2'430, true, 46'000)},
          {"not-real-time", flown(230, false, 14'000'000)}};
}

Plan full_plan() { return plan_boot("arm64", {.quiet = 36'000, .stressed = 2'400, .not_real_time = 200}); }

std::vector<std::string> missed(const Plan& plan, const Outcomes& outcomes) {
  std::vector<std::string> names;
  for (const Result& r : judge(plan, outcomes))
    if (!r.ok) names.push_back(r.name);
  return names;
}

TEST(Verdict, AGoodRunMeetsEveryBar) {
  EXPECT_EQ(missed(full_plan(), good()), std::vector<std::string>{});
  EXPECT_GE(judge(full_plan(), good()).size(), 20u);
}

struct Doctored {
  const char* what;
  std::function<void(Outcomes&)> doctor;
  std::string missed;
};

nlohmann::json& run_of(Outcomes& o, const char* job) { return o.at(job).figures["run"]; }
nlohmann::json& stage_of(Outcomes& o, const char* job, int index) { return o.at(job).figures["stages"][index]; }

TEST(Verdict, EveryDoctoredFigureIsFoundByName) {
  const std::vector<Doctored> cases = {
      {"a release later than 60 us", [](auto& o) { stage_of(o, "quiet", 0)["max_ns"] = 60'001; },
       "quiet: control release, max"},
      {"a byte later than 2 ms", [](auto& o) { stage_of(o, "stressed", 1)["max_ns"] = 2'000'001; },
       "stressed: tick to last byte, max"},
      {"a missed release", [](auto& o) { run_of(o, "stressed")["skipped"] = 1; }, "stressed: missed releases"},
      {"a missed deadline", [](auto& o) { run_of(o, "quiet")["deadline_misses"] = 1; }, "quiet: missed deadlines"},
      {"a page fault", [](auto& o) { run_of(o, "quiet")["minor_faults"] = 1; },
       "quiet: page faults in real-time threads"},
      {"too few cycles", [](auto& o) { run_of(o, "quiet")["ticks"] = 35'999; }, "quiet: control cycles"},
      {"a flight that never finished", [](auto& o) { run_of(o, "quiet")["finished"] = false; },
       "quiet: ended in order"},
      {"a flight that crashed", [](auto& o) { o.at("stressed").exit_code = 139; }, "stressed: ended in order"},
      {"not real time after all", [](auto& o) { run_of(o, "quiet")["real_time"] = false; },
       "quiet: flight says real time on PREEMPT_RT"},
      {"another kernel", [](auto& o) { run_of(o, "quiet")["preempt_rt"] = false; },
       "quiet: flight says real time on PREEMPT_RT"},
      {"a negative control as good as real time", [](auto& o) { stage_of(o, "not-real-time", 0)["max_ns"] = 900'000; },
       "not-real-time: control release, max"},
      {"a negative control that hardly ran", [](auto& o) { run_of(o, "not-real-time")["ticks"] = 3; },
       "not-real-time: control cycles"},
      {"a flight without figures", [](auto& o) { o.at("quiet").figures = nlohmann::json(); },
       "quiet: figures handed back"},
      {"a stage without samples", [](auto& o) { stage_of(o, "quiet", 0)["count"] = 0; }, "quiet: figures handed back"},
      {"a flight that never came back", [](auto& o) { o.erase("stressed"); }, "stressed: figures handed back"},
      {"figures that are no JSON",
       [](auto& o) { o.at("quiet").figures = nlohmann::json::parse("{\"sta", nullptr, false); },
       "quiet: figures handed back"},
      {"a broken promise", [](auto& o) { o.at("faults").figures["cells"][2]["verdict"] = "MISS"; },
       "faults: c, answered [ms]"},
      {"noise where there is none", [](auto& o) { o.at("faults").figures["cells"][0]["verdict"] = "host noise"; },
       "faults: a, answered [ms]"},
      {"a fault that was not done", [](auto& o) { o.at("faults").figures["cells"].erase(6); }, "faults: faults done"},
      {"a campaign that never came back", [](auto& o) { o.erase("faults"); }, "faults: faults done"},
      {"a user with root's rights", [](auto& o) { o.at("rights").figures["user"] = 0; }, "rights: a user's exit code"},
      {"root without rights", [](auto& o) { o.at("rights").figures["root"] = 3; }, "rights: root lacks none"},
  };
  for (const auto& c : cases) {
    Outcomes outcomes = good();
    c.doctor(outcomes);
    EXPECT_EQ(missed(full_plan(), outcomes), std::vector<std::string>{c.missed}) << c.what;
  }
}

TEST(Verdict, AWatchdogMustBeFedDisarmedAndBite) {
  Outcomes outcomes = good();
  outcomes["watchdog"] = {0,
                          {{"flight", 1},
                           {"limit_s", 2},
                           {"active_s", 5},
                           {"after", "inactive"},
                           {"outlived_s", 5},
                           {"restarted", true},
                           {"alive_ms", 1960}},
                          {}};
  const Plan plan = plan_boot("amd64", {});
  EXPECT_EQ(missed(plan, outcomes), std::vector<std::string>{});
  const std::vector<Doctored> cases = {
      {"another limit", [](auto& o) { o.at("watchdog").figures["limit_s"] = 30; }, "watchdog: its limit [s]"},
      {"not fed", [](auto& o) { o.at("watchdog").figures["active_s"] = 0; }, "watchdog: seconds fed in flight"},
      {"left armed", [](auto& o) { o.at("watchdog").figures["after"] = "active"; },
       "watchdog: disarmed by an orderly end"},
      {"never bit", [](auto& o) { o.at("watchdog").figures.erase("restarted"); },
       "watchdog: restarts the board once its guardian is killed"},
      {"bit late", [](auto& o) { o.at("watchdog").figures["alive_ms"] = 2'101; }, "watchdog: within"},
      {"nobody saw it live", [](auto& o) { o.at("watchdog").figures.erase("alive_ms"); }, "watchdog: within"},
  };
  for (const auto& c : cases) {
    Outcomes doctored = outcomes;
    c.doctor(doctored);
    EXPECT_EQ(missed(plan, doctored), std::vector<std::string>{c.missed}) << c.what;
  }
}

TEST(Verdict, NothingAtAllMissesEverything) {
  for (const Result& r : judge(full_plan(), {})) EXPECT_FALSE(r.ok) << r.name;
}

TEST(Verdict, TheTableShowsEveryFlight) {
  Outcomes outcomes = good();
  outcomes.erase("stressed");
  const std::string text = table(read_rows(full_plan(), outcomes));
  EXPECT_NE(text.find("36030"), std::string::npos) << text;
  EXPECT_NE(text.find("no figures"), std::string::npos) << text;
  EXPECT_NE(text.find("SCHED_OTHER"), std::string::npos) << text;
}

TEST(Plan, JobsAreLinesTheGuestUnderstands) {
  const Plan plan = full_plan();
  ASSERT_EQ(plan.jobs.size(), 5u);
  EXPECT_EQ(plan.jobs[0].line(), "rights rights");
  EXPECT_EQ(plan.jobs[1].line(), "flight quiet 1800 rt idle");
  EXPECT_EQ(plan.jobs[2].line().find("faults faults ^(flight-(killed|"), 0u);
  EXPECT_EQ(plan.jobs[3].line(), "flight stressed 120 rt stress");
  EXPECT_EQ(plan.jobs[4].line(), "flight not-real-time 10 other stress");
  EXPECT_EQ(plan.seconds(), 1930 + 7 * 15);
  const Plan amd64 = plan_boot("amd64", {});
  ASSERT_EQ(amd64.jobs.size(), 4u);
  EXPECT_EQ(amd64.jobs.back().line(), "watchdog watchdog i6300esb") << "the last: the machine does not come back";
  EXPECT_EQ(plan_two_cores("amd64").jobs[0].line(), "faults hot-plug ^core-offlined$ --untimed");
}

}  // namespace
}  // namespace wasp::tools::rt_guest
