// One region that comes and goes. Each poll looks whether the file in /dev/shm is still the one that is mapped; a
// removed file whose writer lives on is kept, a replaced, rebuilt or truncated one is let go and the new one taken when
// it is ready. Everything is read-only and nothing throws: what happens is told as events.
#pragma once

#include <sys/types.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "shm/region.h"

namespace wasp::tools {

class Attachment {
 public:
  using EventSink = std::function<void(const std::string& region, const std::string& what)>;

  explicit Attachment(std::string region_name, EventSink events = {});

  /// Attaches if a region is there and none is held. True if a new one was taken.
  bool try_attach();
  /// True if what is held should be read to its end and then let go with detach().
  [[nodiscard]] bool stale() const;
  void detach();

  [[nodiscard]] const std::string& name() const { return name_; }
  /// nullptr while nothing is attached.
  [[nodiscard]] const shm::Region* region() const { return region_ ? &*region_ : nullptr; }
  /// True if the writer of what is held had ended before it was taken and no other has taken it over since.
  [[nodiscard]] bool left_over() const;
  /// Counts attachments, 1 for the first.
  [[nodiscard]] int generation() const { return generation_; }

 private:
  struct FileId {
    dev_t device = 0;
    ino_t inode = 0;
    off_t bytes = 0;
    bool operator==(const FileId&) const = default;
  };
  [[nodiscard]] std::optional<FileId> file_id() const;
  [[nodiscard]] bool truncated() const;
  void tell(const std::string& what);

  std::string name_, last_told_;
  EventSink events_;
  std::optional<shm::Region> region_;
  FileId file_;
  std::uint64_t layout_hash_ = 0, lost_pages_ = 0;
  TimeNs created_at_ns_ = 0;
  std::uint32_t restarts_ = 0;
  bool writer_was_dead_ = false;
  int generation_ = 0;
};

/// True while a living process writes the region.
bool is_written(const std::string& region);
/// Instances with at least one such region: the X of "wasp.X.flight", ".camera" or ".truth". Sorted, each once.
std::vector<std::string> list_instances();

}  // namespace wasp::tools
