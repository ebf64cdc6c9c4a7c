// The whole run as JSON: what was asked, every figure that came back, every bar.
#pragma once

#include <filesystem>
#include <vector>

#include "tools/result.h"
#include "tools/rt_guest/console.h"
#include "tools/rt_guest/plan.h"

namespace wasp::tools::rt_guest {

nlohmann::json report_json(const Plan& plan, const std::string& kernel_package, const Console& console,
                           const std::vector<Result>& results);

}  // namespace wasp::tools::rt_guest
