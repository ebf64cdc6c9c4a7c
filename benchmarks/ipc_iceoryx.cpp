// The iceoryx ends: untyped publisher and subscriber (nothing is constructed in the chunk), WaitSet on the
// subscriber's event. Queue of 8, as the ring has 8 slots.
#include <unistd.h>

#include <string>

#include "benchmarks/ipc_run.h"
#include "iceoryx_hoofs/log/logmanager.hpp"
#include "iceoryx_posh/popo/untyped_publisher.hpp"
#include "iceoryx_posh/popo/untyped_subscriber.hpp"
#include "iceoryx_posh/popo/wait_set.hpp"
#include "iceoryx_posh/runtime/posh_runtime.hpp"

namespace wasp::bench {
namespace {

iox::RuntimeName_t runtime_name(const char* role) {
  return {iox::cxx::TruncateToCapacity, std::string("wasp-bench-") + role + "-" + std::to_string(getpid())};
}
iox::capro::ServiceDescription service(const std::string& name) {
  return {"wasp", iox::capro::IdString_t{iox::cxx::TruncateToCapacity, name}, "gray"};
}
void start_runtime(const char* role) {
  iox::log::LogManager::GetLogManager().SetDefaultLogLevel(iox::log::LogLevel::kError,
                                                           iox::log::LogLevelOutput::kHideLogLevel);
  iox::runtime::PoshRuntime::initRuntime(runtime_name(role));
}

class Writer {
 public:
  explicit Writer(const std::string& name) : publisher_(service(name)) {}
  std::byte* loan() noexcept {
    chunk_ = nullptr;
    publisher_.loan(kFrameBytes, 64).and_then([this](void* chunk) { chunk_ = chunk; });
    return static_cast<std::byte*>(chunk_);
  }
  void before_copy(Before) noexcept {}
  void publish(TimeNs) noexcept { publisher_.publish(chunk_); }

 private:
  iox::popo::UntypedPublisher publisher_;
  void* chunk_ = nullptr;
};

class Reader {
 public:
  Reader(const std::string& name, bool woken) : subscriber_(service(name), options()) {
    if (woken)
      waitset_.attachEvent(subscriber_, iox::popo::SubscriberEvent::DATA_RECEIVED).or_else([](auto) { std::abort(); });
  }
  bool connected() const noexcept { return subscriber_.getSubscriptionState() == iox::SubscribeState::SUBSCRIBED; }
  bool wait() noexcept { return !waitset_.timedWait(iox::units::Duration::fromMilliseconds(100)).empty(); }
  bool take(FrameHeader& head) noexcept {
    bool taken = false;
    subscriber_.take().and_then([&](const void* chunk) {
      std::memcpy(&head, chunk, sizeof head);
      subscriber_.release(chunk);
      taken = true;
    });
    return taken;
  }

 private:
  static iox::popo::SubscriberOptions options() {
    iox::popo::SubscriberOptions o;
    o.queueCapacity = 8;
    return o;
  }
  iox::popo::UntypedSubscriber subscriber_;
  iox::popo::WaitSet<> waitset_;
};

}  // namespace

int iceoryx_writer(const std::string& name, Run& run) {
  start_runtime("writer");
  Writer writer(name);
  return write_frames(writer, run);
}

int iceoryx_reader(const std::string& name, Run& run) {
  start_runtime("reader");
  Reader reader(name, run.mode == Mode::kWoken);
  for (int i = 0; i < 5000 && !reader.connected(); ++i) rt::sleep_until(rt::now() + kMillisecond);
  return reader.connected() ? read_frames(reader, run) : 2;
}

}  // namespace wasp::bench
