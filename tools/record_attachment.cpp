#include "tools/record_attachment.h"

#include <sys/stat.h>

#include <algorithm>
#include <exception>
#include <string_view>

#include "shm/bus_guard.h"

namespace wasp::tools {

Attachment::Attachment(std::string region_name, EventSink events)
    : name_(std::move(region_name)), events_(std::move(events)) {}

std::optional<Attachment::FileId> Attachment::file_id() const {
  struct stat st {};
  if (stat(("/dev/shm/" + name_).c_str(), &st) != 0) return std::nullopt;
  return FileId{st.st_dev, st.st_ino, st.st_size};
}

/// The same trouble is told once, however often it is met in a row.
void Attachment::tell(const std::string& what) {
  if (what == last_told_) return;
  last_told_ = what;
  if (events_) events_(name_, what);
}

bool Attachment::try_attach() {
  if (region_) return false;
  const auto before = file_id();
  if (!before) return false;
  try {
    lost_pages_ = shm::lost_pages();
    region_ = shm::Region::attach(name_);
  } catch (const std::exception& error) {
    tell(std::string("cannot attach: ") + error.what());
    return false;
  }
  if (file_id() != before || shm::lost_pages() != lost_pages_) {  // replaced between the two looks: next poll
    region_.reset();
    return false;
  }
  file_ = *before;
  layout_hash_ = region_->header().layout_hash;
  created_at_ns_ = region_->header().created_at_ns;
  restarts_ = region_->header().writer_restarts.load();
  writer_was_dead_ = !region_->writer_alive();
  ++generation_;
  tell(writer_was_dead_ ? "attached; its writer has ended" : "attached");
  return true;
}

bool Attachment::stale() const {
  if (!region_) return false;
  const auto& header = region_->header();
  const bool rebuilt = header.magic.load(std::memory_order_acquire) != shm::kMagic ||
                       header.layout_hash != layout_hash_ || header.created_at_ns != created_at_ns_;
  if (rebuilt || truncated()) return true;
  const auto now = file_id();
  return now ? *now != file_ : !region_->writer_alive();
}

void Attachment::detach() {
  if (!region_) return;
  const bool was_truncated = truncated();
  region_.reset();
  tell(was_truncated ? "truncated while mapped; let go" : "gone or replaced; let go");
}

bool Attachment::truncated() const {
  return shm::lost_page_within(region_->at(0), static_cast<std::uint64_t>(file_.bytes), lost_pages_);
}

bool Attachment::left_over() const {
  return region_ && writer_was_dead_ && region_->header().writer_restarts.load() == restarts_;
}

bool is_written(const std::string& region) {
  try {
    return shm::Region::attach(region).writer_alive();
  } catch (const std::exception&) {
    return false;  // went away, or is still being built
  }
}

std::vector<std::string> list_instances() {
  std::vector<std::string> names;
  for (const std::string& region : shm::Region::list("wasp.")) {
    const std::size_t dot = region.rfind('.');
    const std::string_view tail = std::string_view(region).substr(dot);
    if (dot > 5 && (tail == ".flight" || tail == ".camera" || tail == ".truth") && is_written(region))
      names.push_back(region.substr(5, dot - 5));
  }
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return names;
}

}  // namespace wasp::tools
