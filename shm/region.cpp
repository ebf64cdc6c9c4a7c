#include "shm/region.h"

#include <dirent.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <memory>
#include <utility>

#include "rt/clock.h"
#include "shm/bus_guard.h"
#include "shm/directory.h"
#include "shm/shm_file.h"

namespace wasp::shm {
namespace {

constexpr std::size_t kBellBytes = kMaxTopics * sizeof(rt::Bell);

template <std::size_t N>
void copy_note(std::array<char, N>& to, std::string_view from) {
  to.fill(0);
  std::copy_n(from.begin(), std::min(from.size(), N - 1), to.begin());
}

/// Writes to every page without changing it. MAP_POPULATE and mlock map shared pages for reading only: a processor that
/// keeps no dirty bit itself (ARMv8.0, e.g. Cortex-A72) would fault on the first write to each, in the real-time
/// thread.
void touch_for_writing(void* base, std::size_t bytes) {
  constexpr std::size_t kSmallestPage = 4096;
  for (std::size_t at = 0; at < bytes; at += kSmallestPage)
    std::atomic_ref<std::uint32_t>(*reinterpret_cast<std::uint32_t*>(static_cast<std::byte*>(base) + at))
        .fetch_add(0, std::memory_order_relaxed);
}

}  // namespace

Region Region::create(const std::string& name, std::span<const TopicSpec> specs, std::string_view note) {
  Region region;
  region.name_ = name;
  region.writable_ = true;
  std::vector<TopicEntry> entries;
  const std::uint64_t total = lay_out(name, specs, entries);

  region.lock_fd_ = lock_for_writing(name);  // decides who writes
  const std::uint64_t hash = hash_of(entries);
  File file(path_of(name), O_RDWR);
  const bool reuse = file && has_layout(file, total, hash, entries);
  if (!reuse) {
    unlink(path_of(name).c_str());
    file = File(path_of(name), O_RDWR | O_CREAT | O_EXCL, 0644);
    if (!file) fail_errno(name, "open");
  }
  if (const int error = reserve(file.fd(), total); error != 0) {
    if (!reuse) unlink(path_of(name).c_str());
    fail(name, "cannot reserve " + std::to_string(total) + " bytes of /dev/shm: " + std::strerror(error));
  }
  void* base = mmap(nullptr, total, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, file.fd(), 0);
  if (base == MAP_FAILED) fail_errno(name, "mmap");
  guard_mapping(name, base, total, true);
  touch_for_writing(base, total);
  region.base_ = static_cast<std::byte*>(base);
  region.bytes_ = total;
  region.inode_ = file.status().st_ino;
  region.map_bells(true);

  auto* header = reinterpret_cast<RegionHeader*>(base);
  if (reuse) {
    header->writer_restarts.fetch_add(1);
  } else {  // a fresh file is all zero
    header->layout_version = kLayoutVersion;
    header->topic_count = static_cast<std::uint32_t>(entries.size());
    header->total_bytes = total;
    header->layout_hash = hash;
    header->created_at_ns = rt::now();
    std::copy(entries.begin(), entries.end(), header->topics.begin());
  }
  copy_note(header->note, note);
  header->writer_pid.store(getpid());
  header->magic.store(kMagic, std::memory_order_release);
  region.topics_ = std::move(entries);
  return region;
}

Region Region::attach(const std::string& name) {
  Region region;
  region.name_ = name;
  const File file(path_of(name), O_RDONLY);
  if (!file) fail_errno(name, "open");
  const struct stat st = file.status();
  if (static_cast<std::size_t>(st.st_size) < kPage) fail(name, "too small to hold a header");
  if (st.st_blocks < (st.st_size + 511) / 512) fail(name, "has holes: its pages were never reserved");
  region.bytes_ = static_cast<std::size_t>(st.st_size);
  region.inode_ = st.st_ino;
  void* base = mmap(nullptr, region.bytes_, PROT_READ, MAP_SHARED | MAP_POPULATE, file.fd(), 0);
  if (base == MAP_FAILED) fail_errno(name, "mmap");
  guard_mapping(name, base, region.bytes_, false);
  region.base_ = static_cast<std::byte*>(base);
  region.read_directory();
  return region;
}

Region Region::attach_with_bells(const std::string& name) {
  Region region = attach(name);
  region.map_bells(false);
  return region;
}

void Region::read_directory() {
  const RegionHeader& h = header();
  if (h.magic.load(std::memory_order_acquire) != kMagic) fail(name_, "not a wasp region, or not ready yet");
  if (h.layout_version != kLayoutVersion)
    fail(name_, "layout version " + std::to_string(h.layout_version) + ", this program reads " +
                    std::to_string(kLayoutVersion));
  const std::uint32_t count = h.topic_count;
  if (h.total_bytes != bytes_ || count > kMaxTopics) fail(name_, "header does not match the file");
  topics_.assign(h.topics.begin(), h.topics.begin() + count);
  for (const auto& e : topics_)
    if (!possible(e, bytes_)) fail(name_, "topic '" + std::string(e.name_view()) + "' has an impossible extent");
}

void Region::map_bells(bool create) {
  const File file(bell_path_of(name_), O_RDWR | (create ? O_CREAT : 0), 0600);
  if (!file) fail_errno(name_, "bells");
  if (create && reserve(file.fd(), kBellBytes) != 0) fail(name_, "cannot reserve bells in /dev/shm");
  void* bells = static_cast<std::size_t>(file.status().st_size) < kBellBytes
                    ? MAP_FAILED
                    : mmap(nullptr, kBellBytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, file.fd(), 0);
  if (bells == MAP_FAILED) fail(name_, "cannot map bells");
  guard_mapping(name_ + "'s bells", bells, kBellBytes, true);
  touch_for_writing(bells, kBellBytes);
  bells_ = static_cast<rt::Bell*>(bells);
}

std::vector<std::string> Region::list(std::string_view prefix) {
  std::vector<std::string> names;
  if (DIR* dir = opendir(kDirectory)) {
    while (const dirent* entry = readdir(dir)) {
      const std::string_view name = entry->d_name;
      if (name.starts_with(prefix) && !name.ends_with(".bell") && !name.ends_with(".lock")) names.emplace_back(name);
    }
    closedir(dir);
  }
  std::sort(names.begin(), names.end());
  return names;
}

void Region::remove(const std::string& name) {
  // Held if nobody writes, so that no writer can begin between the three; the lock goes last.
  const File lock_file(lock_path_of(name), O_RDWR);
  try_lock(lock_file);
  unlink(path_of(name).c_str());
  unlink(bell_path_of(name).c_str());
  unlink(lock_path_of(name).c_str());
}

bool Region::has(std::string_view name) const {
  return std::any_of(topics_.begin(), topics_.end(), [&](const auto& e) { return e.name_view() == name; });
}

const TopicEntry& Region::topic(std::string_view name, std::string_view type) const {
  for (const auto& e : topics_) {
    if (e.name_view() != name) continue;
    if (!type.empty() && e.type_view() != type)
      fail(name_,
           "topic '" + std::string(name) + "' holds " + std::string(e.type_view()) + ", not " + std::string(type));
    return e;
  }
  fail(name_, "no topic '" + std::string(name) + "'");
}

const TopicEntry& Region::ring(std::string_view name, std::string_view type) const {
  const TopicEntry& entry = topic(name, type);
  if (entry.kind != TopicKind::kRing) fail(name_, "topic '" + std::string(name) + "' is a block, not a ring");
  return entry;
}

rt::Bell* Region::bell(const TopicEntry& entry) const {
  if (bells_ == nullptr) return nullptr;
  for (std::size_t i = 0; i < topics_.size(); ++i)
    if (topics_[i].offset == entry.offset) return bells_ + i;
  return nullptr;
}

bool Region::writer_alive() const {
  if (!same_file(path_of(name_), inode_)) return false;  // replaced or removed: nobody writes this one
  bool refused = false;
  const bool locked = is_locked(File(lock_path_of(name_), O_RDONLY), refused);
  if (!refused || errno != EACCES) return locked;
  const int pid = header().writer_pid.load(std::memory_order_relaxed);
  return pid > 0 && (kill(pid, 0) == 0 || errno == EPERM);
}

void Region::unmap() noexcept {
  for (const void* mapping : {static_cast<const void*>(base_), static_cast<const void*>(bells_)})
    if (mapping != nullptr) forget_mapping(mapping);
  if (base_ != nullptr) munmap(base_, bytes_);
  if (bells_ != nullptr) munmap(bells_, kBellBytes);
  if (lock_fd_ >= 0) close(lock_fd_);
  base_ = nullptr;
  bells_ = nullptr;
  lock_fd_ = -1;
}

Region::Region(Region&& other) noexcept
    : name_(std::move(other.name_)),
      base_(std::exchange(other.base_, nullptr)),
      bytes_(other.bytes_),
      bells_(std::exchange(other.bells_, nullptr)),
      lock_fd_(std::exchange(other.lock_fd_, -1)),
      inode_(other.inode_),
      writable_(other.writable_),
      topics_(std::move(other.topics_)) {}

Region& Region::operator=(Region&& other) noexcept {
  if (this != &other) {
    std::destroy_at(this);
    std::construct_at(this, std::move(other));
  }
  return *this;
}

Region::~Region() { unmap(); }

}  // namespace wasp::shm
