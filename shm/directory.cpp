#include "shm/directory.h"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>

#include "shm/ring_layout.h"

namespace wasp::shm {
namespace {

constexpr std::uint64_t kLastMessage = std::uint64_t{1} << 62;  ///< no ring gets there; sequences count twice as fast

std::uint64_t align(std::uint64_t n, std::uint64_t to) { return (n + to - 1) / to * to; }

template <std::size_t N>
void copy_text(std::array<char, N>& to, std::string_view from) {
  to.fill(0);
  std::copy_n(from.begin(), std::min(from.size(), N - 1), to.begin());
}

}  // namespace

std::uint64_t ring_bytes(std::uint32_t slots, std::uint64_t payload_bytes) {
  return sizeof(RingHeader) + slots * slot_stride(payload_bytes);
}

std::uint64_t lay_out(const std::string& name, std::span<const TopicSpec> specs, std::vector<TopicEntry>& entries) {
  if (specs.size() > kMaxTopics) fail(name, "more than " + std::to_string(kMaxTopics) + " topics");
  std::uint64_t offset = kPage;
  for (const auto& spec : specs) {
    if (spec.name.empty() || spec.name.size() >= sizeof(TopicEntry::name))
      fail(name, "bad topic name '" + spec.name + "'");
    if (spec.type.size() >= sizeof(TopicEntry::type)) fail(name, "bad topic type '" + spec.type + "'");
    if (std::any_of(entries.begin(), entries.end(), [&](const auto& e) { return e.name_view() == spec.name; }))
      fail(name, "topic '" + spec.name + "' twice");
    if (spec.payload_bytes == 0 || (spec.kind == TopicKind::kRing && spec.slots < 2))
      fail(name, "topic '" + spec.name + "' has no room");
    TopicEntry e;
    copy_text(e.name, spec.name);
    copy_text(e.type, spec.type);
    e.kind = spec.kind;
    e.slots = spec.kind == TopicKind::kRing ? spec.slots : 1;
    e.payload_bytes = align(spec.payload_bytes, 64);
    e.offset = offset;
    e.bytes = spec.kind == TopicKind::kRing ? ring_bytes(e.slots, e.payload_bytes) : e.payload_bytes;
    offset = align(offset + e.bytes, kPage);
    entries.push_back(e);
  }
  return offset;
}

std::uint64_t hash_of(const std::vector<TopicEntry>& entries) {
  std::uint64_t h = 1469598103934665603ull;  // FNV-1a over the rows
  for (const auto& e : entries) {
    const auto* bytes = reinterpret_cast<const unsigned char*>(&e);
    for (std::size_t i = 0; i < sizeof e; ++i) h = (h ^ bytes[i]) * 1099511628211ull;
  }
  return h;
}

bool possible(const TopicEntry& e, std::uint64_t file_bytes) {
  if (e.offset % 64 != 0 || e.offset < kPage || e.offset >= file_bytes || e.bytes > file_bytes - e.offset) return false;
  if (e.payload_bytes == 0 || e.payload_bytes % 64 != 0 || e.payload_bytes > e.bytes) return false;
  if (e.kind == TopicKind::kBlock) return e.slots == 1 && e.bytes == e.payload_bytes;
  return e.kind == TopicKind::kRing && e.slots >= 2 && e.slots <= e.bytes / slot_stride(e.payload_bytes) &&
         e.bytes == ring_bytes(e.slots, e.payload_bytes);
}

namespace {

template <class T>
bool read_at(const File& file, std::uint64_t offset, T& out) {
  return pread(file.fd(), &out, sizeof out, static_cast<off_t>(offset)) == static_cast<ssize_t>(sizeof out);
}

/// At whatever step a writer died, the newest message of its ring is whole: else something else wrote here.
bool newest_is_whole(const File& file, const TopicEntry& ring) {
  std::uint64_t published = 0, sequence = 0;
  if (!read_at(file, ring.offset, published)) return false;
  if (published == 0) return true;
  const std::uint64_t slot = (published - 1) % ring.slots * slot_stride(ring.payload_bytes);
  return published < kLastMessage && read_at(file, ring.offset + sizeof(RingHeader) + slot, sequence) &&
         sequence == 2 * published;
}

}  // namespace

bool has_layout(const File& file, std::uint64_t total, std::uint64_t hash, const std::vector<TopicEntry>& entries) {
  if (static_cast<std::uint64_t>(file.status().st_size) != total) return false;
  void* base = mmap(nullptr, kPage, PROT_READ, MAP_SHARED, file.fd(), 0);
  if (base == MAP_FAILED) return false;
  const auto& h = *static_cast<const RegionHeader*>(base);
  const bool same = h.magic.load(std::memory_order_acquire) == kMagic && h.layout_version == kLayoutVersion &&
                    h.layout_hash == hash && h.total_bytes == total && h.topic_count == entries.size() &&
                    std::memcmp(h.topics.data(), entries.data(), entries.size() * sizeof(TopicEntry)) == 0;
  munmap(base, kPage);
  return same && std::all_of(entries.begin(), entries.end(), [&](const TopicEntry& e) {
           return e.kind != TopicKind::kRing || newest_is_whole(file, e);
         });
}

}  // namespace wasp::shm
