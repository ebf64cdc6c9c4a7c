// Follows one ring and writes what it reads to a CSV file. Polls, never rings or waits on a bell. What was overwritten
// before it could be read is counted, what lay there before the recorder looked is read too.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <utility>

#include "shm/broadcast_ring.h"
#include "tools/csv_file.h"
#include "tools/csv_rows.h"

namespace wasp::tools {

/// The account of one topic over all attachments; goes to log/record.json.
struct TopicCount {
  std::string region, topic, type;
  std::uint64_t taken = 0;          ///< messages written to the record
  std::uint64_t lost = 0;           ///< overwritten before or while they were read
  std::uint64_t before_attach = 0;  ///< overwritten, or of an earlier flight, before the recorder came
  std::uint64_t rejected = 0;       ///< frames whose header does not fit their slot
  std::uint64_t failed = 0;         ///< frames the disk refused
  std::uint64_t queue_full = 0;     ///< polls that found the image writers busy (the frame waits in its ring)
};

/// Where a follower starts.
enum class Start { kHistory, kNewest };

/// Places `reader` and accounts for what is out of reach.
inline void start_reader(shm::RingReader& reader, Start start, TopicCount& count) {
  const std::uint64_t newest = reader.newest(), slots = reader.slots();
  if (start == Start::kHistory) {
    reader.rewind();
    count.before_attach += newest >= slots ? newest - slots + 1 : 0;
  } else {
    count.before_attach += newest;
  }
}

template <rt::WordCopyable T>
class TopicFollower {
 public:
  using ToRow = std::function<std::string(const T&, const RingStamp&)>;

  /// `file` and `count` outlive the follower. Throws if the topic is absent, of another type or too small for a T.
  TopicFollower(const shm::Region& region, Start start, CsvFile& file, TopicCount& count, ToRow to_row)
      : reader_(region, count.topic, count.type), file_(file), count_(count), to_row_(std::move(to_row)) {
    if (sizeof(T) > reader_.payload_bytes()) throw std::runtime_error("topic '" + count.topic + "' is too small");
    start_reader(reader_, start, count_);
  }

  /// Takes what is new; bounded, so that one busy writer cannot keep the others from being read.
  void drain() {
    const std::uint64_t lost_before = reader_.lost();
    for (std::uint32_t i = 0; i < 2 * reader_.slots(); ++i) {
      const std::uint64_t lost = reader_.lost();
      const shm::Sample sample = reader_.next();
      if (sample)
        take(sample);
      else if (reader_.lost() == lost)
        break;
    }
    count_.lost += reader_.lost() - lost_before;
  }

 private:
  void take(const shm::Sample& sample) {
    T value;
    rt::load_words(value, reinterpret_cast<const T*>(sample.data));
    if (!reader_.intact(sample)) return reader_.count_lost();
    file_.line(to_row_(value, {sample.number, sample.published_at_ns}));
    ++count_.taken;
  }

  shm::RingReader reader_;
  CsvFile& file_;
  TopicCount& count_;
  ToRow to_row_;
};

}  // namespace wasp::tools
