// The real wasp-record against regions written here: what it keeps, what it counts, and that it disturbs nobody.
#include <gtest/gtest.h>

#include <bit>
#include <charconv>
#include <nlohmann/json.hpp>
#include <set>

#include "drivers/image_file.h"
#include "tests/tools/fake_flight.h"
#include "tests/tools/program.h"
#include "tools/csv_table.h"

namespace wasp {
namespace {

using test::eventually;
using test::FakeFlight;
using test::Program;
using tools::CsvTable;
namespace fs = std::filesystem;

class Record : public ::testing::Test {
 protected:
  static std::vector<std::string> arguments(const std::string& instance, const fs::path& out,
                                            std::vector<std::string> more = {}) {
    std::vector<std::string> a = {test::program_path("wasp-record"), "--instance", instance, "--out", out.string()};
    a.insert(a.end(), more.begin(), more.end());
    return a;
  }
  static std::size_t rows(const fs::path& file) {
    const auto table = CsvTable::read(file);
    return table ? table->rows() : 0;
  }
  static nlohmann::json account(const fs::path& out) {
    return nlohmann::json::parse(test::read_text(out / "log/record.json"));
  }
  static nlohmann::json topic(const fs::path& out, const std::string& name) {
    const auto document = account(out);
    for (const auto& t : document.at("topics"))
      if (t.at("topic") == name) return t;
    return {};
  }
  static float float_at(const CsvTable& table, std::size_t row, const char* column) {
    const auto text = table.text(row, table.column(column).value());
    float value = -1e30f;
    std::from_chars(text.data(), text.data() + text.size(), value);
    return value;
  }
  static void expect_same_bits(float a, float b, const char* what) {
    EXPECT_EQ(std::bit_cast<std::uint32_t>(a), std::bit_cast<std::uint32_t>(b)) << what << ": " << a << " and " << b;
  }
  test::TemporaryFolder folder_;
  fs::path out_ = folder_.path / "run";
};

TEST_F(Record, CuesRoundTripToTheBit) {
  const std::string instance = test::unique_instance("cues");
  Program recorder(arguments(instance, out_));
  ASSERT_TRUE(eventually([&] { return fs::exists(out_ / "log/truth.csv"); }));
  FakeFlight flight(instance);
  constexpr std::uint32_t kCount = 40;
  for (std::uint32_t n = 0; n < kCount; ++n)
    flight.ground->write(FakeFlight::make_cue(0, 1000 + n, n, 0.1 * n), 2000 + n);
  flight.run->finished = 1;
  ASSERT_EQ(recorder.wait(), 0);

  const auto table = CsvTable::read(out_ / "log/cues.csv");
  ASSERT_TRUE(table);
  ASSERT_EQ(table->rows(), kCount);
  for (std::uint32_t n = 0; n < kCount; ++n) {
    const Cue cue = FakeFlight::make_cue(0, 1000 + n, n, 0.1 * n);
    EXPECT_EQ(table->integers("exposed_at_ns")[n], cue.exposed_at_ns);
    EXPECT_EQ(table->integers("finished_at_ns")[n], cue.finished_at_ns);
    EXPECT_EQ(table->integers("frame_sequence")[n], cue.frame_sequence);
    EXPECT_EQ(table->integers("validity")[n], static_cast<int>(cue.body.validity));
    EXPECT_EQ(table->texts("behaviour")[n], "ground_altitude");
    for (std::size_t i = 0; i < 4; ++i)
      expect_same_bits(float_at(*table, n, std::array{"q_w", "q_x", "q_y", "q_z"}[i]), cue.q_ned_body[i], "q");
    for (std::size_t i = 0; i < 3; ++i)
      expect_same_bits(
          float_at(*table, n, std::array{"rate_x_body_radps", "rate_y_body_radps", "rate_z_body_radps"}[i]),
          cue.rate_body_radps[i], "rate");
    expect_same_bits(float_at(*table, n, "height_m"), cue.body.height_m, "height");
    expect_same_bits(float_at(*table, n, "height_sigma_m"), cue.body.height_sigma_m, "sigma");
    for (std::size_t i = 0; i < 8; ++i)
      expect_same_bits(float_at(*table, n, ("detail_" + std::to_string(i)).c_str()), cue.body.detail[i], "detail");
  }
}

TEST_F(Record, ReadsHistoryAndEveryTable) {
  FakeFlight flight(test::unique_instance("history"));
  for (std::uint32_t n = 0; n < 20; ++n) {
    flight.write_imu(1000 + n, n);
    flight.write_attitude(1000 + n, n);
    flight.write_truth(1000 + n, 0.1 * n);
    flight.command->write(FakeFlight::make_command(1000 + n, n, 0.1 * n), 1000 + n);
    flight.edge->write(FakeFlight::make_cue(1, 1000 + n, n, 0.1 * n), 1000 + n);
  }
  flight.stages->add("control", "release to byte", 5'000'000)->record(210'000);
  flight.run->ticks = 20;
  flight.run->finished = 1;
  ASSERT_EQ(Program(arguments(flight.instance, out_)).wait(), 0);
  for (const char* name : {"imu", "attitude", "truth", "commands", "cues"})
    EXPECT_EQ(rows(out_ / "log" / (std::string(name) + ".csv")), 20u) << name;
  const auto imu = CsvTable::read(out_ / "log/imu.csv");
  expect_same_bits(float_at(*imu, 3, "gyro_z_body_radps"), 1e-38f / 7.f, "a subnormal gyro rate");
  expect_same_bits(float_at(*imu, 3, "accel_y_body_mps2"), -0.0f, "negative zero");
  EXPECT_EQ(CsvTable::read(out_ / "log/commands.csv")->integers("exposed_at_ns")[0], kNever);
  EXPECT_EQ(CsvTable::read(out_ / "log/commands.csv")->texts("mode_name")[19], "hold");
  const auto stages = nlohmann::json::parse(test::read_text(out_ / "log/stages.json"));
  EXPECT_EQ(stages.at("stages").at(0).at("max_ns"), 210'000);
  EXPECT_EQ(stages.at("stages").at(0).at("buckets").size(), 1u);
  EXPECT_EQ(stages.at("run").at("ticks"), 20);
  EXPECT_EQ(stages.at("run").at("behaviours").at(1), "edge_altitude");
}

TEST_F(Record, FramesRoundTripToTheBit) {
  FakeFlight flight(test::unique_instance("frames"));
  Program recorder(arguments(flight.instance, out_, {"--frames"}));
  constexpr std::uint32_t kCount = 30;
  for (std::uint32_t n = 0; n < kCount; ++n) {
    flight.write_depth(5 * kSecond + n * 33'333'333, 100 + n);
    flight.write_gray(5 * kSecond + n * 33'333'333 + 1, 100 + n);
    // Publish no faster than it is read: this test is about content, not about loss.
    ASSERT_TRUE(
        eventually([&] { return fs::exists(out_ / "recording/rgb" / ("frame-" + std::to_string(100 + n) + ".png")); }));
  }
  recorder.signal(SIGTERM);
  ASSERT_EQ(recorder.wait(), 0);
  for (std::uint32_t n = 0; n < kCount; ++n) {
    const std::string name = "frame-" + std::to_string(100 + n) + ".png";
    const auto depth = drivers::load_gray16(out_ / "recording/depth" / name);
    const auto gray = drivers::load_gray8(out_ / "recording/rgb" / name);
    ASSERT_EQ(depth.width_px, static_cast<int>(FakeFlight::kWidth));
    ASSERT_EQ(gray.height_px, static_cast<int>(FakeFlight::kHeight));
    for (std::uint32_t v = 0; v < FakeFlight::kHeight; ++v)
      for (std::uint32_t u = 0; u < FakeFlight::kWidth; ++u) {
        ASSERT_EQ(depth.pixels[v * FakeFlight::kWidth + u], FakeFlight::depth_pixel(100 + n, u, v));
        ASSERT_EQ(gray.pixels[v * FakeFlight::kWidth + u], FakeFlight::gray_pixel(100 + n, u, v));
      }
  }
  const std::string index = test::read_text(out_ / "recording/depth.txt");
  EXPECT_TRUE(index.starts_with("5.000000000 depth/frame-100.png\n5.033333333 depth/frame-101.png\n")) << index;
  EXPECT_EQ(std::count(index.begin(), index.end(), '\n'), kCount);
  EXPECT_EQ(topic(out_, "depth").at("lost"), 0);
  EXPECT_NE(test::read_text(out_ / "recording/camera.toml").find("width_px = 64"), std::string::npos);
  EXPECT_TRUE(fs::exists(out_ / "recording/cues.csv"));
}

TEST_F(Record, CameraDescriptionIsCopiedVerbatim) {
  FakeFlight flight(test::unique_instance("toml"));
  const std::string text = "# mine\nwidth_px = 64\nfx_px = 51.25\n";
  std::ofstream(folder_.path / "camera.toml") << text;
  flight.run->finished = 1;
  ASSERT_EQ(
      Program(arguments(flight.instance, out_, {"--frames", "--camera-toml", (folder_.path / "camera.toml").string()}))
          .wait(),
      0);
  EXPECT_EQ(test::read_text(out_ / "recording/camera.toml"), text);
}

TEST_F(Record, CountsWhatALappingWriterOverwrote) {
  FakeFlight flight(test::unique_instance("lapped"));
  Program recorder(arguments(flight.instance, out_));
  flight.write_imu(1, 0);
  ASSERT_TRUE(eventually([&] { return rows(out_ / "log/imu.csv") == 1; }));
  recorder.signal(SIGSTOP);  // asleep while the writer goes three times around
  constexpr std::uint32_t kCount = 3 * shm::kImuSlots;
  for (std::uint32_t n = 1; n < kCount; ++n) flight.write_imu(1 + n, n);
  recorder.signal(SIGCONT);
  ASSERT_TRUE(eventually([&] { return rows(out_ / "log/imu.csv") >= shm::kImuSlots; }));
  recorder.signal(SIGTERM);
  ASSERT_EQ(recorder.wait(), 0);
  const auto imu = topic(out_, "imu");
  EXPECT_EQ(imu.at("recorded").get<std::uint64_t>() + imu.at("lost").get<std::uint64_t>(), kCount);
  EXPECT_EQ(imu.at("recorded").get<std::size_t>(), rows(out_ / "log/imu.csv"));
  EXPECT_EQ(imu.at("lost").get<std::uint32_t>(), kCount - shm::kImuSlots);  // one was read before, one slot is unsafe
}

TEST_F(Record, KilledRecorderLeavesWholeLinesAndAnUndisturbedWriter) {
  FakeFlight flight(test::unique_instance("killed"));
  for (int round = 0; round < 10; ++round) {
    const fs::path out = folder_.path / std::to_string(round);
    Program recorder(arguments(flight.instance, out));
    std::uint32_t n = 0;
    const std::uint64_t before = flight.imu->published();
    ASSERT_TRUE(eventually([&] {
      for (int i = 0; i < 50; ++i, ++n) flight.write_imu(1 + n, n);
      return rows(out / "log/imu.csv") > 400u * static_cast<unsigned>(round + 1);
    }));
    recorder.signal(SIGKILL);
    EXPECT_EQ(recorder.wait(), 128 + SIGKILL);
    EXPECT_EQ(flight.imu->published(), before + n);
    for (const char* name : {"imu", "attitude", "truth", "commands", "cues"}) {
      const auto table = CsvTable::read(out / "log" / (std::string(name) + ".csv"));
      ASSERT_TRUE(table) << name;
      EXPECT_EQ(table->bad_lines(), 0u) << name;
    }
    flight.write_imu(77, n);  // the writer goes on, and a new reader reads
    ImuSample sample;
    ASSERT_TRUE(shm::RingReader(*flight.flight, shm::kImu).copy_newest(sample));
    EXPECT_EQ(sample.sequence, n);
  }
}

/// A limit on the size of files stands in for a full disk: writes beyond it fail, and the signal that comes with it
/// must not end the recorder.
TEST_F(Record, AFullDiskLosesLinesThatTheAccountCountsAndNothingElse) {
  const std::string instance = test::unique_instance("full");
  const std::string recorder_line =
      test::program_path("wasp-record") + " --instance " + instance + " --out " + out_.string();
  Program recorder({"/bin/sh", "-c", "ulimit -f 128; exec " + recorder_line});  // 64 KiB: blocks of 512 bytes
  ASSERT_TRUE(eventually([&] { return fs::exists(out_ / "log/truth.csv"); }));
  FakeFlight flight(instance);
  std::uint32_t sent = 0;
  const auto send_some = [&] {
    for (int i = 0; i < 20; ++i, ++sent)
      flight.ground->write(FakeFlight::make_cue(0, 1000 + sent, sent, 0.5), 2000 + sent);
    std::this_thread::sleep_for(std::chrono::milliseconds(4));
  };
  while (sent < 2000) send_some();
  flight.run->finished = 1;
  ASSERT_EQ(recorder.wait(), 0);
  const auto counted = account(out_);
  const auto refused = counted.at("lines_refused_by_disk").get<std::uint64_t>();
  const auto cues = topic(out_, "cue.ground_altitude");
  EXPECT_GT(refused, 0u);
  EXPECT_EQ(rows(out_ / "log/cues.csv") + refused, cues.at("recorded").get<std::uint64_t>());
  EXPECT_EQ(cues.at("recorded").get<std::uint64_t>() + cues.at("lost").get<std::uint64_t>(), sent);
  EXPECT_FALSE(fs::exists(out_ / "log/record.json.reserve"));
}

TEST_F(Record, TruncatedRegionIsAnEventNotACrash) {
  FakeFlight flight(test::unique_instance("truncated"));
  Program recorder(arguments(flight.instance, out_));
  flight.write_truth(1, 0);
  flight.write_imu(1, 0);
  ASSERT_TRUE(eventually([&] { return rows(out_ / "log/truth.csv") == 1 && rows(out_ / "log/imu.csv") == 1; }));
  ASSERT_EQ(truncate(("/dev/shm/" + shm::truth_region(flight.instance)).c_str(), 4096), 0);
  for (std::uint32_t n = 1; n < 4; ++n) flight.write_imu(1 + n, n);
  ASSERT_TRUE(eventually([&] { return rows(out_ / "log/imu.csv") == 4; }));
  recorder.signal(SIGINT);
  ASSERT_EQ(recorder.wait(), 0);
  const std::string text = test::read_text(out_ / "log/record.json");
  EXPECT_NE(text.find("truth"), std::string::npos);
  EXPECT_TRUE(text.find("truncated while mapped") != std::string::npos ||
              text.find("gone or replaced") != std::string::npos)
      << text;
  EXPECT_EQ(rows(out_ / "log/imu.csv"), 4u);  // and nothing was recorded twice
}

TEST_F(Record, FlowFieldsAndTheSecondCameraAreNotKeptAndMakeNoNoise) {
  const std::string instance = test::unique_instance("flow");
  const std::vector<shm::TopicSpec> flight{{shm::kFlow, "Flow", shm::TopicKind::kRing, 4, 64},
                                           {"riddle", "Riddle", shm::TopicKind::kRing, 4, 64}},
      camera{{shm::kGrayDown, "Frame", shm::TopicKind::kRing, 4, 4096}};
  const shm::Region f = shm::Region::create(shm::flight_region(instance), flight);
  const shm::Region c = shm::Region::create(shm::camera_region(instance), camera);
  Program recorder(arguments(instance, out_, {"--frames"}));
  ASSERT_TRUE(eventually([&] { return fs::exists(out_ / "log/truth.csv"); }));
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  recorder.signal(SIGTERM);
  EXPECT_EQ(recorder.wait(), 0);
  shm::Region::remove(f.name());
  shm::Region::remove(c.name());
  const auto document = account(out_);
  for (const auto& t : document["topics"]) EXPECT_FALSE(t["kept"].get<bool>()) << t;
  std::string unknown;
  for (const auto& event : document["events"])
    if (const std::string what = event["what"]; what.find("unknown type") != std::string::npos) unknown += what;
  EXPECT_EQ(unknown, "topic 'riddle' of unknown type 'Riddle' is not recorded");
}

TEST_F(Record, GarbageUnderTheNameIsAnEvent) {
  const std::string instance = test::unique_instance("garbage");
  const std::string path = "/dev/shm/" + shm::flight_region(instance);
  std::ofstream(path) << std::string(10'000, 'x');
  Program recorder(arguments(instance, out_));
  ASSERT_TRUE(eventually([&] { return fs::exists(out_ / "log/truth.csv"); }));
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  recorder.signal(SIGTERM);
  EXPECT_EQ(recorder.wait(), 0);
  fs::remove(path);
  EXPECT_NE(test::read_text(out_ / "log/record.json").find("not a wasp region"), std::string::npos);
}

TEST_F(Record, FollowsAFlightThatEndsAndStartsAgain) {
  const std::string instance = test::unique_instance("again");
  Program recorder(arguments(instance, out_));
  for (std::size_t round = 1; round <= 2; ++round) {
    FakeFlight flight(instance);
    for (std::uint32_t n = 0; n < 10; ++n) flight.write_imu(1 + n, n);
    ASSERT_TRUE(eventually([&] { return rows(out_ / "log/imu.csv") == 10 * round; }));
    if (round < 2) continue;
    flight.run->finished = 1;
    ASSERT_EQ(recorder.wait(), 0);
  }
  EXPECT_EQ(rows(out_ / "log/imu.csv"), 20u);
}

TEST_F(Record, WhatAnEarlierFlightLeftIsNotRecorded) {
  const std::string instance = test::unique_instance("left");
  if (const pid_t child = fork(); child == 0) {  // a flight that finished and left its regions behind
    auto* flight = new FakeFlight(instance);
    for (std::uint32_t n = 0; n < 5; ++n) flight->write_imu(1 + n, n);
    flight->run->finished = 1;
    _exit(0);
  } else {
    waitpid(child, nullptr, 0);
  }
  Program recorder(arguments(instance, out_));
  ASSERT_TRUE(eventually([&] { return fs::exists(out_ / "log/truth.csv"); }));
  std::this_thread::sleep_for(std::chrono::milliseconds(500));  // longer than its grace after a finished flight
  FakeFlight flight(instance);
  for (std::uint32_t n = 0; n < 3; ++n) flight.write_imu(100 + n, n);
  ASSERT_TRUE(eventually([&] { return rows(out_ / "log/imu.csv") == 3; }));
  flight.run->finished = 1;
  ASSERT_EQ(recorder.wait(), 0);
  EXPECT_EQ(CsvTable::read(out_ / "log/imu.csv")->integers("exposed_at_ns")[0], 100);
  EXPECT_EQ(topic(out_, "imu").at("before_attach"), 5);
  EXPECT_EQ(topic(out_, "imu").at("lost"), 0);
}

TEST_F(Record, RefusesAFolderThatHoldsARecording) {
  FakeFlight flight(test::unique_instance("refuse"));
  flight.run->finished = 1;
  ASSERT_EQ(Program(arguments(flight.instance, out_)).wait(), 0);
  EXPECT_EQ(Program(arguments(flight.instance, out_)).wait(), 1);
  EXPECT_EQ(Program(arguments(flight.instance, out_, {"--overwrite"})).wait(), 0);
}

TEST_F(Record, UnwritableFolderIsAClearError) {
  std::ofstream(folder_.path / "file") << "not a folder";
  const auto [text, code] = test::run_shell(test::program_path("wasp-record") + " --instance x --out " +
                                            (folder_.path / "file/run").string() + " 2>&1");
  EXPECT_EQ(code, 1);
  EXPECT_NE(text.find("file/run"), std::string::npos) << text;
}

}  // namespace
}  // namespace wasp
