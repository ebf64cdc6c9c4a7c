// The calibrations `wasp calibrate` can do: one row each. A new one is a file pair and a row of calibrations.cpp.
#pragma once

#include <span>

#include "calibration/calibration.h"

namespace wasp::calibration {

std::span<const Calibration> calibrations();

}  // namespace wasp::calibration
