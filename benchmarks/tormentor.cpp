#include "benchmarks/tormentor.h"

#include <signal.h>
#include <sys/wait.h>

#include <utility>

namespace wasp::bench {

Tormentor::Tormentor(std::function<pid_t()> raise, unsigned seed, Torments& torments)
    : raise_(std::move(raise)), random_(seed), torments_(torments), pid_(raise_()) {}

Tormentor::~Tormentor() { end(); }

void Tormentor::act() {
  const auto what = random_() % 4;
  if (what == 0) {
    end();
    pid_ = raise_();
    ++torments_.deaths;
  } else {
    kill(pid_, what == 1 ? SIGSTOP : SIGCONT);
    torments_.freezes += what == 1 ? 1 : 0;
  }
}

void Tormentor::end() {
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
}

}  // namespace wasp::bench
