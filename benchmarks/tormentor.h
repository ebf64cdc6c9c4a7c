// Holds a process, and kills, freezes or thaws it at random.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <random>

namespace wasp::bench {

/// What was done to processes, all tormentors together.
struct Torments {
  std::uint64_t deaths = 0, freezes = 0;
};

class Tormentor {
 public:
  /// `raise` starts the process, and its successor after each death.
  Tormentor(std::function<pid_t()> raise, unsigned seed, Torments& torments);
  /// SIGKILL.
  ~Tormentor();
  Tormentor(const Tormentor&) = delete;
  Tormentor& operator=(const Tormentor&) = delete;
  /// One random act: SIGKILL and a successor, SIGSTOP, or SIGCONT (twice as often as either).
  void act();

 private:
  void end();

  std::function<pid_t()> raise_;
  std::mt19937 random_;
  Torments& torments_;
  pid_t pid_;
};

}  // namespace wasp::bench
