// A region: one file in /dev/shm, written by one process, mapped read-only by everyone else. A versioned header lists
// the topics; everything is offsets, never pointers. Bells (the only words readers may write) live in a file apart, so
// an observer that maps only the region can hurt nobody.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "rt/futex.h"
#include "types/time.h"

namespace wasp::shm {

inline constexpr std::uint64_t kMagic = 0x31'70'73'61'77ull;  // "wasp1"
inline constexpr std::uint32_t kLayoutVersion = 2;
inline constexpr std::size_t kMaxTopics = 36;
inline constexpr std::size_t kPage = 4096;

enum class TopicKind : std::uint32_t { kNone = 0, kRing = 1, kBlock = 2 };

/// One row of the directory, as it lies in the header.
struct TopicEntry {
  std::array<char, 40> name{};
  std::array<char, 24> type{};  ///< e.g. "Cue"; compared on attach
  TopicKind kind = TopicKind::kNone;
  std::uint32_t slots = 0;          ///< rings: number of slots; blocks: 1
  std::uint64_t payload_bytes = 0;  ///< capacity of one slot
  std::uint64_t offset = 0;         ///< from the start of the region, 64-byte aligned
  std::uint64_t bytes = 0;          ///< whole extent

  [[nodiscard]] std::string_view name_view() const { return {name.data(), strnlen_(name.data(), name.size())}; }
  [[nodiscard]] std::string_view type_view() const { return {type.data(), strnlen_(type.data(), type.size())}; }

 private:
  static std::size_t strnlen_(const char* s, std::size_t n) {
    std::size_t i = 0;
    while (i < n && s[i] != 0) ++i;
    return i;
  }
};

/// First page of a region.
struct RegionHeader {
  std::atomic<std::uint64_t> magic;  ///< stored last: a region without it is still being built
  std::uint32_t layout_version;
  std::uint32_t topic_count;
  std::uint64_t total_bytes;
  std::uint64_t layout_hash;
  TimeNs created_at_ns;
  std::atomic<std::int32_t> writer_pid;
  std::atomic<std::uint32_t> writer_restarts;
  std::array<char, 128> note;  ///< free text for observers, e.g. "NOT REAL TIME"
  std::array<TopicEntry, kMaxTopics> topics;
};
static_assert(sizeof(RegionHeader) <= kPage);

/// What a writer asks for.
struct TopicSpec {
  std::string name;
  std::string type;
  TopicKind kind = TopicKind::kRing;
  std::uint32_t slots = 8;          ///< >= 2 for rings
  std::uint64_t payload_bytes = 0;  ///< > 0
};

/// A mapped region. Throws std::runtime_error naming the region and the reason; after construction nothing throws.
class Region {
 public:
  /// Creates `name` (no slash), or takes over one with the same layout whose writer has died: its history stays.
  /// Refuses while another writer lives. A region of another layout is unlinked: its readers keep their mapping,
  /// frozen.
  static Region create(const std::string& name, std::span<const TopicSpec> topics, std::string_view note = {});
  /// Maps an existing region read-only and prefaulted, and checks the directory against the file's size before
  /// believing it. A file with holes is refused: it would be a SIGBUS on a full /dev/shm.
  static Region attach(const std::string& name);
  /// As attach, and maps the bells for reading processes that must be woken (not for observers).
  static Region attach_with_bells(const std::string& name);
  /// Names of all regions that exist and start with `prefix`.
  static std::vector<std::string> list(std::string_view prefix);
  /// Unlinks a region, its bells and its lock. Whoever has it mapped keeps the mapping.
  static void remove(const std::string& name);

  Region(Region&& other) noexcept;
  Region& operator=(Region&& other) noexcept;
  ~Region();

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const RegionHeader& header() const { return *reinterpret_cast<const RegionHeader*>(base_); }
  /// The directory as validated at attach: later corruption of the shared copy cannot move a pointer.
  [[nodiscard]] const std::vector<TopicEntry>& topics() const { return topics_; }
  [[nodiscard]] bool writable() const { return writable_; }
  /// Row of a topic; throws if absent, or if `type` is given and differs.
  [[nodiscard]] const TopicEntry& topic(std::string_view name, std::string_view type = {}) const;
  /// As topic; throws also if the topic is a block.
  [[nodiscard]] const TopicEntry& ring(std::string_view name, std::string_view type = {}) const;
  [[nodiscard]] bool has(std::string_view name) const;
  [[nodiscard]] std::byte* at(std::uint64_t offset) const { return base_ + offset; }
  /// Bell of a topic, nullptr when bells are not mapped.
  [[nodiscard]] rt::Bell* bell(const TopicEntry& entry) const;
  /// True while a process holds the writer's lock and the name still means the file mapped here. Takes no lock itself.
  /// Falls back on the writer's process number when the lock belongs to another user. Realtime-safe: no (system calls).
  [[nodiscard]] bool writer_alive() const;

 private:
  Region() = default;
  void unmap() noexcept;
  void map_bells(bool create);
  void read_directory();

  std::string name_;
  std::byte* base_ = nullptr;
  std::size_t bytes_ = 0;
  rt::Bell* bells_ = nullptr;
  int lock_fd_ = -1;
  std::uint64_t inode_ = 0;
  bool writable_ = false;
  std::vector<TopicEntry> topics_;
};

/// Extent of a ring with these parameters [bytes].
std::uint64_t ring_bytes(std::uint32_t slots, std::uint64_t payload_bytes);

}  // namespace wasp::shm
