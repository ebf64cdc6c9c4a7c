#include "sim/fakenect_dump.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <iterator>
#include <random>
#include <stdexcept>

#include "sim/fakenect_check.h"

namespace wasp::sim {
namespace {

namespace fs = std::filesystem;

struct FakenectDumpTest : testing::Test {
  fs::path folder = fs::temp_directory_path() / ("wasp_fakenect_" + std::to_string(::getpid()));
  std::vector<std::uint8_t> gray = std::vector<std::uint8_t>(640 * 480);
  std::vector<std::uint16_t> depth = std::vector<std::uint16_t>(640 * 480);
  GrayView gray_view{gray.data(), 640, 480, 640};
  DepthView depth_view{depth.data(), 640, 480, 640};

  FakenectDumpTest() {
    std::mt19937 random(3);
    for (auto& g : gray) g = static_cast<std::uint8_t>(random());
    for (auto& d : depth) d = static_cast<std::uint16_t>(random() % 8000);
  }
  ~FakenectDumpTest() override {
    std::error_code ignored;
    fs::remove_all(folder, ignored);
  }
  void write(int exposures) {
    FakenectDump dump(folder);
    for (int i = 0; i < exposures; ++i) {
      dump.add_accel(i * kSecond / 30, {0, -9.80665f, 0});
      dump.add(i * kSecond / 30, gray_view, depth_view);
    }
  }
  [[nodiscard]] std::vector<std::string> index() const {
    std::ifstream in(folder / "INDEX.txt");
    std::vector<std::string> names;
    for (std::string name; std::getline(in, name);) names.push_back(name);
    return names;
  }
  [[nodiscard]] std::string bytes(const std::string& name) const {
    std::ifstream in(folder / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void rewrite(const std::string& name, const std::string& content) const {
    std::ofstream(folder / name, std::ios::binary) << content;
  }
};

TEST_F(FakenectDumpTest, HoldsWhatTheRecorderOfLibfreenectWouldWrite) {
  write(2);
  const auto names = index();
  ASSERT_EQ(names.size(), 6u);
  EXPECT_EQ(names[0].substr(0, 2) + names[1].substr(0, 2) + names[2].substr(0, 2), "a-r-d-");
  const std::string depth_file = bytes(names[2]), rgb_file = bytes(names[1]), tilt = bytes(names[0]);
  ASSERT_EQ(depth_file.size(), 17u + 614400u);
  EXPECT_EQ(depth_file.substr(0, 17), "P5 640 480 65535\n");
  ASSERT_EQ(rgb_file.size(), 15u + 921600u);
  EXPECT_EQ(rgb_file.substr(0, 15), "P6 640 480 255\n");
  ASSERT_EQ(tilt.size(), 12u);
  std::int16_t up = 0;
  std::memcpy(&up, tilt.data() + 2, 2);
  EXPECT_EQ(up, 819);
  const auto table = drivers::make_kinect_table(drivers::kBurrusLinear);
  for (std::size_t i = 0; i < depth.size(); ++i) {
    std::uint16_t raw = 0;
    std::memcpy(&raw, depth_file.data() + 17 + 2 * i, 2);
    ASSERT_LT(raw, 2048);
    const int mm = depth[i], back = table.mm[raw];
    // Half a step of the sensor and the rounding; beyond the table's ends there is no reading.
    if (back != 0 && mm >= 401 && mm <= 6980)
      ASSERT_NEAR(back, mm, 0.5 * 3.0711e-6 * mm * mm * 1.1 + 1.0) << mm;
    else
      ASSERT_TRUE(mm < 401 || mm > 6980) << mm << " back " << back;
    for (std::size_t c = 0; c < 3; ++c) ASSERT_EQ(static_cast<std::uint8_t>(rgb_file[15 + 3 * i + c]), gray[i]);
  }
}

TEST_F(FakenectDumpTest, TicksAre60MHzAndWrapAndNamesAreInOrderOfArrival) {
  FakenectOptions options;
  options.first_ticks = UINT32_MAX - 3'000'000;
  {
    FakenectDump dump(folder, options);
    for (int i = 0; i < 3; ++i) dump.add(i * kSecond / 30, gray_view, depth_view);
    EXPECT_THROW(dump.add(0, gray_view, depth_view), std::runtime_error);
    EXPECT_THROW(dump.add(kSecond, {gray.data(), 320, 240, 320}, {}), std::runtime_error);
  }
  double last_s = 0;
  std::vector<unsigned> depth_ticks;
  for (const auto& name : index()) {
    char kind = 0;
    double arrival_s = 0;
    unsigned ticks = 0;
    ASSERT_EQ(std::sscanf(name.c_str(), "%c-%lf-%u.", &kind, &arrival_s, &ticks), 3);
    EXPECT_GE(arrival_s, last_s);
    last_s = arrival_s;
    if (kind == 'd') depth_ticks.push_back(ticks);
  }
  ASSERT_EQ(depth_ticks.size(), 3u);
  EXPECT_NEAR(static_cast<double>(depth_ticks[1] - depth_ticks[0]), 2e6, 2);
  EXPECT_LT(depth_ticks[2], depth_ticks[0]) << "wrapped";
}

TEST_F(FakenectDumpTest, CheckNamesWhatFakenectWouldDieOfAndRepairLeavesItOut) {
  write(5);
  EXPECT_TRUE(check_fakenect(folder).problems.empty());
  auto names = index();
  fs::remove(folder / names[1]);                                         // missing: fakenect ends the program
  rewrite(names[2], bytes(names[2]).substr(0, 1000));                    // short: it reads beyond the end
  rewrite(names[4], "P6 320 240 255\n" + std::string(921600, 'x'));      // header of another size
  std::swap(names[7], names[13]);                                        // out of order
  names.insert(names.begin() + 9, "no-name");
  std::ofstream out(folder / "INDEX.txt");
  for (const auto& name : names) out << name << '\n';
  out.close();
  const FakenectReport report = check_fakenect(folder);
  EXPECT_EQ(report.entries, 16u);
  std::string all;
  for (const auto& problem : report.problems) all += problem + '\n';
  for (const char* said : {"INDEX.txt:2: ", "missing", "INDEX.txt:3: ", "1000 bytes instead of 614417", "INDEX.txt:5: ",
                           "does not begin with", "INDEX.txt:10: no-name: no name of the form", "arrived before"})
    EXPECT_NE(all.find(said), std::string::npos) << said << " in\n" << all;
  write_fakenect_index(folder, report);
  EXPECT_TRUE(check_fakenect(folder).problems.empty());
  EXPECT_EQ(check_fakenect(folder).entries, report.good.size());
  EXPECT_TRUE(fs::exists(folder / "INDEX.txt.before"));
}

TEST_F(FakenectDumpTest, NeverWritesOverADump) {
  write(1);
  EXPECT_THROW(FakenectDump{folder}, std::runtime_error);
}

}  // namespace
}  // namespace wasp::sim
