// Each mission, flown a few times in lockstep, meets its bars: the short form of `wasp reproduce`. Virtual time: no
// host is too slow for it.
#include "missions/campaign.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <thread>

#include "missions/mission_setup.h"
#include "tools/mission_files.h"

namespace wasp::missions {
namespace {

struct Short {
  const char* mission;
  int runs;
  std::uint32_t first_seed;  ///< others than those the defaults were looked at with
};

class Campaign : public ::testing::TestWithParam<Short> {};

TEST_P(Campaign, MeetsItsBars) {
  CampaignOptions options{GetParam().mission, GetParam().runs, GetParam().first_seed, 1, {}};
  const CampaignResult result = fly_campaign(options, {});
  ASSERT_FALSE(result.results.empty());
  for (const CampaignRun& run : result.runs) EXPECT_EQ(run.error, "") << "seed " << run.seed;
  for (const auto& r : result.results) {
    EXPECT_TRUE(r.ok) << r.name << " is " << r.value << " " << r.unit << ", bar " << r.bar;
    RecordProperty(r.name, std::to_string(r.value));
  }
}

INSTANTIATE_TEST_SUITE_P(Missions, Campaign,
                         ::testing::Values(Short{"turntable", 1, 501}, Short{"hover-yaw", 1, 501},
                                           Short{"aggressive", 1, 501}, Short{"wall", 3, 501},
                                           Short{"corridor-empty", 2, 501}, Short{"corridor", 2, 501},
                                           Short{"bee", 1, 501}, Short{"arena", 2, 501}, Short{"city-max", 1, 501},
                                           Short{"city-near", 2, 501}, Short{"city-defocus", 1, 501},
                                           Short{"edge-height", 1, 501}, Short{"landing", 1, 501}),
                         [](const auto& row) {
                           std::string name = row.param.mission;
                           for (char& c : name) c = c == '-' ? '_' : c;
                           return name;
                         });

TEST(CampaignRuns, AFlightAgainByItsSeedIsTheSameToTheBit) {
  const MissionSetup setup = load_mission("arena", 77);
  FlightTrace first, again;
  (void)fly_once(setup, [&](const FlightTrace& t, const WorldProbe&) { first = t; });
  (void)fly_once(load_mission("arena", 77), [&](const FlightTrace& t, const WorldProbe&) { again = t; });
  ASSERT_EQ(first.truth.size(), again.truth.size());
  for (std::size_t i = 0; i < first.truth.size(); ++i) {
    ASSERT_EQ(first.truth[i].position_ned_m, again.truth[i].position_ned_m) << i;
    ASSERT_EQ(first.commands[i].thrust, again.commands[i].thrust) << i;
  }
}

TEST(CampaignRuns, TwoThreadsMayMakeFourierPlansAtOnce) {
  MissionSetup setup = load_mission("turntable", 1);
  setup.flight.control.mission.legs[0].seconds = 1;
  std::vector<std::string> errors(2);
  std::vector<std::thread> threads;
  for (std::string& error : errors)
    threads.emplace_back([&] {
      try {
        (void)fly_once(setup);
      } catch (const std::exception& e) {
        error = e.what();
      }
    });
  for (auto& t : threads) t.join();
  for (const auto& e : errors) EXPECT_EQ(e, "");
}

TEST(CampaignRuns, AnUnknownMissionListsTheKnownOnes) {
  try {
    fly_campaign({"moon", 1, 1, 1, {}}, {});
    FAIL();
  } catch (const std::exception& e) {
    EXPECT_NE(std::string(e.what()).find("unknown mission 'moon'"), std::string::npos);
    for (const auto& name : tools::mission_names())
      EXPECT_NE(std::string(e.what()).find(name), std::string::npos) << name;
  }
}

TEST(CampaignRuns, EveryMissionLoadsAndHasAJudgeOfItsOwn) {
  for (const auto& name : tools::mission_names()) {
    const MissionSetup setup = load_mission(name, 3);
    EXPECT_EQ(judge_of(name).mission, name);
    EXPECT_FALSE(lockstep_options(setup).behaviours.empty()) << name;
  }
}

TEST(CampaignRuns, ReadersOfFlowWithoutASourceAreRefusedByName) {
  const auto file = std::filesystem::temp_directory_path() / ("no-flow-" + std::to_string(getpid()) + ".toml");
  std::ofstream(file) << "[behaviour.flow_field]\nenabled = false\n";
  try {
    load_mission("wall", 1, {file.string()});
    ADD_FAILURE();
  } catch (const std::exception& e) {
    EXPECT_NE(std::string(e.what()).find("odometry"), std::string::npos) << e.what();
  }
  std::filesystem::remove(file);
}

/// The corridor's bars can fail: without the behaviours that steer, a start askew ends at a wall or swings wide.
TEST(CampaignRuns, WithoutSteeringTheCorridorsBarsAreMissed) {
  const auto file = std::filesystem::temp_directory_path() / ("no-steer-" + std::to_string(getpid()) + ".toml");
  std::ofstream(file)
      << "[behaviour.flow_balance]\nheading_weight = 0.0\n[behaviour.obstacle_depth]\nheading_weight = 0.0\n";
  CampaignOptions options{"corridor-empty", 1, 501, 1, {file.string()}};
  EXPECT_FALSE(fly_campaign(options, {}).passed());
  std::filesystem::remove(file);
}

TEST(CampaignRuns, PeopleWalkByTheSameClockForTheRendererAndTheProbe) {
  MissionSetup setup = load_mission("corridor", 5);
  setup.flight.control.mission.legs[1].seconds = 3;
  (void)fly_once(setup, [&](const FlightTrace& trace, const WorldProbe&) {
    ASSERT_NE(trace.lift_off_ns, kNever);
    for (const Truth& t : trace.truth) {
      if (t.flight_time_s <= 0) continue;
      ASSERT_NEAR(trace.seconds(t.exposed_at_ns), static_cast<double>(t.flight_time_s), 1e-3);
    }
  });
}

TEST(CampaignRuns, TheTableHasALineForEachFlightAndNamesWhatFailed) {
  CampaignResult result;
  result.runs = {{7, {{"collisions", 0}, {"way, flown", 12.5}}, 60, 5, ""}, {8, {}, 0, 0, "no \"world\""}};
  const auto file = std::filesystem::temp_directory_path() / ("campaign-" + std::to_string(getpid()) + ".csv");
  write_csv(result, file);
  std::ifstream in(file);
  std::stringstream text;
  text << in.rdbuf();
  EXPECT_EQ(text.str(),
            "seed,flight_s,wall_s,\"collisions\",\"way, flown\",error\n"
            "7,60.000,5.000,0,12.5,\"\"\n"
            "8,0.000,0.000,nan,nan,\"no \"\"world\"\"\"\n");
  std::filesystem::remove(file);
  EXPECT_THROW(write_csv(result, "/proc/nowhere/runs.csv"), std::runtime_error);
}

}  // namespace
}  // namespace wasp::missions
