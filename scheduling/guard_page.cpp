#include "scheduling/guard_page.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <new>
#include <stdexcept>
#include <string>
#include <utility>

namespace wasp::scheduling {
namespace {

constexpr std::size_t kBytes = 4096;

[[noreturn]] void fail(const std::string& what) {
  throw std::runtime_error("guard page: " + what + ": " + std::strerror(errno));
}

GuardBlock* map(int fd) {
  void* page = mmap(nullptr, kBytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, fd, 0);
  if (page == MAP_FAILED) fail("mmap");
  return static_cast<GuardBlock*>(page);
}

}  // namespace

bool wait_for_go(int fd) {
  char word = 0;
  ssize_t n = -1;
  while ((n = read(fd, &word, 1)) < 0 && errno == EINTR) {
  }
  close(fd);
  return n == 1;
}

GuardPage GuardPage::create() {
  const int fd = memfd_create("wasp-guard", MFD_CLOEXEC | MFD_ALLOW_SEALING);
  if (fd < 0) fail("memfd_create");
  if (ftruncate(fd, kBytes) != 0 || fcntl(fd, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0) {
    close(fd);
    fail("sealing");
  }
  return {fd, new (map(fd)) GuardBlock};
}

GuardPage GuardPage::adopt(int fd) {
  struct stat info {};
  if (fstat(fd, &info) != 0) fail("no descriptor " + std::to_string(fd) + " was inherited");
  const int seals = fcntl(fd, F_GET_SEALS);
  if (seals < 0 || (seals & F_SEAL_SHRINK) == 0 || info.st_size != static_cast<off_t>(kBytes))
    throw std::runtime_error("guard page: descriptor " + std::to_string(fd) + " is not a sealed page");
  GuardBlock* block = map(fd);
  close(fd);
  if (block->magic != GuardBlock::kMagic) throw std::runtime_error("guard page: of another version of wasp");
  return {-1, block};
}

GuardPage::GuardPage(GuardPage&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)), block_(std::exchange(other.block_, nullptr)) {}

GuardPage::~GuardPage() {
  if (block_ != nullptr) munmap(block_, kBytes);
  if (fd_ >= 0) close(fd_);
}

}  // namespace wasp::scheduling
