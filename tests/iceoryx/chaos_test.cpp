// The gateway, its worker and iceoryx's daemon killed and frozen at random: the ring's writer and its other readers
// notice nothing, and afterwards messages flow again.
#include "shm/broadcast_ring.h"
#include "shm/topics.h"
#include "tests/iceoryx/client.h"
#include "tests/iceoryx/fixture.h"
#include "tests/tools/fake_flight.h"
#include "tools/gateway_chaos.h"

namespace wasp::test {
namespace {

struct Reading {
  std::atomic<std::uint64_t> read{0}, lost{0}, torn{0};
};

/// Another observer, which must get every frame.
pid_t start_observer(const SharedMemory<Reading>& reading, const std::string& region_name) {
  return start_child([&] {
    const shm::Region region = shm::Region::attach(region_name);
    shm::RingReader reader(region, shm::kGray);
    reader.rewind();
    for (;; std::this_thread::sleep_for(std::chrono::microseconds(100))) {
      if (const shm::Sample sample = reader.next()) {
        const Bytes copy(sample.data, sample.data + kFramePixelOffset + FakeFlight::kWidth * FakeFlight::kHeight);
        if (!reader.intact(sample)) reading->torn.fetch_add(1);
        reading->read = sample.number;
      }
      reading->lost = reader.lost();
    }
    return 0;
  });
}

bool hears_again(const FakeFlight& flight, std::uint32_t& n) {
  struct Heard {
    std::atomic<std::uint32_t> chunks{0};
  };
  const SharedMemory<Heard> heard;
  const Reaped subscriber(start_child([&] {
    start_runtime("afterwards");
    Subscriber in(service("wasp", flight.instance, "gray"));
    for (;; std::this_thread::sleep_for(std::chrono::milliseconds(1)))
      if (!in.take().empty()) heard->chunks.fetch_add(1);
    return 0;
  }));
  return eventually([&] {
    ++n;
    flight.write_gray(n, n);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    return heard->chunks > 10;
  });
}

class IceoryxChaos : public WithRoudi {};

TEST_F(IceoryxChaos, NoFrameIsLostToOthersAndMessagesFlowAgain) {
  WASP_START_ROUDI();
  const FakeFlight flight(unique_instance("chaos"));
  const SharedMemory<Reading> reading;
  const Reaped observer(start_observer(reading, shm::camera_region(flight.instance)));
  tools::GatewayChaos chaos(*roudi, {built("wasp-iceoryx"), "export", "--all", "--instance", flight.instance},
                            (folder.path / "export.log").string(), 20261122);
  std::uint32_t n = 0;
  for (int act = 0; act < 30; ++act) {
    chaos.act();
    for (int i = 0; i < 25; ++i) {  // the writer waits for the observer, never for the gateway
      ++n;
      flight.write_gray(n, n);
      std::this_thread::sleep_for(std::chrono::milliseconds(4));
      ASSERT_TRUE(eventually([&] { return reading->read == n; })) << "after " << chaos.account();
    }
  }
  EXPECT_EQ(reading->lost, 0u);
  EXPECT_EQ(reading->torn, 0u);
  EXPECT_GT(chaos.kills(), 5);
  EXPECT_GT(chaos.freezes(), 5);
  chaos.calm();
  EXPECT_TRUE(hears_again(flight, n)) << read_text(folder.path / "export.log");
}

}  // namespace
}  // namespace wasp::test
