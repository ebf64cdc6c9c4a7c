// Negative controls: flights that were weakened on purpose, so that the bars can be seen to fail.
#pragma once

#include "faults/campaign.h"

namespace wasp::faults {

/// Flies each control; prints what was expected and what came. 0 when every one came out as MISS.
int run_negative(const CampaignOptions& options, const Abilities& abilities, const CampaignHooks& hooks);

}  // namespace wasp::faults
