#include "tools/iceoryx_daemon.h"

#include <sys/stat.h>

#include <fstream>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "rt/clock.h"

namespace wasp::iceoryx {
namespace {

constexpr const char* kLockFile = "/tmp/iox-unique-roudi.lock";  // iox::roudi::ROUDI_LOCK_NAME, as libiceoryx builds it
constexpr const char* kManagement = "/dev/shm/iceoryx_mgmt";

ino_t inode_of(const char* path) {
  struct stat st {};
  return stat(path, &st) == 0 ? st.st_ino : 0;
}

/// Holder of a lock on the file, from a line "1: FLOCK  ADVISORY  WRITE 5879 fe:00:10953097 0 EOF".
pid_t holder(const std::string& line, ino_t inode) {
  std::istringstream words(line);
  std::string number, kind, mode, access, file;
  pid_t pid = 0;
  if (!(words >> number >> kind >> mode >> access >> pid >> file)) return 0;
  const std::string tail = std::string(":").append(std::to_string(inode));
  return file.ends_with(tail) ? pid : 0;
}

}  // namespace

pid_t daemon_pid() {
  const ino_t inode = inode_of(kLockFile);
  if (inode == 0) return 0;
  std::ifstream locks("/proc/locks");
  if (!locks) throw std::runtime_error("cannot read /proc/locks: is /proc mounted?");
  for (std::string line; std::getline(locks, line);)
    if (const pid_t pid = holder(line, inode); pid > 0) return pid;
  return 0;
}

bool is_stopped(pid_t pid) {
  std::ifstream status("/proc/" + std::to_string(pid) + "/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("State:\t") && line.size() > 7) return line[7] == 'T' || line[7] == 't';
  return false;
}

pid_t await_daemon(double patience_s, const std::function<bool()>& between) {
  const TimeNs deadline = patience_s < 0 ? std::numeric_limits<TimeNs>::max() : rt::now() + from_seconds(patience_s);
  for (;;) {
    // The lock is taken before the memory is made; a client that comes too early would wait for it in silence.
    if (const pid_t pid = daemon_pid(); pid > 0 && daemon_memory() != 0) return pid;
    if (rt::now() >= deadline || !between()) return 0;
    rt::sleep_until(rt::now() + 50 * kMillisecond);
  }
}

ino_t daemon_memory() { return inode_of(kManagement); }

}  // namespace wasp::iceoryx
