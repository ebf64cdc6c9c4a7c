// Damaged MAVLink frames between good ones, through the real parser: bits flipped, bytes dropped, doubled, inserted,
// overwritten, frames cut off and spliced. Counted: frames accepted that differ from every original (each must carry a
// checksum that holds by an implementation of its own, bitwise_crc.h: a collision, about one in 65,536 claims that get
// as far as the checksum), and good frames lost that nobody touched.
// Usage: mavlink_mutants [--count N] [--seed S]; exit code 1 when an accepted frame is not explained.
#include <algorithm>
#include <array>
#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <string_view>
#include <vector>

#include "messages/checksum.h"
#include "messages/mavlink_frame.h"
#include "tests/fuzz/bitwise_crc.h"

namespace wasp {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// SplitMix64.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() {
    std::uint64_t z = state_ += 0x9E3779B97F4A7C15ull;
    z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9ull;
    z = (z ^ z >> 27) * 0x94D049BB133111EBull;
    return z ^ z >> 31;
  }
  /// 0 ... n - 1.
  std::size_t below(std::size_t n) { return static_cast<std::size_t>(((next() >> 32) * n) >> 32); }
  std::uint8_t byte() { return static_cast<std::uint8_t>(next() >> 56); }

 private:
  std::uint64_t state_;
};

/// Good frames of any known message: version 1, 2, and 2 signed, of two senders with sequences of their own.
class Forge {
 public:
  explicit Forge(Random& random) : random_(random) {}

  void make(Bytes& out) {
    const auto& info = mavlink::kMessages[random_.below(mavlink::kMessages.size())];
    const bool v1 = info.id < 256 && random_.below(4) == 0, is_signed = !v1 && random_.below(4) == 0;
    const bool station = random_.below(8) == 0;
    const std::size_t length = v1 ? info.min_length : 1 + random_.below(info.max_length);
    out.clear();
    const auto put = [&out](std::size_t byte) { out.push_back(static_cast<std::uint8_t>(byte)); };
    put(v1 ? mavlink::kStartV1 : mavlink::kStartV2), put(length);
    if (!v1) put(is_signed ? mavlink::kIncompatSigned : 0), put(0);
    put(sequence_[station]++), put(station ? 255 : 1), put(station ? 190 : 1), put(info.id & 0xFF);
    if (!v1) put(info.id >> 8 & 0xFF), put(info.id >> 16);
    for (std::size_t i = 0; i < length; ++i) put(random_.byte());
    const std::uint16_t crc =
        mavlink::crc_add(mavlink::crc_add(mavlink::kCrcInitial, std::span(out).subspan(1)), info.crc_extra);
    put(crc & 0xFF), put(crc >> 8);
    for (std::size_t i = 0; is_signed && i < mavlink::kSignatureBytes; ++i) put(random_.byte());
  }

 private:
  Random& random_;
  std::array<std::uint8_t, 2> sequence_{};
};

// The kinds of damage. `donor` is another good frame.
void flip_bits(Bytes& f, Random& r, const Bytes&) {
  for (std::size_t n = 1 + r.below(4); n > 0; --n) f[r.below(f.size())] ^= static_cast<std::uint8_t>(1u << r.below(8));
}
void overwrite(Bytes& f, Random& r, const Bytes&) {
  for (std::size_t n = 1 + r.below(4), at = r.below(f.size()); n > 0 && at < f.size(); --n, ++at) f[at] = r.byte();
}
void drop(Bytes& f, Random& r, const Bytes&) {
  const std::size_t at = r.below(f.size()), n = std::min(1 + r.below(8), f.size() - at);
  f.erase(f.begin() + static_cast<std::ptrdiff_t>(at), f.begin() + static_cast<std::ptrdiff_t>(at + n));
}
void double_bytes(Bytes& f, Random& r, const Bytes&) {
  const std::size_t at = r.below(f.size()), n = std::min(1 + r.below(f.size()), f.size() - at);
  const Bytes again(f.begin() + static_cast<std::ptrdiff_t>(at), f.begin() + static_cast<std::ptrdiff_t>(at + n));
  f.insert(f.begin() + static_cast<std::ptrdiff_t>(at), again.begin(), again.end());
}
void insert(Bytes& f, Random& r, const Bytes&) {
  const std::size_t at = r.below(f.size() + 1), n = 1 + r.below(8);
  const auto place = f.insert(f.begin() + static_cast<std::ptrdiff_t>(at), n, 0);
  std::generate_n(place, n, [&r] { return r.byte(); });
}
void cut_off(Bytes& f, Random& r, const Bytes&) { f.resize(r.below(f.size())); }
void splice(Bytes& f, Random& r, const Bytes& donor) {
  f.resize(r.below(f.size()));
  f.insert(f.end(), donor.begin() + static_cast<std::ptrdiff_t>(r.below(donor.size())), donor.end());
}

