// What a ground station may read of wasp: the configuration that flies, by the names of docs/services.md. Rates of
// telemetry may be set; everything else is fixed once the flight has begun.
#pragma once

#include "drivers/parameter_server.h"
#include "scheduling/config.h"

namespace wasp::scheduling {

/// Names of the rates, which PARAM_SET may change.
inline constexpr const char *kObstacleRate = "TLM_OBST_HZ", *kFlowRate = "TLM_FLOW_HZ", *kComputerRate = "TLM_COMP_HZ",
                            *kNamedRate = "TLM_NAMED_HZ";

drivers::ParameterServer parameter_table(const Config& config);

}  // namespace wasp::scheduling
