// A three-axis sensor of known faults, and tables of what it reads, for tests.
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "sim/random.h"

namespace wasp::test {

/// reads = inverse(K) * truth + neutral + slope * (T - 25) + noise
struct FaultySensor {
  Eigen::Matrix3d K = Eigen::Matrix3d::Identity();
  Eigen::Vector3d neutral = Eigen::Vector3d::Zero();
  double noise = 0;
  Eigen::Vector3d slope = Eigen::Vector3d::Zero();  ///< last, to be left out: Eigen leaves a vector from {} undefined

  [[nodiscard]] Eigen::Vector3d read(const Eigen::Vector3d& truth, sim::Random& random, double degc = 25) const {
    return K.inverse() * truth + neutral + slope * (degc - 25) +
           noise * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
  }
};

inline Eigen::Matrix3d symmetric(double xx, double yy, double zz, double xy, double xz, double yz) {
  Eigen::Matrix3d m;
  m << xx, xy, xz, xy, yy, yz, xz, yz, zz;
  return m;
}

inline Eigen::Vector3d random_direction(sim::Random& random) {
  Eigen::Vector3d v(random.normal(), random.normal(), random.normal());
  return v.normalized();
}

/// A CSV being filled.
struct Table {
  explicit Table(std::filesystem::path file, const std::string& names) : path(std::move(file)), out(path) {
    out.precision(17);
    out << names << "\n";
  }
  void row(const std::vector<double>& values) {
    for (std::size_t i = 0; i < values.size(); ++i) out << (i > 0 ? "," : "") << values[i];
    out << "\n";
  }
  void close() { out.close(); }
  std::filesystem::path path;
  std::ofstream out;
};

}  // namespace wasp::test
