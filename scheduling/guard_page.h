// The page between guardian and flying process: made by the one, inherited by the other.
#pragma once

#include "scheduling/guard_block.h"

namespace wasp::scheduling {

/// Descriptors a guarded flight finds open: they have the same numbers always, as systemd's sockets have.
enum GuardedDescriptor : int { kPageDescriptor = 3, kLineDescriptor = 4, kLineSocketDescriptor = 5, kGoDescriptor = 6 };

/// In the flying process: waits for the guardian's word to begin. A successor is started while the one before it still
/// may come back. False: never. Closes the descriptor.
bool wait_for_go(int fd = kGoDescriptor);

class GuardPage {
 public:
  /// A new one: a memfd sealed against shrinking and growing. Throws std::runtime_error.
  static GuardPage create();
  /// The one behind an inherited descriptor, which is closed. Throws if it is none, or could still be shrunk.
  static GuardPage adopt(int fd);
  GuardPage(GuardPage&& other) noexcept;
  GuardPage& operator=(GuardPage&&) = delete;
  ~GuardPage();

  [[nodiscard]] int fd() const noexcept { return fd_; }  ///< -1 after adopt
  [[nodiscard]] GuardBlock& block() const noexcept { return *block_; }

 private:
  GuardPage(int fd, GuardBlock* block) : fd_(fd), block_(block) {}
  int fd_ = -1;
  GuardBlock* block_ = nullptr;
};

}  // namespace wasp::scheduling
