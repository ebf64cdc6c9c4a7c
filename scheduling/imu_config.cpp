#include "scheduling/imu_config.h"

#include <string>

#include "scheduling/toml_vector.h"

namespace wasp::scheduling {
namespace {

float determinant(const std::array<float, 9>& m) {
  return m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) + m[2] * (m[3] * m[7] - m[4] * m[6]);
}

/// Keys NAME_neutral_UNIT, NAME_matrix, NAME_neutral_per_degc, NAME_at_degc.
void read_sensor(TomlTable& t, const std::string& name, const std::string& unit, double most,
                 drivers::VectorCorrection& c) {
  read_vector(t, (name + "_neutral_" + unit).c_str(), c.neutral, -most, most);
  read_vector(t, (name + "_matrix").c_str(), c.matrix, -5, 5);
  read_vector(t, (name + "_neutral_per_degc").c_str(), c.neutral_per_degc, -most / 50, most / 50);
  t.number((name + "_at_degc").c_str(), c.at_degc, -60, 120);
  const float volume = determinant(c.matrix);
  if (!(volume >= 0.2f && volume <= 5.f)) t.refuse("imu." + name + "_matrix has a determinant outside 0.2 ... 5");
}

}  // namespace

void read_imu(TomlTable t, drivers::ImuCorrection& c) {
  read_sensor(t, "accel", "mps2", 50, c.accel);
  read_sensor(t, "gyro", "radps", 2, c.gyro);
  read_sensor(t, "mag", "gauss", 20, c.mag);
  t.number("pressure_scale", c.pressure_scale, 0.2, 5);
  t.number("pressure_neutral_hpa", c.pressure_neutral_hpa, 300, 1200);
  t.finish();
}

}  // namespace wasp::scheduling
