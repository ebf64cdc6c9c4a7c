#include "shm/shm_file.h"

#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace wasp::shm {
namespace {

/// On the whole file, owned by the open file and not by the process: a second open in the same process is refused too.
struct flock whole_file_lock() {
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  return lock;
}

}  // namespace

void fail(const std::string& name, const std::string& why) {
  throw std::runtime_error("shared memory region '" + name + "': " + why);
}
void fail_errno(const std::string& name, const std::string& what) { fail(name, what + ": " + std::strerror(errno)); }

std::string path_of(const std::string& name) {
  if (name.empty() || name.find('/') != std::string::npos || name.ends_with(".bell") || name.ends_with(".lock"))
    fail(name, "bad name");
  return kDirectory + name;
}
std::string bell_path_of(const std::string& name) { return path_of(name) + ".bell"; }
std::string lock_path_of(const std::string& name) { return path_of(name) + ".lock"; }

bool same_file(const std::string& path, std::uint64_t inode) {
  struct stat st {};
  return stat(path.c_str(), &st) == 0 && st.st_ino == inode;
}

int lock_for_writing(const std::string& name) {
  for (;;) {
    File file(lock_path_of(name), O_RDWR | O_CREAT, 0600);
    if (!file) fail_errno(name, "lock file");
    struct flock lock = whole_file_lock();
    if (fcntl(file.fd(), F_OFD_SETLK, &lock) != 0) {
      if (errno == EAGAIN || errno == EACCES) fail(name, "another process is writing it (one writer only)");
      fail_errno(name, "lock");
    }
    // Looked at again: Region::remove may have unlinked what was locked.
    if (same_file(lock_path_of(name), file.status().st_ino)) return file.release();
  }
}

void try_lock(const File& lock_file) {
  struct flock lock = whole_file_lock();
  if (lock_file) fcntl(lock_file.fd(), F_OFD_SETLK, &lock);
}

bool is_locked(const File& lock_file, bool& error) {
  struct flock lock = whole_file_lock();
  error = !lock_file || fcntl(lock_file.fd(), F_OFD_GETLK, &lock) != 0;
  return !error && lock.l_type != F_UNLCK;
}

int reserve(int fd, std::uint64_t bytes) {
  int error = EINTR;
  while (error == EINTR) error = posix_fallocate(fd, 0, static_cast<off_t>(bytes));
  return error;
}

}  // namespace wasp::shm
