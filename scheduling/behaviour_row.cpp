#include "scheduling/behaviour_row.h"

namespace wasp::scheduling {

std::vector<std::string> names_of(const BehaviourTable& table) {
  std::vector<std::string> names;
  for (const auto& row : table) names.push_back(row.name);
  return names;
}

}  // namespace wasp::scheduling