using Damage = void (*)(Bytes&, Random&, const Bytes&);
struct Kind {
  const char* name;
  Damage apply;
};
constexpr std::array<Kind, 7> kKinds = {{{"bits flipped", &flip_bits},
                                         {"overwritten", &overwrite},
                                         {"bytes dropped", &drop},
                                         {"bytes doubled", &double_bytes},
                                         {"bytes inserted", &insert},
                                         {"cut off", &cut_off},
                                         {"spliced", &splice}}};

bool has_signature(std::span<const std::uint8_t> wire) {
  return wire[0] == mavlink::kStartV2 && (wire[2] & mavlink::kIncompatSigned) != 0;
}
/// What the checksum speaks for: all but a signature.
std::span<const std::uint8_t> checked_part(std::span<const std::uint8_t> wire) {
  return wire.first(wire.size() - (has_signature(wire) ? mavlink::kSignatureBytes : 0));
}
bool same(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size()) == 0;
}

struct Tally {
  std::uint64_t mutants = 0, unchanged = 0, good_sent = 0, good_lost = 0;
  /// Of them, those whose first bytes complete the mutant before them: on the wire stands the mutant's original, whole.
  std::uint64_t lost_to_completion = 0;
  std::uint64_t again = 0;           ///< accepted once more, or out of the damage: an original, whole
  std::uint64_t signature_only = 0;  ///< an original but for signature bytes, which no checksum covers
  std::uint64_t collisions = 0, unexplained = 0;
  std::array<std::uint64_t, 5> lost_by_one_mutant{};  ///< 0, 1, 2, 3, more
  /// Good frames lost, by the last damage of the mutant before them: of an unsigned frame, of a signed one.
  std::array<std::array<std::uint64_t, 2>, kKinds.size()> lost_to{};
};

class Campaign {
 public:
  explicit Campaign(std::uint64_t seed) : random_(seed), forge_(random_) {}

  Tally run(std::uint64_t count) {
    for (std::uint64_t i = 0; i < count; ++i) {
      send_good();
      if (random_.below(2) == 0) send_good();
      send_mutant();
      if (stream_.size() > 4096) flush();
    }
    for (int i = 0; i < 8; ++i) send_good();  // behind the last mutant, so that nothing waits for more
    stream_.insert(stream_.end(), 2 * mavlink::kMaxFrame, 0);
    flush();
    while (!originals_.empty()) retire();
    return tally_;
  }

 private:
  /// A frame that went out whole, or as it was before its damage.
  struct Original {
    Bytes wire;
    bool good = false, seen = false;
    bool is_signed = false;
    bool completes = false;  ///< the mutant before it
    std::size_t kind = 0;    ///< damage
  };
  static constexpr std::size_t kRemembered = 48;  ///< far more than a parser's buffer of 1024 bytes can hold back

  Original& remember(bool good) {
    if (originals_.size() == kRemembered && stream_.empty()) retire();
    originals_.emplace_back();
    forge_.make(originals_.back().wire);
    originals_.back().good = good;
    return originals_.back();
  }
  void send_good() {
    Original& frame = remember(true);
    frame.completes = completes_mutant(frame.wire);
    mutant_.clear();
    stream_.insert(stream_.end(), frame.wire.begin(), frame.wire.end());
    ++tally_.good_sent;
  }
  /// The end of the last mutant and the first bytes of `next` are what the checksum of its original speaks for.
  bool completes_mutant(const Bytes& next) const {
    if (mutant_.empty()) return false;
    const std::span<const std::uint8_t> original = checked_part(mutant_of_);
    Bytes joined = mutant_;
    for (std::size_t i = 0; i < std::min<std::size_t>(8, next.size()); ++i) {
      joined.push_back(next[i]);
      if (joined.size() >= original.size() && same(std::span(joined).last(original.size()), original)) return true;
    }
    return false;
  }
  void send_mutant() {
    Original& frame = remember(false);
    const Bytes& donor = originals_[random_.below(originals_.size())].wire;
    Bytes mutant = frame.wire;
    for (std::size_t n = 1 + random_.below(8) / 6; n > 0 && !mutant.empty(); --n) {
      frame.kind = random_.below(kKinds.size());
      kKinds[frame.kind].apply(mutant, random_, donor);
    }
    frame.is_signed = has_signature(frame.wire) || has_signature(donor);
    tally_.unchanged += same(mutant, frame.wire) ? 1 : 0;
    stream_.insert(stream_.end(), mutant.begin(), mutant.end());
    mutant_ = mutant, mutant_of_ = frame.wire;
    ++tally_.mutants;
  }

