// Raw readings of a Kinect at known distances: from a table, or from depth images of a wall it looks straight at.
#pragma once

#include <string>
#include <vector>

#include "calibration/kinect_depth_fit.h"

namespace wasp::calibration {

struct KinectReadings {
  std::vector<KinectPoint> points;   ///< one a distance (within 1 cm), the median of its readings; rising
  std::size_t readings = 0;          ///< rows or images
  std::vector<std::string> skipped;  ///< rows and images of no use, and why
};

/// `table`: CSV with the columns raw and distance_m, or file (an image beside the table, 16-bit PNG or PGM, either byte
/// order: fakenect writes its own) and distance_m. Of an image the middle `part` of width and height counts. Throws
/// std::runtime_error naming the table, its line and what is wrong with its columns.
KinectReadings read_kinect_readings(const std::string& table, double part);

}  // namespace wasp::calibration
