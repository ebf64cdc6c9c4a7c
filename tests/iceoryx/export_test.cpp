// Export, received by a subscriber that is no part of wasp: byte for byte what lay in the rings.
#include <cstring>
#include <random>

#include "tests/iceoryx/client.h"
#include "tests/iceoryx/fixture.h"
#include "tests/tools/fake_flight.h"
#include "tools/iceoryx_message.h"

namespace wasp::test {
namespace {

constexpr std::size_t kMost = 4096;

/// What the subscriber got last.
struct Mailbox {
  std::atomic<std::uint64_t> number{0}, bytes{0};  ///< the number stored last
  std::array<std::byte, kMost> chunk{};
};

pid_t start_subscriber(const SharedMemory<Mailbox>& box, const std::string& instance, const std::string& topic) {
  return start_child([&] {
    start_runtime(topic);
    Subscriber in(service("wasp", instance, topic));
    for (;; std::this_thread::sleep_for(std::chrono::microseconds(200))) {
      const Bytes chunk = in.take();
      if (chunk.empty() || chunk.size() > kMost) continue;
      std::memcpy(box->chunk.data(), chunk.data(), chunk.size());
      box->bytes = chunk.size();
      iceoryx::MessageHead head;
      std::memcpy(&head, chunk.data(), sizeof head);
      box->number = head.number;
    }
    return 0;
  });
}

Bytes newest_in(const shm::Region& region, const std::string& topic, std::size_t bytes) {
  const shm::RingReader reader(region, topic);
  const shm::Sample sample = reader.look(reader.newest());
  return {sample.data, sample.data + bytes};
}

class IceoryxExport : public WithRoudi {
 protected:
  /// `write(n)` publishes a message; each must arrive as it lies in the ring before the next is written.
  void expect_every_byte(const FakeFlight& flight, const shm::Region& region, const std::string& topic,
                         const std::string& type, std::size_t bytes, const std::function<void(std::uint32_t)>& write) {
    const SharedMemory<Mailbox> box;
    const Reaped subscriber(start_subscriber(box, flight.instance, topic));
    // iceoryx calls a subscriber subscribed before there is anybody to hear: messages until the first one comes
    // through.
    std::uint32_t n = 0;
    ASSERT_TRUE(eventually([&] {
      write(++n);
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      return box->number > 0;
    })) << topic;
    for (int i = 0; i < 20; ++i) {
      write(++n);
      ASSERT_TRUE(eventually([&] { return box->number == n; })) << topic << " " << n;
      iceoryx::MessageHead head;
      std::memcpy(&head, box->chunk.data(), sizeof head);
      EXPECT_EQ(head.magic, iceoryx::kMessageMagic);
      EXPECT_EQ(head.version, iceoryx::kMessageVersion);
      EXPECT_EQ(head.number, n);
      EXPECT_EQ(std::string(head.type.data()), type);
      ASSERT_EQ(head.payload_bytes, bytes);
      ASSERT_EQ(box->bytes, sizeof head + bytes);
      const Bytes ring = newest_in(region, topic, bytes);
      EXPECT_EQ(std::memcmp(ring.data(), box->chunk.data() + sizeof head, bytes), 0) << topic << " " << n;
    }
  }
};

TEST_F(IceoryxExport, EveryKindOfTopicArrivesByteForByte) {
  WASP_START_ROUDI();
  const FakeFlight flight(unique_instance("export"));
  Reaped gateway(start_program({built("wasp-iceoryx"), "export", "--all", "--instance", flight.instance, "--json"},
                               folder.path / "export.log"));
  std::mt19937 random(7);
  const auto noise = [&](const shm::RingWriter& ring, std::size_t bytes, std::uint32_t n) {
    auto& writer = const_cast<shm::RingWriter&>(ring);
    std::byte* slot = writer.loan();
    for (std::size_t i = 0; i < bytes; ++i) slot[i] = static_cast<std::byte>(random());
    writer.publish(n);
  };
  expect_every_byte(flight, *flight.flight, "imu", "Imu", sizeof(ImuSample),
                    [&](std::uint32_t n) { noise(*flight.imu, sizeof(ImuSample), n); });
  expect_every_byte(flight, *flight.flight, "attitude", "Attitude", sizeof(AttitudeSample),
                    [&](std::uint32_t n) { noise(*flight.attitude, sizeof(AttitudeSample), n); });
  expect_every_byte(flight, *flight.flight, "command", "Command", sizeof(Command),
                    [&](std::uint32_t n) { noise(*flight.command, sizeof(Command), n); });
  expect_every_byte(flight, *flight.flight, "cue.ground_altitude", "Cue", sizeof(Cue),
                    [&](std::uint32_t n) { noise(*flight.ground, sizeof(Cue), n); });
  expect_every_byte(flight, *flight.truth_region, "truth", "Truth", sizeof(Truth),
                    [&](std::uint32_t n) { noise(*flight.truth, sizeof(Truth), n); });
  expect_every_byte(flight, *flight.camera, "gray", "Frame",
                    kFramePixelOffset + FakeFlight::kWidth * FakeFlight::kHeight,
                    [&](std::uint32_t n) { flight.write_gray(n, n); });
  EXPECT_EQ(gateway.stop(), 0);
  const std::string account = read_text(folder.path / "export.log");
  EXPECT_NE(account.find(R"({"topic": "depth", "exported": 0, "lost": 0, "refused": 0})"), std::string::npos)
      << account;
  EXPECT_EQ(account.find(R"("lost": 1)"), std::string::npos) << account;
}

TEST_F(IceoryxExport, TheGatewayMapsTheRegionsReadOnlyAndNoBell) {
  WASP_START_ROUDI();
  const FakeFlight flight(unique_instance("maps"));
  Reaped gateway(start_program({built("wasp-iceoryx"), "export", "--all", "--instance", flight.instance},
                               folder.path / "export.log"));
  ASSERT_TRUE(eventually(
      [&] { return read_text(folder.path / "export.log").find("exporting instance") != std::string::npos; }));
  std::string worker;
  std::getline(
      std::ifstream("/proc/" + std::to_string(gateway.pid()) + "/task/" + std::to_string(gateway.pid()) + "/children"),
      worker, ' ');
  std::ifstream maps("/proc/" + worker + "/maps");
  int seen = 0;
  for (std::string line; std::getline(maps, line);) {
    if (line.find("/dev/shm/wasp." + flight.instance) == std::string::npos) continue;
    ++seen;
    EXPECT_NE(line.find(" r--s "), std::string::npos) << line;
    EXPECT_EQ(line.find(".bell"), std::string::npos) << line;
  }
  EXPECT_EQ(seen, 3);
  EXPECT_EQ(gateway.stop(), 0);
}

TEST_F(IceoryxExport, ListNamesTopicsAndOfferedServices) {
  WASP_START_ROUDI();
  const FakeFlight flight(unique_instance("list"));
  Reaped gateway(start_program(
      {built("wasp-iceoryx"), "export", "--topic", "imu", "--topic", "gray", "--instance", flight.instance},
      folder.path / "export.log"));
  const std::string imu = "\"wasp/" + flight.instance + "/imu\"", depth = "\"wasp/" + flight.instance + "/depth\"";
  std::string text;
  ASSERT_TRUE(eventually([&] {
    text = run_program({built("wasp-iceoryx"), "list", "--json"}).first;
    return text.find("\"services\":[\"wasp/" + flight.instance + "/gray\"," + imu + "]") != std::string::npos;
  })) << text;
  EXPECT_NE(text.find("\"service\":" + depth), std::string::npos) << text;
  EXPECT_EQ(gateway.stop(), 0);
}

}  // namespace
}  // namespace wasp::test
