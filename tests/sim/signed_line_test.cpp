// wasp's side of a signed line against the simulated autopilot's: who signs is heard, who does not is refused by name.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "drivers/autopilot_link.h"
#include "rt/clock.h"
#include "sim/simulator.h"

namespace wasp::sim {
namespace {

struct Heard {
  int beats = 0, attitudes = 0, acks = 0;
  std::uint8_t result = 255;
  bool armed = false;
  std::vector<std::uint8_t> replies;

  void on_imu(const ImuSample&) noexcept {}
  void on_attitude(const AttitudeSample&) noexcept { ++attitudes; }
  void on_heartbeat(const drivers::AutopilotStatus& status) noexcept { ++beats, armed = status.armed; }
  void on_ack(std::uint16_t, std::uint8_t code) noexcept { ++acks, result = code; }
  void on_statustext(std::uint8_t, std::string_view) noexcept {}
  void reply(std::span<const std::uint8_t> frame) noexcept { replies.insert(replies.end(), frame.begin(), frame.end()); }
};

class SignedLine : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (std::filesystem::temp_directory_path() / "wasp_line_XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string key_file(char digit) const {
    const auto path = folder_ / std::string(1, digit);
    std::ofstream(path) << std::string(64, digit);
    chmod(path.c_str(), 0600);
    return path.string();
  }
  /// Both sides for a second of virtual time, with an order to arm in the middle of it.
  static void talk(Simulator& sim, drivers::AutopilotLink& link, Heard& heard) {
    std::array<std::uint8_t, mavlink::kMaxFrame> out;
    std::vector<std::uint8_t> bytes;
    for (int i = 0; i < 200; ++i) {
      sim.advance_to(sim.now_ns() + 5 * kMillisecond);
      sim.drain(bytes);
      link.receive(bytes, sim.now_ns(), heard);
      bytes.clear();
      sim.from_companion(heard.replies);  // first: they were signed first
      heard.replies.clear();
      if (i == 100) sim.from_companion(std::span(out).first(link.encode_set_mode(1, 0, 0, out)));
      if (i % 40 == 0) sim.from_companion(std::span(out).first(link.encode_timesync_request(sim.now_ns(), out)));
    }
  }
  std::filesystem::path folder_;
};

SimConfig with_key(const std::string& file) {
  SimConfig config;
  config.signing_key_file = file;
  return config;
}

TEST_F(SignedLine, BothSidesUnderstandEachOther) {
  Simulator sim(with_key(key_file('a')), rt::now());
  drivers::LinkSigning signing({"require", key_file('a')}, drivers::LinkSigning::kFlightLink);
  drivers::AutopilotLink link;
  link.use_signing(signing);
  Heard heard;
  talk(sim, link, heard);
  EXPECT_GT(heard.beats, 0);
  EXPECT_GT(heard.attitudes, 50);
  EXPECT_EQ(heard.acks, 1);
  EXPECT_EQ(heard.result, 0);
  EXPECT_GT(link.counts().timesync_accepted, 0u);
  EXPECT_EQ(link.wire_counts().refused, 0u);
  EXPECT_EQ(link.wire_counts().signed_frames, link.wire_counts().good);
  const auto& heard_by_sim = *sim.link().signature_counts();
  EXPECT_EQ(heard_by_sim.refused(), 0u) << "unsigned " << heard_by_sim.unsigned_refused << " wrong " << heard_by_sim.wrong
                                        << " old " << heard_by_sim.old << " late " << heard_by_sim.too_late;
  EXPECT_GT(sim.link().signature_counts()->verified, 5u);
}

TEST_F(SignedLine, AnotherKeyIsNotHeardOnEitherSide) {
  Simulator sim(with_key(key_file('a')), rt::now());
  drivers::LinkSigning signing({"require", key_file('b')}, drivers::LinkSigning::kFlightLink);
  drivers::AutopilotLink link;
  link.use_signing(signing);
  Heard heard;
  talk(sim, link, heard);
  EXPECT_EQ(heard.beats + heard.attitudes + heard.acks, 0);
  EXPECT_EQ(link.signature_counts()->wrong, link.signature_counts()->refused());
  EXPECT_GT(link.signature_counts()->wrong, 50u);
  EXPECT_EQ(drivers::refusal_since({}, *link.signature_counts()), "signed with another key, or damaged");
  EXPECT_EQ(sim.link().frames_received(), 0u);
  EXPECT_GT(sim.link().signature_counts()->wrong, 0u);
}

TEST_F(SignedLine, UnsignedIsRefusedWhereSigningIsRequired) {
  Simulator plain(SimConfig{}, rt::now()), strict(with_key(key_file('a')), rt::now());
  drivers::LinkSigning required({"require", key_file('a')}, 1), lenient({"sign", key_file('a')}, 1);
  drivers::AutopilotLink deaf, hearing, unsigned_link;
  deaf.use_signing(required);
  hearing.use_signing(lenient);
  Heard nothing, everything, readable;
  talk(plain, deaf, nothing);
  EXPECT_EQ(nothing.beats + nothing.attitudes, 0);
  EXPECT_EQ(drivers::refusal_since({}, *deaf.signature_counts()), "not signed");
  talk(plain, hearing, everything);
  EXPECT_GT(everything.beats, 0);
  EXPECT_EQ(hearing.wire_counts().refused, 0u);
  talk(strict, unsigned_link, readable);
  EXPECT_EQ(readable.acks, 0) << "the autopilot obeys nobody who does not sign";
  EXPECT_GT(strict.link().signature_counts()->unsigned_refused, 0u);
}

TEST_F(SignedLine, SettingsThatCannotBeAreRefusedByName) {
  const auto why = [](const drivers::SigningSettings& settings) {
    try {
      drivers::open_signing(settings, 1);
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(drivers::open_signing({}, 1), nullptr);
  EXPECT_NE(why({"require", ""}).find("needs signing_key_file"), std::string::npos);
  EXPECT_NE(why({"sign", (folder_ / "absent").string()}).find("absent: No such file"), std::string::npos);
}

TEST_F(SignedLine, GoesOnFromTheTimeItHadReached) {
  const std::string file = key_file('a');
  std::uint64_t reached = 0;
  {
    drivers::LinkSigning signing({"sign", file}, 1);
    signing.clock().advance_to(signing.clock().now() + 10 * mavlink::kSigningMinute);
    reached = signing.clock().now();
    ASSERT_TRUE(signing.save());
  }
  EXPECT_GT(drivers::LinkSigning({"sign", file}, 1).clock().now(), reached);
}

}  // namespace
}  // namespace wasp::sim
