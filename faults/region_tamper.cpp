#include "faults/region_tamper.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shm/region.h"
#include "sim/random.h"

namespace wasp::faults {
namespace {

std::string path_of(const std::string& name) { return "/dev/shm/" + name; }

}  // namespace

bool flip_bits(const std::string& name, std::size_t from, std::size_t until, std::size_t count, std::uint32_t seed) {
  const int fd = open(path_of(name).c_str(), O_RDWR | O_CLOEXEC);
  struct stat status {};
  if (fd < 0 || fstat(fd, &status) != 0) return false;
  if (until == 0) until = static_cast<std::size_t>(status.st_size);
  sim::Random random(seed);
  bool done = until > from;
  for (std::size_t i = 0; done && i < count; ++i) {
    const auto at = static_cast<off_t>(from + random.bits() % (until - from));
    unsigned char byte = 0;
    done = pread(fd, &byte, 1, at) == 1;
    byte = static_cast<unsigned char>(byte ^ 1u << random.bits() % 8);
    done = done && pwrite(fd, &byte, 1, at) == 1;
  }
  close(fd);
  return done;
}

bool cut_short(const std::string& name, std::size_t bytes) {
  return truncate(path_of(name).c_str(), static_cast<off_t>(bytes)) == 0;
}

bool second_writer_refused(const std::string& name) {
  const shm::TopicSpec topic{"intruder", "Intruder", shm::TopicKind::kRing, 4, 64};
  try {
    const auto region = shm::Region::create(name, {&topic, 1});
    return false;
  } catch (const std::exception&) {
    return true;
  }
}

}  // namespace wasp::faults
