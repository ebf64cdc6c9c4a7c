// Finds frames in a byte stream. A start byte is a claim; the header refutes most false ones at once (unknown id,
// source 0, impossible version 1 length), the checksum the rest, and the search goes on at the byte after the failed
// start, so a damaged frame never hides the good one behind it. No checksum covers a signature: where its bytes were not
// verified, the search goes on inside them, for a frame that lost some of them took the missing ones from its neighbour.
// A frame that cannot be verified (unknown id) is passed over whole only if it stood where a frame was due and the next
// header in sequence follows it: frames inside its payload are not ours.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "messages/frame_layout.h"
#include "messages/signature_check.h"
#include "messages/source_counts.h"

namespace wasp::mavlink {

/// Takes bytes in pieces of any size, versions 1 and 2 interleaved. Realtime-safe: yes; no allocation; work per byte is
/// at most one checksum over a frame (280 bytes), and one SHA-256 where signatures are checked.
class Parser {
 public:
  /// `messages`, rising in id, outlive the parser: by default wasp's own.
  explicit Parser(std::span<const MessageInfo> messages = kMessages) noexcept : messages_(messages) {}

  /// From now on frames must pass `check`, which outlives the parser, to be handed out. Before the first byte only.
  void check_signatures(SignatureCheck& check) noexcept { signatures_ = &check; }

  /// Calls on_frame(const Frame&) for each good frame, in stream order.
  template <class OnFrame>
  void feed(std::span<const std::uint8_t> bytes, OnFrame&& on_frame) WASP_REALTIME {
    counts_.bytes += bytes.size();
    while (!bytes.empty()) {
      bytes = bytes.subspan(take(bytes));
      Frame frame;
      while (next(frame)) on_frame(static_cast<const Frame&>(frame));
    }
  }

  [[nodiscard]] const Counts& counts() const noexcept { return counts_; }
  [[nodiscard]] std::span<const SourceCounts> sources() const noexcept { return sources_.rows(); }
  /// Forgets a partial frame (the line was cut); counts stay.
  void reset() WASP_REALTIME;

 private:
  enum class Verdict { kNeedMore, kNotAFrame, kPassOver, kRefused, kGood };
  /// What a start byte and the header behind it claim.
  struct Claim {
    Frame frame;
    std::uint8_t incompat_flags = 0;
    std::size_t header = 0, total = 0;  ///< bytes of the header, and of the whole frame
  };

  std::size_t take(std::span<const std::uint8_t> bytes) WASP_REALTIME;
  bool next(Frame& frame) WASP_REALTIME;
  Verdict examine(Claim& claim) WASP_REALTIME;
  Verdict examine_unverifiable(const Claim& claim, std::uint64_t Counts::*total,
                               std::uint64_t SourceCounts::*row) WASP_REALTIME;
  Verdict refuse_header() WASP_REALTIME;
  Verdict check(Claim& claim, std::uint8_t crc_extra) WASP_REALTIME;
  bool read_header(std::size_t at, Claim& claim) const WASP_REALTIME;
  bool checksum_holds(std::size_t at, const Claim& claim, std::uint8_t crc_extra) const WASP_REALTIME;
  int steps_ahead(const Frame& frame, const Frame& before) WASP_REALTIME;
  bool swallows_a_frame(const Claim& claim, const Frame& follower) WASP_REALTIME;
  bool admitted(Frame& frame) WASP_REALTIME;
  bool continues_a_sender(const Frame& frame) WASP_REALTIME;
  void consume(const Claim& claim) WASP_REALTIME;
  void drop(std::size_t n) WASP_REALTIME;
  [[nodiscard]] bool frame_is_due() const WASP_REALTIME { return offset_ == due_; }
  [[nodiscard]] std::size_t available() const WASP_REALTIME { return tail_ - head_; }

  std::span<const MessageInfo> messages_;
  std::array<std::uint8_t, 1024> buffer_;  ///< bytes [head_, tail_) are not yet decided on
  std::size_t head_ = 0, tail_ = 0;
  std::uint64_t offset_ = 0;         ///< stream position of head_
  std::uint64_t due_ = 0;            ///< stream position where the next frame starts if nothing is damaged
  std::uint64_t counted_until_ = 0;  ///< failures before this position belong to a frame already counted
  std::uint64_t signature_until_ = 0;  ///< bytes before this position are of a signature nobody verified
  SignatureCheck* signatures_ = nullptr;
  Counts counts_;
  SourceTable sources_;
};

}  // namespace wasp::mavlink
