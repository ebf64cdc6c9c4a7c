// Why iceoryx 2.0 is never inside the flight process: two facts about it, reproduced with the library as installed.
#include <fstream>

#include "iceoryx_posh/internal/popo/building_blocks/chunk_queue_pusher.hpp"
#include "iceoryx_posh/internal/popo/ports/pub_sub_port_types.hpp"
#include "tests/iceoryx/client.h"
#include "tests/iceoryx/fixture.h"

namespace wasp::test {
namespace {

using Queue = iox::popo::SubscriberChunkQueueData_t;

/// A subscriber's queue as it lies in iceoryx's shared memory, and what the publisher's side says of itself.
struct SharedQueue {
  Queue queue{iox::popo::QueueFullPolicy::DISCARD_OLDEST_DATA,
              iox::cxx::VariantQueueTypes::SoFi_SingleProducerSingleConsumer};
  std::atomic<bool> pushing{false}, pushed{false};
};

pid_t start_pusher(const SharedMemory<SharedQueue>& shared) {
  return start_child([&] {
    iox::popo::ChunkQueuePusher<Queue> pusher(&shared->queue);
    shared->pushing = true;
    pusher.push(iox::mepoo::SharedChunk{});
    shared->pushed = true;
    return 0;
  });
}

/// True if the process sleeps in the system call futex (202 on amd64, 98 on arm64).
bool waits_for_a_lock(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/syscall");
  int number = -1;
  return (file >> number) && (number == 202 || number == 98);
}

TEST(IceoryxFacts, APublisherWaitsForEverForASubscriberKilledInItsQueuesLock) {
  const SharedMemory<SharedQueue> shared;
  const pid_t subscriber = start_child([&] {
    shared->queue.lock();  // as push, and the daemon, do for a moment at each message
    kill(getpid(), SIGKILL);
    return 0;
  });
  ASSERT_TRUE(WIFSIGNALED(wait_for(subscriber)));
  const Reaped publisher(start_pusher(shared));
  ASSERT_TRUE(eventually([&] { return shared->pushing.load(); }));
  ASSERT_TRUE(eventually([&] { return waits_for_a_lock(publisher.pid()); }));
  std::this_thread::sleep_for(std::chrono::seconds(1));
  EXPECT_TRUE(waits_for_a_lock(publisher.pid()));
  EXPECT_FALSE(shared->pushed);
}

TEST(IceoryxFacts, TheSamePublisherGoesOnWhereTheSubscriberLeftInOrder) {
  const SharedMemory<SharedQueue> shared;
  const pid_t subscriber = start_child([&] {
    shared->queue.lock();
    shared->queue.unlock();
    return 0;
  });
  ASSERT_EQ(wait_for(subscriber), 0);
  Reaped publisher(start_pusher(shared));
  EXPECT_EQ(publisher.wait(), 0);
  EXPECT_TRUE(shared->pushed);
}

class IceoryxFactsWithRoudi : public WithRoudi {};

TEST_F(IceoryxFactsWithRoudi, APublisherThatStoodStillAbortsWhenItGoesOn) {
  WASP_START_ROUDI();
  struct Words {
    std::atomic<std::uint64_t> sent{0};
  };
  const SharedMemory<Words> words;
  Reaped publisher(start_child([&] {
    start_runtime("frozen");
    Publisher out(service("wasp", "test", "frozen"));
    for (;;) {
      out.send(Bytes(1000));
      words->sent.fetch_add(1);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return 0;
  }));
  ASSERT_TRUE(eventually([&] { return words->sent > 10; }));
  kill(publisher.pid(), SIGSTOP);
  ASSERT_TRUE(eventually([&] { return roudi->said().find("removing it") != std::string::npos; })) << roudi->said();
  kill(publisher.pid(), SIGCONT);
  const int status = publisher.wait();
  EXPECT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(WTERMSIG(status), SIGABRT) << "status " << status;
}

}  // namespace
}  // namespace wasp::test
