// The "wasp" quadrotors in numbers, the Kontron Kinect one by default (thesis table A.4, appendix B): mass, inertia,
// rotors, legs. Inertia is the sum of the rows of table B.2(a), whose printed totals are not their sums, plus a box for
// the Kinect. Frames: body FRD. Rotors in plus configuration, numbered front 0, right 1, back 2, left 3 (thesis 1 ...
// 4).
#pragma once

#include <array>
#include <cmath>
#include <numbers>

namespace wasp::sim {

/// One row of table B.2: moments of inertia about the centre of mass [kg m^2].
struct InertiaRow {
  double xx = 0, yy = 0, zz = 0;
};

/// Table B.2(a), 'wasp' Kontron, row by row. Table B.2(b), 'wasp' Gumstix, differs in the second row only.
inline constexpr std::array<InertiaRow, 9> kKontronRows{{
    {2.93e-4, 2.93e-4, 6.00e-5},  // onboard electronics
    {4.36e-3, 4.36e-3, 6.67e-4},  // single board computer
    {7.93e-5, 5.07e-4, 5.15e-4},  // battery
    {7.92e-6, 2.61e-4, 2.53e-4},  // cross-frame part 1
    {2.61e-4, 7.92e-6, 2.53e-4},  // cross-frame part 2
    {2.76e-5, 1.95e-3, 1.93e-3},  // motors 1 ... 4
    {1.95e-3, 2.76e-5, 1.93e-3},
    {2.76e-5, 1.95e-3, 1.93e-3},
    {1.95e-3, 2.76e-5, 1.93e-3},
}};

inline constexpr InertiaRow kGumstixComputerRow{1.01e-3, 1.05e-3, 6.67e-4};

/// B.2.2: a box of length l (x), width w (y), height h (z) [m] whose centre lies `below` [m] under the centre of mass.
constexpr InertiaRow box_inertia(double mass_kg, double l, double w, double h, double below) {
  return {mass_kg * (w * w / 12 + h * h / 12 + below * below), mass_kg * (l * l / 12 + h * h / 12 + below * below),
          mass_kg * (l * l / 12 + w * w / 12)};
}

/// The Kinect and its mount: all the mass that the Kontron Kinect vehicle has more than the Kontron one (table A.4);
/// size of the Kinect's body, slung 8 cm below the centre of mass (our estimate; the thesis gives none).
inline constexpr InertiaRow kKinectRow = box_inertia(1.925 - 1.230, 0.065, 0.28, 0.04, 0.08);

/// Sum of a payload's row and those of table B.2 [kg m^2].
constexpr InertiaRow total_inertia(const InertiaRow& payload, const InertiaRow& computer) {
  InertiaRow sum = payload;
  for (std::size_t i = 0; i < kKontronRows.size(); ++i) {
    const InertiaRow& row = i == 1 ? computer : kKontronRows[i];
    sum = {sum.xx + row.xx, sum.yy + row.yy, sum.zz + row.zz};
  }
  return sum;
}
/// The Kontron Kinect vehicle.
constexpr InertiaRow total_inertia() { return total_inertia(kKinectRow, kKontronRows[1]); }

/// Motor and propeller. Speed from voltage is (B.5); thrust b w^2, drag torque d w^2.
///
/// The thesis' figures for b and d did not survive. Full speed follows from 5.6 N and the static thrust coefficient of
/// a small slow-flyer propeller, d from its power coefficient: C_T = 0.1099, C_P = 0.0402, UIUC Propeller Data Site
/// (Brandt, Selig et al., vol. 1), GWS 9x5 at 6400 rpm as adopted in AirSim's RotorParams; the nearest published pair
/// to the 10x4.5 of the vehicle that we could check. R is the resistance that makes 11.4 V just hold full speed.
struct RotorParams {
  double diameter_m = 0.254;
  double max_thrust_N = 5.6;  ///< thesis A.2.3
  double thrust_coefficient = 0.1099;
  double power_coefficient = 0.0402;
  double air_density_kgpm3 = 1.225;
  double supply_V = 11.4;
  double motor_constant = 60.0 / (2.0 * std::numbers::pi * 1000.0);  ///< K_m: 1000 rpm/V, in V s and N m/A
  /// B.2.1: a flat plate of 10 g, 0.254 m x 0.025 m, and a bell of 30 g, radius 14 mm (typical parts) [kg m^2].
  double inertia_kgm2 = 0.010 * (0.254 * 0.254 + 0.025 * 0.025) / 12 + 0.030 * 0.014 * 0.014 / 2;
  double regulator_s = 0.05;  ///< closed-loop time constant of the speed controller while it does not saturate

  [[nodiscard]] double max_speed_radps() const {
    const double d2 = diameter_m * diameter_m;
    return 2 * std::numbers::pi * std::sqrt(max_thrust_N / (thrust_coefficient * air_density_kgpm3 * d2 * d2));
  }
  [[nodiscard]] double b() const { return max_thrust_N / (max_speed_radps() * max_speed_radps()); }  ///< [N s^2]
  /// C_Q = C_P / 2 pi, so d / b = D C_P / (2 pi C_T) [N m s^2].
  [[nodiscard]] double d() const {
    return b() * diameter_m * power_coefficient / (2 * std::numbers::pi * thrust_coefficient);
  }
  [[nodiscard]] double resistance_ohm() const {
    const double w = max_speed_radps();
    return (supply_V - motor_constant * w) * motor_constant / (d() * w * w);
  }
};

struct VehicleParams {
  double mass_kg = 1.925;
  InertiaRow inertia_kgm2 = total_inertia();
  double arm_m = 0.185;  ///< l, centre to rotor
  double gravity_mps2 = 9.81;
  double drag_Npmps = 0.25;     ///< linear aerodynamic drag of frame and rotor discs (our estimate)
  double leg_m = 0.20;          ///< centre of mass above the floor when standing
  double foot_spread_m = 0.13;  ///< feet at (+-, +-) this from the centre
  RotorParams rotor;

  [[nodiscard]] double max_collective_N() const { return 4 * rotor.max_thrust_N; }
  /// Share of full collective that carries the weight, 0 ... 1.
  [[nodiscard]] double hover_thrust() const { return mass_kg * gravity_mps2 / max_collective_N(); }
};

/// One column of table A.4: weight and where the camera looks.
struct VehiclePreset {
  const char* name;
  double mass_kg;
  InertiaRow inertia_kgm2;
  double camera_pitch_down_deg, camera_forward_m, camera_below_m;

  [[nodiscard]] VehicleParams params() const {
    VehicleParams p;
    p.mass_kg = mass_kg;
    p.inertia_kgm2 = inertia_kgm2;
    return p;
  }
};

/// The first is the default.
inline constexpr std::array<VehiclePreset, 3> kVehiclePresets{{
    {"kontron_kinect", 1.925, total_inertia(), 30, 0.05, 0},
    {"kontron", 1.230, total_inertia({}, kKontronRows[1]), 0, 0.05, 0},
    {"gumstix", 0.700, total_inertia({}, kGumstixComputerRow), 90, 0, 0.05},
}};

}  // namespace wasp::sim
