// The flow field (types/flow_field.h) under the name the kernels use.
#pragma once

#include "types/flow_field.h"

namespace wasp::vision {

using wasp::FlowCell;
using wasp::FlowField;

}  // namespace wasp::vision
