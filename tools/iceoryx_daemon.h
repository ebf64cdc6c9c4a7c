// Finds iceoryx's daemon without asking it anything: iox-roudi holds a lock on a file, and the kernel tells who holds
// locks. A daemon that is absent or stopped is thus named, where iceoryx's own client would wait a minute and abort.
#pragma once

#include <sys/types.h>

#include <functional>
#include <string>

namespace wasp::iceoryx {

/// Process number of the running iox-roudi, 0 if there is none. Throws std::runtime_error if /proc/locks cannot be
/// read.
pid_t daemon_pid();

/// True if the daemon's process is stopped (SIGSTOP, Ctrl-Z, a debugger).
bool is_stopped(pid_t pid);

/// Waits until a daemon runs, at most `patience_s` (below zero: for ever), calling `between` now and then; 0 on
/// time-out or when `between` says false.
pid_t await_daemon(double patience_s, const std::function<bool()>& between);

/// Identity of the daemon's memory: it changes when another daemon has taken over, and then every service of before is
/// gone. 0 if there is none.
ino_t daemon_memory();

}  // namespace wasp::iceoryx
