#include "tools/gateway_chaos.h"

#include <signal.h>

#include <fstream>

namespace wasp::tools {

GatewayChaos::GatewayChaos(RoudiProcess& daemon, std::vector<std::string> arguments, std::string log_path,
                           unsigned seed)
    : daemon_(daemon), arguments_(std::move(arguments)), log_path_(std::move(log_path)), random_(seed) {
  start();
}

GatewayChaos::~GatewayChaos() {
  daemon_.signal(SIGCONT);
  to_gateway(SIGCONT);
  to_worker(SIGCONT);
}

void GatewayChaos::start() { gateway_ = std::make_unique<ChildProcess>(arguments_, log_path_); }

/// The gateway's only child, while it has one.
void GatewayChaos::to_worker(int signal) const {
  const std::string pid = std::to_string(gateway_->pid());
  std::ifstream children("/proc/" + pid + "/task/" + pid + "/children");
  if (pid_t worker = 0; children >> worker) kill(worker, signal);
}

void GatewayChaos::to_gateway(int signal) {
  gateway_->signal(signal);
  if (signal != SIGKILL) return;
  gateway_->end(SIGKILL, 5);
  start();
}

void GatewayChaos::act() {
  const auto what = random_() % 9;
  if (what < 3) ++kills_;
  if (what >= 3 && what < 6) ++freezes_;
  switch (what) {
    case 0:
      return to_worker(SIGKILL);
    case 1:
      return to_gateway(SIGKILL);
    case 2:
      daemon_.replace();
      return;
    case 3:
      return to_worker(SIGSTOP);
    case 4:
      return to_gateway(SIGSTOP);
    case 5:
      return daemon_.signal(SIGSTOP);
    case 6:
      return to_worker(SIGCONT);
    case 7:
      return to_gateway(SIGCONT);
    default:
      return daemon_.signal(SIGCONT);
  }
}

void GatewayChaos::calm() {
  daemon_.replace();
  to_worker(SIGCONT);
  to_gateway(SIGCONT);
  if (gateway_->poll()) start();
}

std::string GatewayChaos::account() const {
  return std::to_string(kills_) + " kills, " + std::to_string(freezes_) + " freezes";
}

}  // namespace wasp::tools
