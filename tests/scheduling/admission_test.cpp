// A configuration's thread table before arming: schedulable or not, why, and what arming makes of it.
#include "scheduling/admission.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "scheduling/arming.h"
#include "scheduling/plan.h"

namespace wasp::scheduling {
namespace {

const std::vector<std::string> kNames{"ground_altitude", "edge_altitude"};
constexpr DurationNs kFrame = 33'333'333;

const PlanRow& row(const Plan& plan, const std::string& name) {
  for (const auto& r : plan.rows)
    if (r.thread.name == name) return r;
  throw std::runtime_error("no row " + name);
}

TEST(Admission, TheShippedTableIsSchedulable) {
  const Plan plan = make_plan(load_config({}, kNames), kFrame, true, {});
  EXPECT_TRUE(plan.schedulable);
  EXPECT_EQ(plan.rows.size(), 5u);
  EXPECT_EQ(plan.rows.front().thread.name, "control");
  EXPECT_EQ(row(plan, "control").response.response_ns, 2'200'000);  // its budget and the blocking
  EXPECT_EQ(row(plan, "control").thread.deadline_ns, 10 * kMillisecond);
  EXPECT_EQ(row(plan, "edge_altitude").thread.period_ns, kFrame);
}

TEST(Admission, ABehaviourAboveControlThatEatsItsDeadlineIsNamed) {
  Config config = load_config({}, kNames);
  config.behaviours[0].priority = 90;
  config.behaviours[0].budget_ns = 9 * kMillisecond;
  const Plan plan = make_plan(config, kFrame, false, {});
  EXPECT_FALSE(plan.schedulable);
  ASSERT_FALSE(plan.reasons.empty());
  EXPECT_EQ(plan.reasons[0].find("control: R grows beyond its deadline of 10.000 ms"), 0u) << plan.reasons[0];
  EXPECT_NE(plan.reasons[0].find("ground_altitude 9.000 ms"), std::string::npos) << plan.reasons[0];
  const auto doc = nlohmann::json::parse(plan_json(plan));
  EXPECT_FALSE(doc["schedulable"].get<bool>());
  EXPECT_EQ(doc["threads"].size(), 4u);
  EXPECT_NE(plan_text(plan).find("NOT schedulable"), std::string::npos);
}

TEST(Admission, OnlyEnabledBehavioursCountAtTheRateOfTheirCamera) {
  Config config = load_config({}, kNames);
  config.behaviours[0].enabled = false;
  config.behaviours[1].looks_down = true;
  config.camera_down.rate_hz = 10;
  const Plan plan = make_plan(config, kFrame, false, {});
  EXPECT_EQ(plan.rows.size(), 3u);
  EXPECT_EQ(row(plan, "edge_altitude").thread.period_ns, 100 * kMillisecond);
}

TEST(Admission, EnforceRefusesToArmWarnAndOffDoNot) {
  Config config = load_config({}, kNames);
  config.behaviours[1].budget_ns = 60 * kMillisecond;
  const Plan bad = make_plan(config, kFrame, false, {}), good = make_plan(load_config({}, kNames), kFrame, false, {});
  std::string said;
  const LogLine log = [&said](const std::string& line) { said += line; };
  EXPECT_THROW(admit(bad, AdmissionMode::kEnforce, true, log), std::runtime_error);
  EXPECT_TRUE(said.empty());
  admit(bad, AdmissionMode::kWarn, true, log);
  EXPECT_NE(said.find("edge_altitude"), std::string::npos) << said;
  said.clear();
  admit(bad, AdmissionMode::kEnforce, false, log);  // priorities are not in force: said, not refused
  EXPECT_FALSE(said.empty());
  said.clear();
  admit(bad, AdmissionMode::kOff, true, log);
  admit(good, AdmissionMode::kEnforce, true, log);
  EXPECT_TRUE(said.empty());
}

class MeasuredTest : public ::testing::Test {
 protected:
  std::string write(const std::string& text) {
    std::ofstream(path_) << text;
    return path_;
  }
  void TearDown() override { std::filesystem::remove(path_); }
  const std::string path_ =
      (std::filesystem::temp_directory_path() / ("wasp_stages_" + std::to_string(getpid()) + ".json")).string();
};

TEST_F(MeasuredTest, AnEarlierFlightsMaximaReplaceTheBudgets) {
  const auto costs = read_measured_costs(write(R"({"stages": [
    {"owner": "control", "stage": "compute", "count": 9, "max_ns": 30000},
    {"owner": "control", "stage": "write", "count": 9, "max_ns": 20000},
    {"owner": "control", "stage": "tick to byte", "count": 9, "max_ns": 999999},
    {"owner": "edge_altitude", "stage": "compute", "count": 9, "max_ns": 40000000},
    {"owner": "link", "stage": "compute", "count": 0, "max_ns": 0}]})"));
  EXPECT_EQ(costs.at("control"), 50'000);
  const Plan plan = make_plan(load_config({}, kNames), kFrame, false, costs);
  EXPECT_TRUE(row(plan, "control").measured);
  EXPECT_FALSE(row(plan, "link").measured);
  EXPECT_EQ(row(plan, "link").thread.cost_ns, kMillisecond);
  EXPECT_FALSE(plan.schedulable);  // edge_altitude takes longer than a frame
}

TEST_F(MeasuredTest, AFileThatSaysNothingIsRefusedByName) {
  for (const char* text : {"", "{", "{}", R"({"stages": []})", R"({"stages": [{"owner": 3}]})"}) {
    try {
      read_measured_costs(write(text));
      ADD_FAILURE() << text;
    } catch (const std::runtime_error& e) {
      EXPECT_NE(std::string(e.what()).find(path_), std::string::npos) << e.what();
    }
  }
  EXPECT_THROW(read_measured_costs("/nowhere/stages.json"), std::runtime_error);
}

}  // namespace
}  // namespace wasp::scheduling
