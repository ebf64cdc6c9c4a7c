#include "tools/record_image_pool.h"

#include <fmt/format.h>

#include <exception>

#include "drivers/image_file.h"

namespace wasp::tools {
namespace {

constexpr int kCompression = 1;  // what two threads keep up with at 2 x 30 Hz

std::filesystem::path made(const std::filesystem::path& path) {
  std::filesystem::create_directories(path);
  return path;
}

void save(const std::filesystem::path& path, const TakenFrame& frame) {
  const auto width = static_cast<int>(frame.header.width_px), height = static_cast<int>(frame.header.height_px);
  if (frame.header.format == PixelFormat::kDepth16Mm) {
    const auto* pixels = reinterpret_cast<const std::uint16_t*>(frame.pixels.data());
    drivers::save_png(path, DepthView{pixels, width, height, width}, kCompression);
  } else {
    const auto* pixels = reinterpret_cast<const std::uint8_t*>(frame.pixels.data());
    drivers::save_png(path, GrayView{pixels, width, height, width}, kCompression);
  }
}

}  // namespace

ImageStream::ImageStream(const std::filesystem::path& where, std::string name)
    : folder(std::move(name)), directory(made(where / folder)), index(where / (folder + ".txt"), "") {}

std::string ImageStream::name_for(std::uint32_t sequence) {
  if (static_cast<std::int64_t>(sequence) <= last_sequence_) ++restarts_;
  last_sequence_ = sequence;
  return restarts_ == 0 ? fmt::format("frame-{}.png", sequence) : fmt::format("frame-{}-r{}.png", sequence, restarts_);
}

ImagePool::ImagePool(std::size_t capacity, int threads) : capacity_(capacity) {
  for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { work(); });
}

ImagePool::~ImagePool() {
  finish();
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  more_.notify_all();
  for (auto& thread : threads_) thread.join();
}

bool ImagePool::has_room() {
  const std::lock_guard lock(mutex_);
  return jobs_.size() < capacity_;
}

void ImagePool::push(ImageStream& stream, TakenFrame frame) {
  std::string file = stream.name_for(frame.header.sequence);
  {
    const std::lock_guard lock(mutex_);
    jobs_.push_back({&stream, stream.next_ticket++, std::move(file), std::move(frame)});
  }
  more_.notify_one();
}

void ImagePool::work() {
  std::unique_lock lock(mutex_);
  for (;;) {
    more_.wait(lock, [this] { return stop_ || !jobs_.empty(); });
    if (jobs_.empty()) return;
    const Job job = std::move(jobs_.front());
    jobs_.pop_front();
    ++under_way_;
    lock.unlock();
    bool ok = true;
    try {
      save(job.stream->directory / job.file, job.frame);
    } catch (const std::exception&) {
      ok = false;
    }
    lock.lock();
    settle(job, ok);
  }
}

void ImagePool::settle(const Job& job, bool ok) {
  ImageStream& stream = *job.stream;
  const TimeNs t = job.frame.header.exposed_at_ns;
  stream.done[job.ticket] =
      ok ? fmt::format("{}.{:09} {}/{}", t / kSecond, t % kSecond, stream.folder, job.file) : std::string();
  if (!ok) ++stream.failed;
  for (auto it = stream.done.begin(); it != stream.done.end() && it->first == stream.next_line; ++stream.next_line) {
    if (!it->second.empty()) stream.index.line(it->second);
    it = stream.done.erase(it);
  }
  --under_way_;
  settled_.notify_all();
}

void ImagePool::finish() {
  std::unique_lock lock(mutex_);
  settled_.wait(lock, [this] { return jobs_.empty() && under_way_ == 0; });
}

void ImagePool::flush(ImageStream& stream) {
  const std::lock_guard lock(mutex_);
  stream.index.flush();
}

std::uint64_t ImagePool::failed(const ImageStream& stream) {
  const std::lock_guard lock(mutex_);
  return stream.failed + stream.index.failed_lines();
}

}  // namespace wasp::tools
