// The pure pieces of the services: parameters, acknowledgements, texts.
#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "drivers/command_server.h"
#include "drivers/parameter_server.h"
#include "drivers/text_sender.h"

namespace wasp::drivers {
namespace {

using namespace mavlink;  // NOLINT: message names

/// A message as a frame of this sender.
template <class M, class Use>
void as_frame(const M& message, Use&& use, std::uint8_t system = 255, std::uint8_t component = 190) {
  Encoder encoder(system, component);
  std::array<std::uint8_t, kMaxFrame> out{};
  Parser parser;
  parser.feed(std::span(out).first(encoder.encode(message, out)), [&](const Frame& frame) { use(frame); });
}

class Parameters : public testing::Test {
 protected:
  explicit Parameters(ParameterEncoding encoding = ParameterEncoding::kBytewise) : server_(encoding) {
    EXPECT_TRUE(server_.add("CTRL_RATE_HZ", mav_param_type::kReal32, 20));
    EXPECT_TRUE(server_.add("COMP_ID", mav_param_type::kInt32, 191));
    EXPECT_TRUE(server_.add_writable("TLM_OBST_HZ", mav_param_type::kReal32, 10, 0, 50));
  }
  template <class M>
  bool ask(M m, std::uint8_t system = 1, std::uint8_t component = 191) {
    m.target_system = system, m.target_component = component;
    bool request = false;
    as_frame(m, [&](const Frame& f) {
      request = server_.receive(f, self_, [&](std::size_t row) noexcept { changed_.push_back(row); });
    });
    return request;
  }
  std::vector<ParamValue> answers() {
    std::vector<ParamValue> list;
    for (ParamValue value; server_.next(value);) list.push_back(value);
    return list;
  }
  void set(const char* name, std::uint8_t type, float value) {
    ParamSet m;
    m.param_id = parameter_name(name), m.param_type = type, m.param_value = value;
    ask(m);
  }

  LinkIdentity self_;
  ParameterServer server_;
  std::vector<std::size_t> changed_;
};

TEST_F(Parameters, AListIsToldOnceInOrderHoweverManyAsk) {
  for (int i = 0; i < 100; ++i) ask(ParamRequestList{}, 1, 0);  // to everybody, and to us
  const auto all = answers();
  ASSERT_EQ(all.size(), 3u);
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(all[i].param_index, i);
    EXPECT_EQ(all[i].param_count, 3u);
  }
  EXPECT_EQ(name_of(all[1].param_id), "COMP_ID");
  EXPECT_EQ(std::bit_cast<std::uint32_t>(all[1].param_value), 191u) << "byte-wise";
  EXPECT_EQ(all[0].param_value, 20.f);
}

TEST_F(Parameters, OneIsReadByNameOrByIndex) {
  ParamRequestRead m;
  m.param_index = 2;
  ask(m);
  m.param_index = -1, m.param_id = parameter_name("COMP_ID");
  ask(m);
  const auto told = answers();
  ASSERT_EQ(told.size(), 2u);
  EXPECT_EQ(told[0].param_index, 1u);
  EXPECT_EQ(told[1].param_index, 2u);
  m.param_id = parameter_name("NO_SUCH");
  ask(m);
  m.param_index = 3;
  ask(m);
  EXPECT_TRUE(answers().empty());
}

TEST_F(Parameters, OthersRequestsAreNotOurs) {
  EXPECT_TRUE(ask(ParamRequestList{}, 1, 1));
  EXPECT_TRUE(ask(ParamRequestList{}, 2, 191));
  EXPECT_TRUE(answers().empty());
  EXPECT_FALSE(ask(CommandLong{}));
}

TEST_F(Parameters, ASetOfWhatIsFixedIsAnsweredByTheValueInForce) {
  set("CTRL_RATE_HZ", mav_param_type::kReal32, 50);
  const auto told = answers();
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].param_value, 20.f);
  EXPECT_TRUE(changed_.empty());
}

TEST_F(Parameters, ASetOfARateIsTakenWithinItsRangeOnly) {
  set("TLM_OBST_HZ", mav_param_type::kReal32, 5);
  EXPECT_EQ(answers().at(0).param_value, 5.f);
  EXPECT_EQ(changed_, std::vector<std::size_t>{2});
  for (const float bad : {-1.f, 51.f, std::numeric_limits<float>::quiet_NaN()}) {
    set("TLM_OBST_HZ", mav_param_type::kReal32, bad);
    EXPECT_EQ(answers().at(0).param_value, 5.f) << bad;
  }
  set("TLM_OBST_HZ", mav_param_type::kInt32, 7);  // another type: refused, and said so
  EXPECT_EQ(answers().at(0).param_value, 5.f);
  EXPECT_EQ(changed_.size(), 1u);
}

TEST_F(Parameters, TheTableRefusesWhatItCannotCarry) {
  EXPECT_FALSE(server_.add("COMP_ID", mav_param_type::kInt32, 1)) << "twice";
  EXPECT_FALSE(server_.add("A_NAME_OF_17_CHAR", mav_param_type::kInt32, 1));
  EXPECT_FALSE(server_.add("BIG", mav_param_type::kUint8, 256));
  EXPECT_FALSE(server_.add("", mav_param_type::kUint8, 1));
}

