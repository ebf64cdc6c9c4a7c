// What the guest says on its console, line by line: "@wasp KIND ...". Everything else is the kernel's own talk, kept
// for the case that something goes wrong.
#pragma once

#include <deque>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace wasp::tools::rt_guest {

/// How one job ended.
struct JobOutcome {
  int exit_code = -1;
  nlohmann::json figures;  ///< a flight's: what `wasp-top --once --json` saw; discarded if it was no JSON
  std::vector<std::string> log;
};

class Console {
 public:
  /// Takes more of the console's bytes, whole lines or not.
  void feed(std::string_view bytes);

  [[nodiscard]] bool up() const { return !kernel_.empty(); }
  [[nodiscard]] bool ended() const { return ended_; }  ///< the guest has done all its jobs
  /// The emulator has ended. What the last job waited for, if it said so ("last NAME").
  void machine_ended();
  [[nodiscard]] const std::string& kernel() const { return kernel_; }    ///< "6.1.0-rt-arm64 realtime=1"
  [[nodiscard]] const std::string& running() const { return running_; }  ///< name of the job under way
  [[nodiscard]] int elapsed_s() const { return elapsed_s_; }             ///< of it, virtual
  [[nodiscard]] const std::map<std::string, JobOutcome>& outcomes() const { return outcomes_; }
  [[nodiscard]] const std::vector<std::string>& errors() const { return errors_; }
  /// The last lines, of any kind, long ones cut.
  [[nodiscard]] const std::deque<std::string>& tail() const { return tail_; }

 private:
  void take(std::string_view line);
  void take_result(std::string_view rest);

  std::string partial_, kernel_, running_, last_;
  std::map<std::string, JobOutcome> outcomes_;
  std::vector<std::string> errors_;
  std::deque<std::string> tail_;
  int elapsed_s_ = 0;
  bool ended_ = false;
};

}  // namespace wasp::tools::rt_guest