  /// Feeds what has gathered in pieces as a serial line hands them out.
  void flush() {
    for (std::span<const std::uint8_t> rest = stream_; !rest.empty();) {
      const std::size_t n = std::min(1 + random_.below(256), rest.size());
      parser_.feed(rest.first(n), [this](const mavlink::Frame& frame) noexcept { accept(frame); });
      rest = rest.subspan(n);
    }
    stream_.clear();
    while (originals_.size() > kRemembered) retire();
  }

  void accept(const mavlink::Frame& frame) {
    Original* touched = nullptr;
    for (Original& original : originals_) {
      if (!same(checked_part(original.wire), checked_part(frame.wire))) continue;
      touched = &original;
      if (original.good && !original.seen && same(original.wire, frame.wire)) {
        original.seen = true;
        return;
      }
    }
    if (touched != nullptr) {
      const bool whole = same(touched->wire, frame.wire);
      ++(whole ? tally_.again : tally_.signature_only);
      return;
    }
    const mavlink::MessageInfo* info = mavlink::find_message(frame.message_id);
    const bool proven = info != nullptr && fuzz::is_whole_frame(frame.wire, info->crc_extra);
    ++(proven ? tally_.collisions : tally_.unexplained);
    if (!proven) print("accepted without a checksum", frame.wire);
  }
  static void print(const char* what, std::span<const std::uint8_t> wire) {
    std::printf("%s:", what);
    for (const std::uint8_t byte : wire) std::printf(" %02x", byte);
    std::printf("\n");
  }

  /// Forgets the oldest; a good one that was never seen counts against the mutant before it.
  void retire() {
    const Original& oldest = originals_.front();
    if (!oldest.good) {
      count_lost();
      lost_ = 0, kind_ = oldest.kind, is_signed_ = oldest.is_signed;
    } else if (!oldest.seen) {
      ++tally_.good_lost;
      tally_.lost_to_completion += oldest.completes ? 1 : 0;
      ++tally_.lost_to[kind_][is_signed_ ? 1 : 0];
      ++lost_;
    }
    originals_.pop_front();
    if (originals_.empty()) count_lost();
  }
  void count_lost() {
    ++tally_.lost_by_one_mutant[std::min<std::uint64_t>(lost_, tally_.lost_by_one_mutant.size() - 1)];
  }

  Random random_;
  Forge forge_;
  mavlink::Parser parser_;
  std::deque<Original> originals_;
  Bytes stream_;
  Bytes mutant_, mutant_of_;  ///< the last one sent and its original, until a good frame follows
  Tally tally_;
  std::uint64_t lost_ = 0;  ///< good frames lost since the last mutant that was retired
  std::size_t kind_ = 0;    ///< of that mutant
  bool is_signed_ = false;
};

void print(const Tally& t) {
  const auto row = [](const char* what, std::uint64_t n) { std::printf("%14" PRIu64 "  %s\n", n, what); };
  row("mutants", t.mutants);
  row("  of them as before their damage", t.unchanged);
  row("good frames sent between them", t.good_sent);
  row("good frames lost", t.good_lost);
  row("  of them to a mutant that their own first bytes complete", t.lost_to_completion);
  std::printf("%14s  good frames lost by one mutant: 0: %" PRIu64 ", 1: %" PRIu64 ", 2: %" PRIu64 ", 3: %" PRIu64
              ", more: %" PRIu64 "\n",
              "", t.lost_by_one_mutant[0], t.lost_by_one_mutant[1], t.lost_by_one_mutant[2], t.lost_by_one_mutant[3],
              t.lost_by_one_mutant[4]);
  for (std::size_t i = 0; i < kKinds.size(); ++i)
    std::printf("%14s  lost behind %s: unsigned %" PRIu64 ", signed %" PRIu64 "\n", "", kKinds[i].name, t.lost_to[i][0],
                t.lost_to[i][1]);
  row("originals accepted out of the damage, or twice", t.again);
  row("originals accepted with another signature, which no checksum covers", t.signature_only);
  row("accepted, differs from every original: checksum holds (collision)", t.collisions);
  row("accepted, differs from every original: NOT explained", t.unexplained);
}

std::uint64_t option(int argc, char** argv, std::string_view name, std::uint64_t fallback) {
  for (int i = 1; i + 1 < argc; i += 2)
    if (argv[i] == name) return std::strtoull(argv[i + 1], nullptr, 10);
  return fallback;
}

}  // namespace
}  // namespace wasp

int main(int argc, char** argv) {
  const std::uint64_t count = wasp::option(argc, argv, "--count", 100'000),
                      seed = wasp::option(argc, argv, "--seed", 1);
  const wasp::Tally tally = wasp::Campaign(seed).run(count);
  wasp::print(tally);
  return tally.unexplained == 0 && tally.mutants == count ? 0 : 1;
}
