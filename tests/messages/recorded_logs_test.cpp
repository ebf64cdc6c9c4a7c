// Telemetry that other software recorded (both wire versions): counts, values, chunking, and random damage.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <random>
#include <sstream>

#include "messages/mavlink_frame.h"

namespace wasp::mavlink {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Row = std::vector<std::string>;

struct Log {
  const char* name;
  std::size_t frames;
  friend void PrintTo(const Log& log, std::ostream* out) { *out << log.name; }
};

class RecordedLog : public testing::TestWithParam<Log> {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(WASP_SOURCE_DIR) / "../shared/data/mavlink_logs";
    if (!std::filesystem::exists(path(".serial.bin"))) GTEST_SKIP() << "absent: " << path(".serial.bin");
    std::ifstream file(path(".serial.bin"), std::ios::binary);
    stream_.assign(std::istreambuf_iterator<char>(file), {});
  }
  std::string path(const char* suffix) const { return (folder_ / (GetParam().name + std::string(suffix))).string(); }
  /// Rows of a CSV without its head.
  std::vector<Row> rows(const char* suffix) const {
    std::ifstream file(path(suffix));
    std::vector<Row> rows;
    std::string line, cell;
    std::getline(file, line);
    while (std::getline(file, line)) {
      std::istringstream cells(line);
      Row row;
      while (std::getline(cells, cell, ',')) row.push_back(cell);
      rows.push_back(row);
    }
    return rows;
  }
  /// Where each frame lies in the stream, from the table of frames.
  struct Extent {
    std::size_t begin, end;
    bool known;
  };
  std::vector<Extent> extents() const {
    std::vector<Extent> all;
    std::size_t at = 0;
    for (const Row& row : rows(".frames.csv")) {
      const std::size_t length = std::stoul(row[7]) + (row[2] == "0xFD" ? 12 : 8);
      all.push_back({at, at + length, find_message(static_cast<std::uint32_t>(std::stoul(row[6]))) != nullptr});
      at += length;
    }
    return all;
  }

  std::filesystem::path folder_;
  Bytes stream_;
};

/// Checksum bit by bit, sharing nothing with the parser's table.
bool checksum_holds(const Frame& frame) {
  unsigned crc = 0xFFFF;
  const auto add = [&crc](std::uint8_t byte) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1u) != 0 ? (crc >> 1) ^ 0x8408u : crc >> 1;
  };
  const std::size_t end = (frame.version == 2 ? 10u : 6u) + frame.length;
  for (std::size_t i = 1; i < end; ++i) add(frame.wire[i]);
  add(find_message(frame.message_id)->crc_extra);
  return frame.wire[end] == (crc & 0xFF) && frame.wire[end + 1] == crc >> 8;
}

/// Wire bytes of all frames found, the stream fed in chunks of 1 ... `largest` bytes.
std::vector<Bytes> frames_of(Parser& parser, std::span<const std::uint8_t> stream, std::size_t largest,
                             std::mt19937& random) {
  std::vector<Bytes> found;
  const auto keep = [&](const Frame& frame) noexcept {
    EXPECT_TRUE(checksum_holds(frame));
    found.emplace_back(frame.wire.begin(), frame.wire.end());
  };
  while (!stream.empty()) {
    const std::size_t n = std::min<std::size_t>(stream.size(), 1 + random() % largest);
    parser.feed(stream.first(n), keep);
    stream = stream.subspan(n);
  }
  parser.feed(Bytes(300, 0), keep);  // closes every claim still open
  return found;
}

TEST_P(RecordedLog, CountsPerIdAndNoChecksumError) {
  std::map<std::uint32_t, std::size_t> found;
  Parser parser;
  parser.feed(stream_, [&](const Frame& frame) noexcept { ++found[frame.message_id]; });
  std::size_t total = 0;
  for (const Row& row : rows(".counts.csv")) {
    const auto id = static_cast<std::uint32_t>(std::stoul(row[0]));
    const MessageInfo* info = find_message(id);
    ASSERT_NE(info, nullptr) << id;
    total += std::stoul(row[1]);
    EXPECT_EQ(found[id], std::stoul(row[1])) << info->name;
    EXPECT_EQ(info->crc_extra, std::stoul(row[2])) << info->name;
  }
  const Counts& counts = parser.counts();
  EXPECT_EQ(total, GetParam().frames);
  EXPECT_EQ(counts.good, GetParam().frames);
  EXPECT_EQ(counts.unknown_id, 0u);
  EXPECT_EQ(counts.bad_crc, 0u);
  EXPECT_EQ(counts.bad_header, 0u);
  EXPECT_EQ(counts.unsupported_flags, 0u);
  EXPECT_EQ(counts.skipped_bytes, 0u);
}

/// `value` as the CSV's decimal text says, which has seven digits.
void expect_text(float value, const std::string& text, const char* what, std::size_t row) {
  const float want = std::stof(text);
  EXPECT_NEAR(value, want, 1e-6f * std::max(1e-30f, std::abs(want))) << what << " row " << row;
}

TEST_P(RecordedLog, AttitudesAsPublished) {
  const auto want = rows(".attitude.csv");
  std::size_t i = 0;
  Parser parser;
  parser.feed(stream_, [&](const Frame& frame) noexcept {
    if (!frame.is<Attitude>() || i >= want.size()) return;
    const auto m = frame.as<Attitude>();
    const float got[] = {m.roll, m.pitch, m.yaw, m.rollspeed, m.pitchspeed, m.yawspeed};
    EXPECT_EQ(std::to_string(m.time_boot_ms), want[i][0]);
    for (std::size_t k = 0; k < 6; ++k) expect_text(got[k], want[i][k + 1], "attitude", i);
    ++i;
  });
  EXPECT_EQ(i, want.size());
  EXPECT_GT(i, 0u);
}

