// What came of a campaign, for people and for machines.
#pragma once

#include <string>
#include <vector>

#include "faults/campaign.h"

namespace wasp::faults {

std::string table_head();
/// One line, as wide as the head.
std::string table_row(const CellResult& result);
/// Counts by verdict, and every violation with time and bytes.
std::string table_foot(const std::vector<CellResult>& results);
/// The catalogue, a line a fault.
std::string catalogue_list();
std::string to_json(const std::vector<CellResult>& results, const Abilities& abilities);

}  // namespace wasp::faults
