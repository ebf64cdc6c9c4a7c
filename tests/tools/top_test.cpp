// The real wasp-top against regions written here.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/tools/fake_flight.h"
#include "tests/tools/program.h"
#include "tools/top_snapshot.h"
#include "tools/top_text.h"

namespace wasp {
namespace {

using test::FakeFlight;

std::string top(const std::string& arguments) { return test::program_path("wasp-top") + " " + arguments + " 2>&1"; }

/// 200 Hz IMU, 20 Hz commands, published up to now.
void publish_history(const FakeFlight& flight) {
  const TimeNs now = rt::now();
  for (std::uint32_t n = 0; n < 300; ++n) flight.write_imu(now - (299 - n) * 5 * kMillisecond, n);
  for (std::uint32_t n = 0; n < 30; ++n) {
    const TimeNs t = now - (29 - n) * 50 * kMillisecond;
    flight.command->write(FakeFlight::make_command(t, n, 5 + 0.05 * n), t);
  }
  auto* stage = flight.stages->add("ground_altitude", "compute", 10'000'000);
  for (int i = 0; i < 100; ++i) stage->record(3'000'000 + i * 10'000);
  stage->record(12'000'000);
}

TEST(Top, OnceJsonListsRatesAndStages) {
  FakeFlight flight(test::unique_instance("top"));
  publish_history(flight);
  const auto [text, code] = test::run_shell(top("--instance " + flight.instance + " --once --json"));
  ASSERT_EQ(code, 0) << text;
  const auto document = nlohmann::json::parse(text);
  std::map<std::string, nlohmann::json> topics;
  for (const auto& t : document.at("topics")) topics[t.at("name")] = t;
  EXPECT_NEAR(topics.at("imu").at("rate_hz").get<double>(), 200, 0.01);
  EXPECT_NEAR(topics.at("command").at("rate_hz").get<double>(), 20, 0.01);
  EXPECT_EQ(topics.at("imu").at("published"), 300);
  EXPECT_GE(topics.at("imu").at("age_ms").get<double>(), 0);
  EXPECT_TRUE(topics.at("depth").at("age_ms").is_null());
  EXPECT_EQ(topics.at("depth").at("rate_hz"), 0);
  EXPECT_EQ(document.at("stages").at(0).at("misses"), 1);
  EXPECT_EQ(document.at("stages").at(0).at("max_ns"), 12'000'000);
  EXPECT_EQ(document.at("command").at("mode"), "behaviour");
  EXPECT_EQ(document.at("real_time"), false);
}

TEST(Top, OnceTextSaysNotRealTimeAndUsesNoEscapes) {
  FakeFlight flight(test::unique_instance("text"));
  publish_history(flight);
  const auto [text, code] = test::run_shell("TERM=dumb " + top("--instance " + flight.instance + " --once"));
  ASSERT_EQ(code, 0) << text;
  EXPECT_NE(text.find("NOT REAL TIME"), std::string::npos);
  EXPECT_NE(text.find("mode behaviour"), std::string::npos);
  EXPECT_NE(text.find("ground_altitude"), std::string::npos);
  EXPECT_NE(text.find("200.00"), std::string::npos) << text;
  EXPECT_EQ(text.find('\x1b'), std::string::npos);
}

TEST(Top, SaysWhetherFaultsAreArmed) {
  FakeFlight flight(test::unique_instance("faults"));
  publish_history(flight);
  const std::string command = "TERM=dumb " + top("--instance " + flight.instance + " --once");
  EXPECT_EQ(test::run_shell(command).first.find("FAULTS ARMED"), std::string::npos);
  flight.run->faults_armed = 1;
  EXPECT_NE(test::run_shell(command).first.find("FAULTS ARMED"), std::string::npos);
}

TEST(Top, UnknownInstanceFails) {
  const auto [text, code] = test::run_shell(top("--instance " + test::unique_instance("absent") + " --once"));
  EXPECT_EQ(code, 1);
  EXPECT_NE(text.find("no region"), std::string::npos);
}

TEST(Top, ObserverSurvivesEndAndRestartOfTheFlight) {
  const std::string instance = test::unique_instance("restart");
  tools::TopObserver observer(instance);
  EXPECT_FALSE(observer.look().regions[0].attached);
  for (int round = 0; round < 3; ++round) {
    FakeFlight flight(instance, "round " + std::to_string(round));
    flight.write_imu(rt::now(), 1);
    auto snapshot = observer.look();
    for (int i = 0; i < 2; ++i) snapshot = observer.look();
    ASSERT_TRUE(snapshot.regions[0].attached);
    EXPECT_EQ(snapshot.regions[0].note, "round " + std::to_string(round));
    EXPECT_EQ(snapshot.topics[0].published, 1u);
  }
}

TEST(Top, ForeignBytesCannotSteerTheTerminal) {
  FakeFlight flight(test::unique_instance("escape"), "\x1b[2J gone");
  tools::TopObserver observer(flight.instance);
  for (const auto& line : tools::top_lines(observer.look())) EXPECT_EQ(line.find('\x1b'), std::string::npos);
}

}  // namespace
}  // namespace wasp
