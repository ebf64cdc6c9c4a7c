#include "benchmarks/report.h"

#include <cstdio>
#include <nlohmann/json.hpp>

namespace wasp::bench {

void Report::note(const std::string& name, const std::string& text) {
  if (json_)
    std::printf("%s\n", nlohmann::json{{"name", name}, {"text", text}, {"ok", true}}.dump().c_str());
  else
    std::printf("%-34s %s\n", name.c_str(), text.c_str());
  std::fflush(stdout);
}

void Report::print(const std::string& name, double value, const std::string& unit, std::optional<double> bar, bool ok,
                   const std::string& remark) {
  met_ = met_ && ok;
  if (json_) {
    nlohmann::json line{{"name", name}, {"value", value}, {"unit", unit}, {"bar", nullptr}, {"ok", ok}};
    if (bar) line["bar"] = *bar;
    if (!remark.empty()) line["remark"] = remark;
    std::printf("%s\n", line.dump().c_str());
  } else {
    std::printf("%-34s %12.3f %-6s", name.c_str(), value, unit.c_str());
    if (bar) std::printf(" bar %.2f %s", *bar, ok ? "met" : "MISSED");
    std::printf("%s%s\n", remark.empty() ? "" : "  ", remark.c_str());
  }
  std::fflush(stdout);
}

void Report::figure(const std::string& name, double value, const std::string& unit, const std::string& remark) {
  print(name, value, unit, std::nullopt, true, remark);
}
void Report::bar(const std::string& name, double value, const std::string& unit, double bar,
                 const std::string& remark) {
  print(name, value, unit, bar, value <= bar, remark);
}
void Report::bar_at_least(const std::string& name, double value, const std::string& unit, double bar,
                          const std::string& remark) {
  print(name, value, unit, bar, value >= bar, remark);
}

void Report::row(const std::string& name, const Quantiles& q) {
  if (json_) {
    figure(name + ".p50", q.p50, "ns");
    figure(name + ".p99", q.p99, "ns");
    figure(name + ".p999", q.p999, "ns");
    figure(name + ".max", q.max, "ns");
    figure(name + ".count", static_cast<double>(q.count), "1");
  } else {
    std::printf("%-34s p50 %8.0f  p99 %8.0f  p99.9 %9.0f  max %9.0f ns  n %zu\n", name.c_str(), q.p50, q.p99, q.p999,
                q.max, q.count);
    std::fflush(stdout);
  }
}

}  // namespace wasp::bench
