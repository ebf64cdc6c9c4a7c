// The rules of a signed link, and the files behind it.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <numeric>
#include <thread>

#include "messages/mavlink_frame.h"
#include "messages/signing_key.h"

namespace wasp::mavlink {
namespace {

using Bytes = std::vector<std::uint8_t>;
constexpr std::uint64_t kNow = 1'000'000'000;

SigningKey a_key(std::uint8_t first = 1) {
  SigningKey key;
  std::iota(key.bytes.begin(), key.bytes.end(), first);
  return key;
}

/// A sender of heartbeats that knows a key.
struct Sender {
  explicit Sender(std::uint64_t now = kNow, std::uint8_t link = 7, std::uint8_t component = 1,
                  SigningKey key = a_key())
      : clock(now), signer(key, clock, link), encoder(1, component) {
    encoder.sign_with(signer);
  }
  template <class M = Heartbeat>
  Bytes frame(const M& message = M{}) {
    Bytes out(kMaxFrame);
    out.resize(encoder.encode(message, out));
    return out;
  }
  SigningClock clock;
  FrameSigner signer;
  Encoder encoder;
};

struct Receiver {
  explicit Receiver(bool required = true, std::uint64_t now = kNow) : clock(now), check(a_key(), clock, required) {
    parser.check_signatures(check);
  }
  std::size_t take(const Bytes& bytes) {
    std::size_t n = 0;
    parser.feed(bytes, [&n](const Frame&) noexcept { ++n; });
    return n;
  }
  [[nodiscard]] const SignatureCounts& counts() const { return check.counts(); }
  SigningClock clock;
  SignatureCheck check;
  Parser parser;
};

Bytes unsigned_frame(const auto& message, std::uint8_t component = 1) {
  Encoder encoder(1, component);
  Bytes out(kMaxFrame);
  out.resize(encoder.encode(message, out));
  return out;
}

TEST(Signing, TimeIsTheGuides) {
  EXPECT_EQ(signing_time_of(TimeNs{1420070400} * kSecond), 0u);
  EXPECT_EQ(signing_time_of(TimeNs{1420070401} * kSecond + 10 * kMicrosecond), 100'001u);
  EXPECT_EQ(signing_time_of(0), 0u);
}

TEST(Signing, EachFrameHasALaterTimeAndPasses) {
  Sender sender;
  Receiver receiver;
  for (int i = 0; i < 300; ++i) EXPECT_EQ(receiver.take(sender.frame()), 1u);
  EXPECT_EQ(receiver.counts().verified, 300u);
  EXPECT_EQ(sender.clock.now(), kNow + 300);
}

TEST(Signing, RefusesAnotherKeyADamagedSignatureAndAnyChangedBit) {
  Receiver receiver;
  Sender stranger(kNow, 7, 1, a_key(2));
  EXPECT_EQ(receiver.take(stranger.frame()), 0u);
  Sender sender;
  Bytes frame = sender.frame();
  for (std::size_t i = frame.size() - kSignatureBytes; i < frame.size(); ++i) {
    Bytes damaged = frame;
    damaged[i] ^= 1;
    EXPECT_EQ(receiver.take(damaged), 0u) << i;
  }
  EXPECT_EQ(receiver.counts().wrong, 1u + kSignatureBytes);
  EXPECT_EQ(receiver.take(frame), 1u);
}

TEST(Signing, RefusesReplays) {
  Sender sender;
  Receiver receiver;
  const Bytes first = sender.frame(), second = sender.frame();
  EXPECT_EQ(receiver.take(first), 1u);
  EXPECT_EQ(receiver.take(first), 0u);
  EXPECT_EQ(receiver.take(second), 1u);
  EXPECT_EQ(receiver.take(first), 0u);
  EXPECT_EQ(receiver.counts().old, 2u);
}

TEST(Signing, TheFirstOfAStreamMayBeAMinuteLate) {
  Receiver receiver;
  Sender just(kNow - kSigningMinute, 1), late(kNow - kSigningMinute - 1, 2);
  EXPECT_EQ(receiver.take(late.frame()), 0u);
  EXPECT_EQ(receiver.take(just.frame()), 1u);
  EXPECT_EQ(receiver.counts().too_late, 1u);
}

TEST(Signing, OnlyVerifiedFramesAdvanceTheClock) {
  Receiver receiver;
  Sender stranger(kNow + 5 * kSigningMinute, 1, 1, a_key(9));
  receiver.take(stranger.frame());
  EXPECT_EQ(receiver.clock.now(), kNow);
  Sender ahead(kNow + 5 * kSigningMinute, 1);
  EXPECT_EQ(receiver.take(ahead.frame()), 1u);
  EXPECT_EQ(receiver.clock.now(), kNow + 5 * kSigningMinute + 1);
}

TEST(Signing, UnsignedFramesPassWhereAllowed) {
  Receiver strict, lenient(false);
  EXPECT_EQ(strict.take(unsigned_frame(Heartbeat{})), 0u);
  EXPECT_EQ(strict.take(unsigned_frame(RadioStatus{})), 1u);
  EXPECT_EQ(lenient.take(unsigned_frame(Heartbeat{})), 1u);
  EXPECT_EQ(strict.counts().unsigned_refused, 1u);
  EXPECT_EQ(strict.counts().unsigned_allowed, 1u);
  EXPECT_EQ(strict.parser.counts().refused, 1u);
}

TEST(Signing, StreamsAreApart) {
  Receiver receiver;
  Sender first(kNow + 100, 1), second(kNow, 2), other_component(kNow, 1, 190);
  EXPECT_EQ(receiver.take(first.frame()), 1u);
  EXPECT_EQ(receiver.take(second.frame()), 1u);
  EXPECT_EQ(receiver.take(other_component.frame()), 1u);
}

TEST(Signing, RefusesMoreStreamsThanItRemembers) {
  Receiver receiver;
  for (std::uint8_t link = 0; link < 20; ++link) receiver.take(Sender(kNow + 1, link).frame());
  EXPECT_EQ(receiver.counts().verified, 16u);
  EXPECT_EQ(receiver.counts().no_room, 4u);
}

TEST(Signing, ThreadsAreStreamsOfTheirOwn) {
  Sender sender;
  Receiver receiver;
  Bytes late, early;
  std::thread([&] { late = sender.frame(); }).join();
  early = sender.frame();
  EXPECT_EQ(receiver.take(early), 1u);
  EXPECT_EQ(receiver.take(late), 1u) << "signed before, written after";
}

/// A signed frame that lost bytes of its signature does not take its neighbour with it, with the key and without.
TEST(Signing, ASignatureCutShortTakesNoNeighbour) {
  for (const bool with_key : {false, true}) {
    for (std::size_t lost = 1; lost <= kSignatureBytes; ++lost) {
      Sender sender;
      Receiver receiver;
      Parser keyless;
      Parser& parser = with_key ? receiver.parser : keyless;
      Bytes stream = sender.frame(), damaged = sender.frame();
      damaged.resize(damaged.size() - lost);
      stream.insert(stream.end(), damaged.begin(), damaged.end());
      for (int i = 0; i < 3; ++i) {
        const Bytes next = sender.frame();
        stream.insert(stream.end(), next.begin(), next.end());
      }
      std::vector<std::uint8_t> sequences;
      parser.feed(stream, [&](const Frame& f) noexcept { sequences.push_back(f.sequence); });
      const Bytes undamaged = {0, 2, 3, 4}, with_the_cut_one = {0, 1, 2, 3, 4};
      EXPECT_EQ(sequences, with_key ? undamaged : with_the_cut_one) << lost << " bytes lost";
      EXPECT_EQ(parser.counts().bad_crc, 0u);
    }
  }
}

class KeyFile : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (std::filesystem::temp_directory_path() / "wasp_key_XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    path_ = (folder_ / "key").string();
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  void write(const std::string& content, mode_t mode = 0600) const {
    std::ofstream(path_, std::ios::binary) << content;
    ASSERT_EQ(chmod(path_.c_str(), mode), 0);
  }
  std::string refusal() const {
    try {
      load_signing_key(path_);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  }
  std::filesystem::path folder_;
  std::string path_;
};

TEST_F(KeyFile, RawOrAsDigits) {
  std::string raw, digits;
  for (const std::uint8_t byte : a_key().bytes) {
    raw += static_cast<char>(byte);
    digits += "0123456789abcdef"[byte >> 4];
    digits += "0123456789ABCDEF"[byte & 15];
  }
  for (const std::string& content : {raw, digits, digits + "\n", digits + "\r\n"}) {
    write(content);
    EXPECT_EQ(load_signing_key(path_).bytes, a_key().bytes);
  }
}

TEST_F(KeyFile, RefusesWithoutTellingWhatItHolds) {
  EXPECT_NE(refusal().find("No such file"), std::string::npos);
  write("secret-that-is-too-short");
  EXPECT_NE(refusal().find("not 32 bytes"), std::string::npos);
  EXPECT_EQ(refusal().find("secret"), std::string::npos);
  write(std::string(63, 'a') + "g");
  EXPECT_NE(refusal().find("not 32 bytes"), std::string::npos);
  write(std::string(64, '0'));
  EXPECT_NE(refusal().find("all zero"), std::string::npos);
  write(std::string(4096, 'a'));
  EXPECT_NE(refusal().find("not 32 bytes"), std::string::npos);
}

TEST_F(KeyFile, RefusesWhatOthersMayRead) {
  for (const mode_t mode : {0640, 0604, 0660, 0644}) {
    write(std::string(64, 'a'), mode);
    EXPECT_NE(refusal().find("chmod 600"), std::string::npos) << mode;
  }
  path_ = folder_.string();
  EXPECT_NE(refusal().find("not a regular file"), std::string::npos);
}

TEST_F(KeyFile, KeepsTheTimeBesideIt) {
  const std::string file = signing_time_path(path_);
  EXPECT_EQ(load_signing_time(file), 0u);
  ASSERT_TRUE(save_signing_time(file, 123456789));
  ASSERT_TRUE(save_signing_time(file, 223456789));
  EXPECT_EQ(load_signing_time(file), 223456789u);
  std::ofstream(file) << "rubbish";
  EXPECT_EQ(load_signing_time(file), 0u);
  std::ofstream(file) << "99999999999999999999";
  EXPECT_EQ(load_signing_time(file), 0u);
  EXPECT_FALSE(save_signing_time((folder_ / "none" / "time").string(), 1));
}

TEST(Signing, StartsAheadOfWhatWasSentBefore) {
  EXPECT_EQ(first_signing_time(kNow, 0), kNow);
  EXPECT_EQ(first_signing_time(kNow, kNow - 1), kNow);
  EXPECT_EQ(first_signing_time(0, kNow), kNow + kSigningMinute) << "no clock: a minute may have been sent unsaved";
}

}  // namespace
}  // namespace wasp::mavlink
