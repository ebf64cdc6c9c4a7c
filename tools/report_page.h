// The report as one HTML page that needs no network: style sheet and figures are inside it.
#pragma once

#include <string>

#include "tools/report_data.h"

namespace wasp::tools {

std::string report_page(const ReportData& data);

/// The outcome in plain words, e.g. "All 6 bars met". `good` is false when a bar was missed, empty when none was
/// judged.
struct Outcome {
  std::string text;
  std::optional<bool> good;
};
Outcome outcome_of(const ReportData& data);

/// Style sheet of the page: light and dark, one column on a phone.
const char* report_style();

}  // namespace wasp::tools
