// Two threads that turn frames into PNG files, fed by a bounded queue. The index line of a frame ("<seconds> <file>",
// TUM RGB-D layout) is written after its file is whole, in the order the frames were taken: a killed recorder leaves an
// index that names whole files only.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <map>
#include <mutex>
#include <thread>
#include <vector>

#include "tools/csv_file.h"
#include "types/messages.h"

namespace wasp::tools {

/// A frame taken out of its ring; rows without padding.
struct TakenFrame {
  FrameHeader header;
  std::vector<std::byte> pixels;
};

/// One stream of images: DIR/<folder>/frame-<sequence>.png and DIR/<folder>.txt.
class ImageStream {
 public:
  /// Throws std::runtime_error if the folder or the index cannot be made.
  ImageStream(const std::filesystem::path& directory, std::string folder);

  /// File name of a frame; one whose number was used before (a camera that started again) gets a suffix.
  std::string name_for(std::uint32_t sequence);

  std::string folder;
  std::filesystem::path directory;
  CsvFile index;                                 ///< under the pool's lock
  std::uint64_t next_ticket = 0, next_line = 0;  ///< given out; to be written to the index next
  std::map<std::uint64_t, std::string> done;     ///< index lines that wait for an earlier frame; "" for a failed one
  std::uint64_t failed = 0;

 private:
  std::int64_t last_sequence_ = -1;
  int restarts_ = 0;
};

class ImagePool {
 public:
  explicit ImagePool(std::size_t capacity = 32, int threads = 2);
  ~ImagePool();

  [[nodiscard]] bool has_room();
  /// Queues a frame; one producer, after has_room(). `stream` outlives the pool.
  void push(ImageStream& stream, TakenFrame frame);
  /// Waits until everything queued is on disk.
  void finish();
  void flush(ImageStream& stream);
  /// Frames of `stream` the disk refused.
  std::uint64_t failed(const ImageStream& stream);

 private:
  struct Job {
    ImageStream* stream = nullptr;
    std::uint64_t ticket = 0;
    std::string file;
    TakenFrame frame;
  };
  void work();
  void settle(const Job& job, bool ok);

  const std::size_t capacity_;
  std::mutex mutex_;
  std::condition_variable more_, settled_;
  std::deque<Job> jobs_;
  std::size_t under_way_ = 0;
  bool stop_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace wasp::tools
