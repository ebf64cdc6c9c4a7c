// Results: one line a figure, as a table or as JSON.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tools/quantiles.h"

namespace wasp::bench {

using tools::Quantiles;
using tools::quantiles;

/// Prints figures as they come and remembers whether every bar was met.
class Report {
 public:
  explicit Report(bool json) : json_(json) {}

  /// Machine, kernel and whatever else a figure's reader must know.
  void note(const std::string& name, const std::string& text);
  void figure(const std::string& name, double value, const std::string& unit, const std::string& remark = {});
  /// A figure that must not exceed `bar`.
  void bar(const std::string& name, double value, const std::string& unit, double bar, const std::string& remark = {});
  /// A figure that must reach `bar`.
  void bar_at_least(const std::string& name, double value, const std::string& unit, double bar,
                    const std::string& remark = {});
  void row(const std::string& name, const Quantiles& q);
  [[nodiscard]] bool met() const { return met_; }

 private:
  void print(const std::string& name, double value, const std::string& unit, std::optional<double> bar, bool ok,
             const std::string& remark);
  bool json_;
  bool met_ = true;
};

}  // namespace wasp::bench
