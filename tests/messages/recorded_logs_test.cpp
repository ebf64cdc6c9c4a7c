// Telemetry that other software recorded (both wire versions): every frame, field values, pieces, and random damage.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "tools/mavlink_damage.h"
#include "tools/mavlink_fields.h"

namespace wasp::tools {
namespace {

using Row = std::vector<std::string>;
using nlohmann::ordered_json;

struct LogFile {
  const char* name;
  const char* suffix;
  std::size_t frames;
  friend void PrintTo(const LogFile& log, std::ostream* out) { *out << log.name << log.suffix; }
};

const MavlinkDescription& description() {
  static const MavlinkDescription d = MavlinkDescription::load(default_description());
  return d;
}

class RecordedLog : public testing::TestWithParam<LogFile> {
 protected:
  void SetUp() override {
    const std::string file = path(GetParam().suffix);
    if (!std::filesystem::exists(file)) GTEST_SKIP() << "absent: " << file;
    log_ = read_mavlink_log(file, description().rows());
    scan_ = scan(log_.stream, description().rows());
  }
  static std::string path(const std::string& suffix) {
    const auto folder = std::filesystem::path(WASP_SOURCE_DIR) / "../shared/data/mavlink_logs";
    return (folder / (GetParam().name + suffix)).string();
  }
  /// Rows of a CSV without its head.
  static std::vector<Row> rows(const char* suffix) {
    std::ifstream file(path(suffix));
    std::vector<Row> table;
    std::string line, cell;
    std::getline(file, line);
    while (std::getline(file, line)) {
      std::istringstream cells(line);
      for (table.emplace_back(); std::getline(cells, cell, ',');) table.back().push_back(cell);
    }
    return table;
  }
  /// The decoded frames of message `id` against a table: `fields` in the order of its columns.
  void expect_table(std::uint32_t id, const char* suffix, const std::vector<const char*>& fields) const {
    const auto want = rows(suffix);
    std::size_t i = 0;
    for (const FoundFrame& frame : scan_.frames) {
      if (frame.id != id) continue;
      ASSERT_LT(i, want.size());
      const ordered_json got = frame_json(description(), log_, frame, i).at("fields");
      for (std::size_t k = 0; k < fields.size(); ++k) expect_cell(got.at(fields[k]), want[i][k], fields[k], i);
      ++i;
    }
    EXPECT_EQ(i, want.size());
    EXPECT_GT(i, 0u);
  }
  /// Integers are equal; a float, exact by itself, is what the table's seven digits say.
  static void expect_cell(const ordered_json& got, const std::string& text, const char* field, std::size_t row) {
    if (got.is_number_integer()) {
      EXPECT_EQ(got.dump(), text) << field << " row " << row;
      return;
    }
    const double value = got.get<double>(), want = std::stod(text);
    EXPECT_EQ(value, static_cast<double>(static_cast<float>(value))) << field << " row " << row;
    EXPECT_NEAR(value, want, 1e-6 * std::max(1e-30, std::abs(want))) << field << " row " << row;
  }

