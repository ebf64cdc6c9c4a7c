// Trials of the gateway: it, its worker and iceoryx's daemon are killed and frozen at random, the same way for the same
// seed. For tests and benchmarks, which look on at the flight meanwhile.
#pragma once

#include <memory>
#include <random>
#include <string>
#include <vector>

#include "tools/child_process.h"
#include "tools/roudi_process.h"

namespace wasp::tools {

class GatewayChaos {
 public:
  /// Starts the gateway: `arguments` with the path of wasp-iceoryx first. What it says goes to `log_path`.
  GatewayChaos(RoudiProcess& daemon, std::vector<std::string> arguments, std::string log_path, unsigned seed);
  /// Thaws all three and ends the gateway.
  ~GatewayChaos();
  GatewayChaos(const GatewayChaos&) = delete;
  GatewayChaos& operator=(const GatewayChaos&) = delete;

  /// One act: kills, freezes or thaws one of the three.
  void act();
  /// Everything runs again: another daemon, and the gateway thawed or started again.
  void calm();

  [[nodiscard]] int kills() const { return kills_; }
  [[nodiscard]] int freezes() const { return freezes_; }
  /// "7 kills, 5 freezes".
  [[nodiscard]] std::string account() const;

 private:
  void start();
  void to_worker(int signal) const;
  void to_gateway(int signal);

  RoudiProcess& daemon_;
  std::vector<std::string> arguments_;
  std::string log_path_;
  std::mt19937 random_;
  std::unique_ptr<ChildProcess> gateway_;
  int kills_ = 0, freezes_ = 0;
};

}  // namespace wasp::tools
