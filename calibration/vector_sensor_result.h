// An ellipsoid as a solution: keys for the flight, evidence, pictures.
#pragma once

#include "calibration/calibrate_vector_sensor.h"

namespace wasp::calibration {

/// Half of the widest axis' range without its outermost fiftieths [sample unit].
double half_range(const std::vector<Eigen::Vector3d>& values);

Solution vector_sensor_solution(const VectorSensor& sensor, const Samples& samples,
                                const std::vector<EllipsoidSample>& points, const Ellipsoid& ellipsoid);

}  // namespace wasp::calibration
