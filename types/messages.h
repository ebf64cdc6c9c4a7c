// Everything that travels through a ring: plain structs with fixed layout and `exposed_at_ns`, the instant of the
// evidence they rest on, so that latency is a subtraction at any stage. Vectors end in frame, then unit.
#pragma once

#include <array>
#include <cstdint>
#include <type_traits>

#include "types/time.h"

namespace wasp {

enum class PixelFormat : std::uint32_t { kNone = 0, kMono8 = 1, kDepth16Mm = 2 };

/// Head of a frame slot; the pixels follow at `kFramePixelOffset`.
struct FrameHeader {
  TimeNs exposed_at_ns = 0;    ///< mid-exposure where the driver can know it
  std::uint32_t sequence = 0;  ///< the camera's own count; a gap is a dropped frame
  PixelFormat format = PixelFormat::kNone;
  std::uint32_t width_px = 0, height_px = 0, stride_bytes = 0;
  std::uint32_t reserved[7] = {};
};
inline constexpr std::size_t kFramePixelOffset = 64;
static_assert(sizeof(FrameHeader) <= kFramePixelOffset);

/// One inertial sample, 64 bytes. Body FRD; accelerometer reads specific force (level at rest: 0, 0, -9.81).
struct ImuSample {
  TimeNs exposed_at_ns = 0;
  std::array<float, 3> accel_body_mps2{};
  std::array<float, 3> gyro_body_radps{};
  std::array<float, 3> mag_body_gauss{};
  float pressure_hpa = 0;
  float temperature_degc = 0;
  std::uint32_t sequence = 0;
  std::uint32_t fields = 0;  ///< HIGHRES_IMU fields_updated
  std::uint32_t reserved = 0;
};
static_assert(sizeof(ImuSample) == 64);
inline constexpr std::uint32_t kImuHasPressure = 0x200;  ///< bit of ImuSample::fields: abs_pressure

/// Attitude as the autopilot estimates it, 64 bytes.
struct AttitudeSample {
  TimeNs exposed_at_ns = 0;
  std::array<float, 4> q_ned_body{1, 0, 0, 0};  ///< w x y z, body FRD to NED
  std::array<float, 3> rate_body_radps{};
  std::uint32_t sequence = 0;
  std::uint32_t reserved[6] = {};
};
static_assert(sizeof(AttitudeSample) == 64);

enum class Validity : std::uint8_t { kBlind = 0, kValid = 1 };

/// What a behaviour says after one frame. Fields a behaviour does not speak of stay NaN-free at zero with their bit
/// clear.
struct CueBody {
  Validity validity = Validity::kBlind;
  std::uint8_t has_height = 0, has_heading_rate = 0, has_pitch = 0, avoid = 0;
  std::uint8_t has_velocity = 0, has_climb = 0;
  std::uint8_t reserved[1] = {};
  float quality = 0;             ///< 0 ... 1
  float height_m = 0;            ///< above the ground, along the world vertical
  float height_sigma_m = 0;      ///< one standard deviation
  float heading_rate_radps = 0;  ///< wish: clockwise seen from above
  float pitch_rad = 0;           ///< wish: nose up, so forward is negative
  /// Measured over ground, along the heading and to its right, level [m/s].
  float velocity_forward_mps = 0, velocity_right_mps = 0;
  float velocity_sigma_mps = 0;  ///< one standard deviation of each
  float climb_mps = 0;           ///< wish: climb at climb_mps + climb_1ps * height
  float climb_1ps = 0;
  std::array<float, 8> detail{};  ///< behaviour-specific, named in its header; for logs and figures only
};

/// A cue in its ring: the body, the inputs that made it, and the three parts of its latency.
struct Cue {
  TimeNs exposed_at_ns = 0;     ///< of the frame it was computed from
  TimeNs released_at_ns = 0;    ///< frame published
  TimeNs started_at_ns = 0;     ///< behaviour thread running
  TimeNs finished_at_ns = 0;    ///< step returned
  std::uint32_t behaviour = 0;  ///< index in the behaviour list of this process
  std::uint32_t frame_sequence = 0;
  std::uint32_t step_index = 0;  ///< counts this behaviour's steps since start
  std::uint32_t attitude_valid = 0;
  std::array<float, 4> q_ned_body{1, 0, 0, 0};  ///< attitude the step was given
  std::array<float, 3> rate_body_radps{};       ///< and its rates
  std::array<float, 3> accel_body_mps2{};       ///< specific force the step was given
  std::uint32_t accel_valid = 0;
  std::uint32_t over_budget = 0;
  CueBody body;
};

/// Flight modes, in rising order of authority to act; the table is control/flight_mode.h.
enum class FlightMode : std::uint8_t { kDisarmed = 0, kHold = 1, kBehaviour = 2, kManual = 3, kFailsafe = 4 };

/// Why the flight mode is what it is (the latest transition).
enum class ModeReason : std::uint8_t {
  kNone = 0,
  kStart,
  kMissionStep,
  kCueLost,
  kCueBack,
  kAttitudeLost,
  kAttitudeBack,
  kLinkLost,
  kLinkBack,
  kPilot,
  kNotFinite,
  kAutopilotLeft,
  kDeadlineMissed,
  kStopRequested,
  kLanded,
  kTooOld,
  kRestarted,
};

/// One control tick: what was commanded and how long it took.
struct Command {
  TimeNs exposed_at_ns = kNever;  ///< of the evidence used; kNever when none was
  TimeNs due_at_ns = 0;           ///< intended release on the grid
  TimeNs released_at_ns = 0;      ///< thread running
  TimeNs computed_at_ns = 0;
  TimeNs written_at_ns = 0;  ///< last byte handed to the tty; 0 if not all of it was
  std::uint64_t tick = 0;    ///< index on the grid; a jump by n+1 means n skipped releases
  std::array<float, 4> q_ned_body{1, 0, 0, 0};
  float yaw_rate_radps = 0;
  float thrust = 0;  ///< 0 ... 1 of full collective
  float height_setpoint_m = 0;
  float height_m = 0;  ///< control's own filtered estimate
  float climb_rate_mps = 0;
  float velocity_forward_mps = 0, velocity_right_mps = 0;  ///< as used; 0 when nobody measures it
  std::int32_t cue_source = -1;                            ///< behaviour index whose height was used, -1 none
  FlightMode mode = FlightMode::kDisarmed;
  ModeReason reason = ModeReason::kNone;
  std::uint8_t sent = 0;
  std::uint8_t mission_phase = 0;
  std::uint8_t refused = 0;  ///< control::Refusal: why the arbiter's own command did not go out
  std::uint8_t avoid = 0;    ///< a behaviour raised avoid at this tick
  std::uint8_t velocity_held = 0;
  std::uint8_t reserved[1] = {};
};

/// The simulator's own truth; no flight thread reads it.
struct Truth {
  TimeNs exposed_at_ns = 0;
  std::array<float, 3> position_ned_m{};
  std::array<float, 3> velocity_ned_mps{};
  std::array<float, 4> q_ned_body{1, 0, 0, 0};
  std::array<float, 3> rate_body_radps{};
  float height_m = 0;  ///< of the camera above the plane z = 0 of the world, whatever is below it
  float armed = 0;
  float flight_time_s = 0;  ///< since the vehicle first left the ground, 0 before; what moves in the world moves by it
};

static_assert(sizeof(Cue) % 8 == 0 && sizeof(Command) % 8 == 0 && sizeof(Truth) % 8 == 0);
static_assert(std::is_trivially_copyable_v<Cue> && std::is_trivially_copyable_v<Command>);
static_assert(std::is_trivially_copyable_v<ImuSample> && std::is_trivially_copyable_v<Truth>);

}  // namespace wasp
