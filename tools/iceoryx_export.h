// Export: every wanted ring of an instance as an iceoryx service wasp/<instance>/<topic>. The regions are mapped
// read-only and polled, as every observer does: nothing that happens here or in iceoryx reaches the flight.
#pragma once

#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "iceoryx_posh/popo/untyped_publisher.hpp"
#include "shm/broadcast_ring.h"
#include "tools/iceoryx_supervisor.h"
#include "tools/record_attachment.h"

namespace wasp::iceoryx {

struct ExportOptions {
  std::string instance;
  std::vector<std::string> topics;  ///< empty: all
  double wait_s = 5;                ///< for the daemon, and for the instance, at the start
  double poll_ms = 1;
  bool json = false;  ///< the account at the end as one object a line
};

/// One ring and its service. The service outlives the ring: a flight that starts again goes on under the same name.
class TopicExport {
 public:
  TopicExport(const std::string& instance, const std::string& topic);

  /// The region is gone, or another one holds the ring now. Throws std::runtime_error as RingReader does.
  void let_go() { reader_.reset(); }
  void follow(const shm::Region& region, const shm::TopicEntry& entry);
  /// Publishes what is new; bounded, so that one busy ring cannot hold up the others. Without a subscriber nothing is
  /// copied and the ring's newest message is merely passed.
  void drain();

  [[nodiscard]] const std::string& topic() const { return topic_; }
  [[nodiscard]] std::uint64_t exported() const { return exported_; }
  /// Overwritten in the ring before or while it was copied, while somebody had subscribed.
  [[nodiscard]] std::uint64_t lost() const { return lost_; }
  /// Not published because iceoryx had no free chunk: subscribers hold them all.
  [[nodiscard]] std::uint64_t refused() const { return refused_; }

 private:
  void publish(const shm::Sample& sample);
  [[nodiscard]] std::uint32_t bytes_of(const shm::Sample& sample) const;

  std::string topic_, type_;
  iox::popo::UntypedPublisher publisher_;
  std::optional<shm::RingReader> reader_;
  std::uint64_t exported_ = 0, lost_ = 0, refused_ = 0;
};

/// All topics wanted, over the regions of one instance as they come and go.
class ExportSession {
 public:
  explicit ExportSession(const ExportOptions& options);
  /// One look at everything.
  void poll();
  void print_account(bool json) const;

 private:
  void look_for_regions();
  void attach(tools::Attachment& attachment);
  [[nodiscard]] bool wanted(const shm::TopicEntry& entry) const;

  ExportOptions options_;
  std::list<tools::Attachment> attachments_;
  std::map<std::string, std::unique_ptr<TopicExport>> exports_;              ///< by topic
  std::map<const tools::Attachment*, std::vector<TopicExport*>> followers_;  ///< of what is attached
  TimeNs looked_at_ns_ = 0;
};

/// Waits for the instance and checks the topics. Throws std::runtime_error that lists what there is.
void check_request(const ExportOptions& options);

/// The whole of `wasp iceoryx export`; exit code of the program.
int run_export(const ExportOptions& options);

}  // namespace wasp::iceoryx
