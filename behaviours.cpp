#include "behaviours.h"

#include "vision/centring.h"
#include "vision/edge_altitude.h"
#include "vision/edge_peak.h"
#include "vision/emd_field.h"
#include "vision/flow_balance.h"
#include "vision/flow_field.h"
#include "vision/ground_altitude.h"
#include "vision/ground_flow.h"
#include "vision/heading_log_polar.h"
#include "vision/heading_rate.h"
#include "vision/landing.h"
#include "vision/obstacle_depth.h"
#include "vision/odometry.h"
#include "vision/optomotor.h"
#include "vision/speed.h"
#include "vision/time_to_contact.h"

namespace wasp {

const scheduling::BehaviourTable& all_behaviours() {
  using scheduling::behaviour_row;
  static const scheduling::BehaviourTable kBehaviours = {
      behaviour_row<vision::GroundAltitude>(),
      behaviour_row<vision::EdgeAltitude>(),
      behaviour_row<vision::FlowFieldFront>(),
      behaviour_row<vision::FlowFieldDown>(),
      behaviour_row<vision::Odometry>(),
      behaviour_row<vision::TimeToContactFront>(),
      behaviour_row<vision::ObstacleDepth>(),
      behaviour_row<vision::FlowBalance>(),
      behaviour_row<vision::EdgePeak>(),
      behaviour_row<vision::HeadingRateDown>(),
      behaviour_row<vision::HeadingLogPolarDown>(),
      behaviour_row<vision::Optomotor>(),
      behaviour_row<vision::Centring>(),
      behaviour_row<vision::Speed>(),
      behaviour_row<vision::Landing>(),
      behaviour_row<vision::EmdFlow>(),
      behaviour_row<vision::GroundFlow>(),
  };
  return kBehaviours;
}

}  // namespace wasp