  MavlinkLog log_;
  LogScan scan_;
};

TEST_P(RecordedLog, EveryFrameAsPublished) {
  const auto want = rows(".frames.csv");
  ASSERT_EQ(scan_.frames.size(), GetParam().frames);
  ASSERT_EQ(want.size(), scan_.frames.size());
  for (std::size_t i = 0; i < want.size(); ++i) {
    const FoundFrame& f = scan_.frames[i];
    const Row got = {std::to_string(f.system_id), std::to_string(f.component_id), std::to_string(f.sequence),
                     std::to_string(f.id), std::to_string(f.length)};
    EXPECT_EQ(got, Row(want[i].begin() + 3, want[i].begin() + 8)) << "frame " << i;
    EXPECT_EQ(f.version, want[i][2] == "0xFD" ? 2 : 1) << "frame " << i;
    if (log_.kind == LogKind::kTlog) {
      EXPECT_EQ(log_.time_us(f.begin), std::stoull(want[i][1])) << "frame " << i;
    }
  }
}

TEST_P(RecordedLog, CountsAsPublished) {
  EXPECT_EQ(log_.kind, std::string(GetParam().suffix) == ".tlog" ? LogKind::kTlog : LogKind::kRaw);
  std::map<std::uint32_t, std::uint64_t> want;
  for (const Row& row : rows(".counts.csv")) {
    const auto id = static_cast<std::uint32_t>(std::stoul(row[0]));
    want[id] = std::stoul(row[1]);
    ASSERT_NE(mavlink::find_message(id), nullptr) << id;
    EXPECT_EQ(mavlink::find_message(id)->crc_extra, std::stoul(row[2])) << id;
  }
  EXPECT_EQ(scan_.ids, want);
  EXPECT_TRUE(scan_.unknown_ids.empty());
  for (const std::uint64_t n : {scan_.bad_checksums, scan_.unsupported_flags, scan_.stray_bytes, scan_.truncated_bytes,
                                scan_.parser.skipped_bytes, scan_.parser.bad_header})
    EXPECT_EQ(n, 0u);
}

TEST_P(RecordedLog, FieldsAsPublished) {
  expect_table(30, ".attitude.csv", {"time_boot_ms", "roll", "pitch", "yaw", "rollspeed", "pitchspeed", "yawspeed"});
  expect_table(27, ".raw_imu.csv",
               {"time_usec", "xacc", "yacc", "zacc", "xgyro", "ygyro", "zgyro", "xmag", "ymag", "zmag"});
  expect_table(74, ".vfr_hud.csv", {"airspeed", "groundspeed", "alt", "climb", "heading", "throttle"});
}

/// Without the rows of some messages these are counted as unknown, and all others are found as before.
TEST_P(RecordedLog, UnknownMessagesAreCounted) {
  std::vector<mavlink::MessageInfo> fewer;
  for (const mavlink::MessageInfo& row : description().rows())
    if (row.id != 22 && row.id != 27 && row.id != 110 && row.id != 165 && row.id != 178) fewer.push_back(row);
  const LogScan less = scan(log_.stream, fewer);
  for (const auto& [id, count] : scan_.ids) {
    const auto& where = mavlink::find_message(id, fewer) != nullptr ? less.ids : less.unknown_ids;
    // The last frame may be of unknown id with nothing behind it; it still counts.
    EXPECT_EQ(where.contains(id) ? where.at(id) : 0, count) << id;
  }
  EXPECT_EQ(less.bad_checksums, 0u);
  EXPECT_EQ(less.stray_bytes, 0u);
}

TEST_P(RecordedLog, PiecesDoNotMatter) {
  const ChunkResult result = chunk_campaign(log_.stream, scan_.frames, description().rows());
  EXPECT_EQ(result.passes, 80u);
  EXPECT_EQ(result.different, 0u);
}

TEST_P(RecordedLog, EveryUndamagedFrameIsFound) {
  for (const DamageResult& d : damage_campaigns(log_.stream, scan_.frames, description().rows(), 5)) {
    EXPECT_GT(d.damaged_bytes, 1000u) << d.name;
    EXPECT_GT(d.undamaged, scan_.frames.size()) << d.name;
    EXPECT_EQ(d.lost, 0u) << d.name;
    EXPECT_EQ(d.bad_checksum, 0u) << d.name;
    std::printf("[ measured ] %s: %zu streams, %zu undamaged frames, %zu lost, %zu to collisions; %zu accepted\n",
                d.name.c_str(), std::size_t{d.streams}, std::size_t{d.undamaged}, std::size_t{d.lost},
                std::size_t{d.lost_to_collisions}, std::size_t{d.accepted});
  }
}

INSTANTIATE_TEST_SUITE_P(Logs, RecordedLog,
                         testing::Values(LogFile{"ardupilot_v2", ".serial.bin", 1426},
                                         LogFile{"ardupilot_v2", ".tlog", 1426},
                                         LogFile{"vtol_v1_part1", ".serial.bin", 6000},
                                         LogFile{"vtol_v1_part1", ".tlog", 6000}),
                         [](const auto& log) {
                           return std::string(log.param.name) +
                                  (std::string(log.param.suffix) == ".tlog" ? "_tlog" : "_raw");
                         });

}  // namespace
}  // namespace wasp::tools
