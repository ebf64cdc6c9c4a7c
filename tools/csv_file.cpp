#include "tools/csv_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace wasp::tools {
namespace {
constexpr std::size_t kPage = 4096;
constexpr std::size_t kGather = 64 * 1024;
}  // namespace

CsvFile::CsvFile(const std::filesystem::path& path, std::string_view header) {
  fd_ = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (fd_ < 0) throw std::runtime_error("cannot write '" + path.string() + "': " + std::strerror(errno));
  pending_.reserve(kGather + kPage);
  if (header.empty()) return;
  pending_.append(header).push_back('\n');
  flush();
}

CsvFile::~CsvFile() {
  flush();
  close(fd_);
}

void CsvFile::line(std::string_view text) {
  pending_.append(text).push_back('\n');
  ++lines_;
  if (pending_.size() >= kGather) flush();
}

/// End of the longest run of lines from `from` that stays within the file's current page; at least one line.
std::size_t CsvFile::chunk_end(std::size_t from) const {
  const std::size_t room = kPage - bytes_ % kPage;
  const std::size_t limit = std::min(from + room, pending_.size());
  const std::size_t last = limit > from ? pending_.rfind('\n', limit - 1) : std::string::npos;
  if (last != std::string::npos && last >= from) return last + 1;
  return pending_.find('\n', from) + 1;
}

bool CsvFile::write_chunk(std::string_view chunk) {
  std::size_t done = 0;
  while (done < chunk.size()) {
    const ssize_t n = write(fd_, chunk.data() + done, chunk.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      if (ftruncate(fd_, static_cast<off_t>(bytes_)) == 0) lseek(fd_, static_cast<off_t>(bytes_), SEEK_SET);
      return false;
    }
    done += static_cast<std::size_t>(n);
  }
  bytes_ += chunk.size();
  return true;
}

void CsvFile::flush() {
  for (std::size_t from = 0; from < pending_.size();) {
    const std::size_t end = chunk_end(from);
    const std::string_view chunk = std::string_view(pending_).substr(from, end - from);
    if (!write_chunk(chunk)) failed_lines_ += static_cast<std::uint64_t>(std::count(chunk.begin(), chunk.end(), '\n'));
    from = end;
  }
  pending_.clear();
}

}  // namespace wasp::tools