class CastParameters : public Parameters {
 protected:
  CastParameters() : Parameters(ParameterEncoding::kCCast) {}
};

TEST_F(CastParameters, AnIntegerTravelsAsANumber) {
  ask(ParamRequestList{});
  EXPECT_EQ(answers().at(1).param_value, 191.f);
}

TEST(Commands, LongAndIntAreTheSameAndTargetsCount) {
  const LinkIdentity self;
  const auto of = [&](auto m, std::uint8_t system, std::uint8_t component) {
    m.command = 512, m.param1 = 148, m.target_system = system, m.target_component = component;
    std::optional<ServiceCommand> found;
    as_frame(m, [&](const Frame& f) { found = command_for(self, f); });
    return found;
  };
  for (const bool as_int : {false, true}) {
    const auto one = [&](std::uint8_t s, std::uint8_t c) {
      return as_int ? of(CommandInt{}, s, c) : of(CommandLong{}, s, c);
    };
    const auto ours = one(1, 191);
    ASSERT_TRUE(ours);
    EXPECT_EQ(ours->command, 512);
    EXPECT_EQ(ours->param[0], 148.f);
    EXPECT_TRUE(ours->by_name);
    EXPECT_EQ(ours->sender_system, 255);
    EXPECT_FALSE(one(1, 0)->by_name);
    EXPECT_TRUE(one(0, 0));
    EXPECT_FALSE(one(1, 1));
    EXPECT_FALSE(one(2, 191));
  }
}

TEST(Commands, AcknowledgementsWaitInOrderAndAFloodIsBounded) {
  AckQueue acks;
  ServiceCommand c;
  c.sender_system = 255, c.sender_component = 190;
  for (std::uint16_t i = 0; i < 100; ++i) c.command = i, acks.add(c, 3);
  std::uint16_t n = 0;
  for (; acks.waiting(); ++n) EXPECT_EQ(acks.take().command, n);
  EXPECT_EQ(n, AckQueue::kMost);
}

std::string text_of(const Statustext& m) {
  const std::string_view all(m.text.data(), m.text.size());
  return std::string(all.substr(0, std::min(all.find('\0'), all.size())));
}

TEST(Texts, AShortOneIsOneMessageAndALongOneChunksOfOneId) {
  TextSender sender;
  ASSERT_TRUE(sender.offer(2, "failsafe because: link lost", 0));
  const std::string longer(120, 'x');
  ASSERT_TRUE(sender.offer(4, longer, 0));
  ASSERT_TRUE(sender.offer(4, std::string(100, 'y'), 0));
  Statustext m = sender.take(0);
  EXPECT_EQ(text_of(m), "failsafe because: link lost");
  EXPECT_EQ(m.severity, 2);
  EXPECT_EQ(m.id, 0);
  for (const std::string& whole : {longer, std::string(100, 'y')}) {
    std::string together;
    std::set<std::uint16_t> ids;
    for (std::uint8_t chunk = 0; chunk < 3; ++chunk) {
      ASSERT_TRUE(sender.due(0));
      m = sender.take(0);
      EXPECT_EQ(m.chunk_seq, chunk);
      ids.insert(m.id);
      together += text_of(m);
    }
    EXPECT_EQ(together, whole);
    EXPECT_EQ(m.text.back(), '\0') << "a NUL ends it";
    EXPECT_EQ(ids.size(), 1u);
    EXPECT_NE(*ids.begin(), 0);
  }
  EXPECT_FALSE(sender.due(0));
}

TEST(Texts, AFloodIsLimitedAndARepeatDropped) {
  TextSender sender;
  int sent = 0;
  for (TimeNs now = 0; now < 60 * kSecond; now += 10 * kMillisecond) {
    sender.offer(4, "text " + std::to_string(now), now);
    for (; sender.due(now); ++sent) sender.take(now);
  }
  EXPECT_LE(sent, TextSender::kBurst + 120);
  EXPECT_GE(sent, 118);
  EXPECT_GT(sender.dropped(), 5000u);
  TextSender other;
  EXPECT_TRUE(other.offer(4, "hold because: blind", 0));
  other.take(0);
  EXPECT_FALSE(other.offer(4, "hold because: blind", kSecond));
  EXPECT_TRUE(other.offer(4, "hold because: blind", TextSender::kSame + kSecond));
  EXPECT_FALSE(other.offer(4, "", 0));
}

TEST(Texts, ACharacterOfSeveralBytesIsNotCutAtTheEnd) {
  TextSender sender;
  ASSERT_TRUE(sender.offer(6, std::string(149, 'a') + "\xc3\xa9", 0));  // the last one would be half
  std::string together;
  while (sender.due(0)) together += text_of(sender.take(0));
  EXPECT_EQ(together, std::string(149, 'a'));
}

}  // namespace
}  // namespace wasp::drivers
