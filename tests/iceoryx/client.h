// Ends of iceoryx as a stranger would write them, for child processes of the tests: nothing of the gateway's code but
// the head of a message is used here.
#pragma once

#include <cstring>
#include <string>
#include <vector>

#include "iceoryx_hoofs/log/logmanager.hpp"
#include "iceoryx_posh/mepoo/chunk_header.hpp"
#include "iceoryx_posh/popo/untyped_publisher.hpp"
#include "iceoryx_posh/popo/untyped_subscriber.hpp"
#include "iceoryx_posh/runtime/posh_runtime.hpp"
#include "tests/support/child.h"

namespace wasp::test {

using Bytes = std::vector<std::byte>;

inline void start_runtime(const std::string& role) {
  iox::log::LogManager::GetLogManager().SetDefaultLogLevel(iox::log::LogLevel::kOff,
                                                           iox::log::LogLevelOutput::kHideLogLevel);
  iox::runtime::PoshRuntime::initRuntime(
      {iox::cxx::TruncateToCapacity, "wasp-test-" + role + "-" + std::to_string(getpid())});
}

inline iox::capro::ServiceDescription service(const std::string& s, const std::string& i, const std::string& e) {
  const auto id = [](const std::string& text) { return iox::capro::IdString_t{iox::cxx::TruncateToCapacity, text}; };
  return {id(s), id(i), id(e)};
}

class Subscriber {
 public:
  explicit Subscriber(const iox::capro::ServiceDescription& description) : subscriber_(description) {}
  /// The next chunk whole; empty if there is none.
  Bytes take() {
    Bytes bytes;
    subscriber_.take().and_then([&](const void* chunk) {
      bytes.resize(iox::mepoo::ChunkHeader::fromUserPayload(chunk)->userPayloadSize());
      std::memcpy(bytes.data(), chunk, bytes.size());
      subscriber_.release(chunk);
    });
    return bytes;
  }

 private:
  iox::popo::UntypedSubscriber subscriber_;
};

class Publisher {
 public:
  explicit Publisher(const iox::capro::ServiceDescription& description) : publisher_(description) {}
  [[nodiscard]] bool has_subscribers() const { return publisher_.hasSubscribers(); }
  void send(const Bytes& bytes) {
    publisher_.loan(static_cast<std::uint32_t>(bytes.size())).and_then([&](void* chunk) {
      std::memcpy(chunk, bytes.data(), bytes.size());
      publisher_.publish(chunk);
    });
  }

 private:
  iox::popo::UntypedPublisher publisher_;
};

}  // namespace wasp::test