TEST_P(RecordedLog, RawImuAsPublished) {
  const auto want = rows(".raw_imu.csv");
  std::size_t i = 0;
  Parser parser;
  parser.feed(stream_, [&](const Frame& frame) noexcept {
    if (!frame.is<RawImu>() || i >= want.size()) return;
    const auto m = frame.as<RawImu>();
    const std::int16_t got[] = {m.xacc, m.yacc, m.zacc, m.xgyro, m.ygyro, m.zgyro, m.xmag, m.ymag, m.zmag};
    EXPECT_EQ(std::to_string(m.time_usec), want[i][0]);
    for (std::size_t k = 0; k < 9; ++k) EXPECT_EQ(got[k], std::stoi(want[i][k + 1])) << "row " << i;
    ++i;
  });
  EXPECT_EQ(i, want.size());
  EXPECT_GT(i, 0u);
}

TEST_P(RecordedLog, VfrHudAsPublished) {
  const auto want = rows(".vfr_hud.csv");
  std::size_t i = 0;
  Parser parser;
  parser.feed(stream_, [&](const Frame& frame) noexcept {
    if (!frame.is<VfrHud>() || i >= want.size()) return;
    const auto m = frame.as<VfrHud>();
    const float got[] = {m.airspeed, m.groundspeed, m.alt, m.climb};
    for (std::size_t k = 0; k < 4; ++k) expect_text(got[k], want[i][k], "vfr_hud", i);
    EXPECT_EQ(std::to_string(m.heading), want[i][4]);
    EXPECT_EQ(std::to_string(m.throttle), want[i][5]);
    ++i;
  });
  EXPECT_EQ(i, want.size());
  EXPECT_GT(i, 0u);
}

TEST_P(RecordedLog, ChunksDoNotMatter) {
  std::mt19937 random(3);
  Parser whole;
  const auto want = frames_of(whole, stream_, stream_.size(), random);
  for (std::size_t largest : {1u, 2u, 7u, 64u}) {
    Parser parser;
    EXPECT_EQ(frames_of(parser, stream_, largest, random), want) << largest;
    EXPECT_EQ(parser.counts().unknown_id, whole.counts().unknown_id);
  }
}

/// The stream with random bytes flipped, dropped and inserted, and the wire bytes of the frames that stayed whole.
struct Damaged {
  Bytes stream;
  std::vector<Bytes> intact;
};

/// `rate`: one damage in so many bytes.
template <class Extents>
Damaged damage(const Bytes& stream, const Extents& extents, unsigned rate, std::mt19937& random) {
  Damaged result;
  bool start_taken = false;  // the frame before lost its last byte and this frame's start byte looks the same
  for (const auto& extent : extents) {
    bool whole = !start_taken;
    start_taken = false;
    for (std::size_t i = extent.begin; i < extent.end; ++i) {
      const unsigned kind = random() % rate == 0 ? 1 + static_cast<unsigned>(random() % 3) : 0;
      if (kind == 3) result.stream.push_back(static_cast<std::uint8_t>(random()));
      if (kind != 2)
        result.stream.push_back(static_cast<std::uint8_t>(stream[i] ^ (kind == 1 ? 1u << random() % 8 : 0)));
      if (kind == 2 && i + 1 == extent.end && extent.end < stream.size()) start_taken = stream[i] == stream[i + 1];
      whole = whole && (kind == 0 || (kind == 3 && i == extent.begin));  // before the start byte: between two frames
    }
    if (whole && extent.known) result.intact.emplace_back(&stream[extent.begin], &stream[extent.end - 1] + 1);
  }
  return result;
}

TEST_P(RecordedLog, EveryUndamagedFrameIsFound) {
  std::size_t intact = 0, accepted = 0, seeds = 0;
  const auto where = extents();
  for (const unsigned rate : {20u, 100u, 1000u}) {
    for (unsigned seed = 0; seed < 20; ++seed, ++seeds) {
      std::mt19937 random(seed * 7919 + rate);
      const Damaged damaged = damage(stream_, where, rate, random);
      Parser parser;
      const auto found = frames_of(parser, damaged.stream, 64, random);
      auto next = found.begin();
      for (const Bytes& frame : damaged.intact) {
        next = std::find(next, found.end(), frame);
        ASSERT_NE(next, found.end()) << "an undamaged frame was lost, rate " << rate << " seed " << seed;
        ++next;
      }
      intact += damaged.intact.size();
      accepted += found.size();
    }
  }
  EXPECT_GE(accepted, intact);
  RecordProperty("intact", std::to_string(intact));
  RecordProperty("accepted", std::to_string(accepted));
  std::printf("[ measured ] %zu damaged streams: %zu undamaged frames, all found; %zu frames accepted\n", seeds, intact,
              accepted);
}

INSTANTIATE_TEST_SUITE_P(Logs, RecordedLog, testing::Values(Log{"ardupilot_v2", 1426}, Log{"vtol_v1_part1", 6000}),
                         [](const auto& log) { return std::string(log.param.name); });

}  // namespace
}  // namespace wasp::mavlink
