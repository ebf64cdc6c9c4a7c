#include "behaviours.h"

#include "vision/edge_altitude.h"
#include "vision/ground_altitude.h"

namespace wasp {

const scheduling::BehaviourTable& all_behaviours() {
  using scheduling::behaviour_row;
  static const scheduling::BehaviourTable kBehaviours = {
      behaviour_row<vision::GroundAltitude>(),
      behaviour_row<vision::EdgeAltitude>(),
  };
  return kBehaviours;
}

}  // namespace wasp
