// Frames written by another implementation (pymavlink), byte for byte, both ways.
#include <gtest/gtest.h>

#include <cstring>
#include <numeric>

#include "messages/checksum.h"
#include "messages/mavlink_frame.h"
#include "tests/messages/hex.h"

namespace wasp::mavlink {
namespace {

using test::from_hex;
using test::to_hex;

template <std::size_t N>
std::array<char, N> chars(std::string_view text) {
  std::array<char, N> out{};
  std::copy(text.begin(), text.end(), out.begin());
  return out;
}

template <class M>
std::vector<std::uint8_t> packed(const M& message) {
  std::vector<std::uint8_t> payload(M::kMaxLength);
  message.pack(payload.data());
  return payload;
}

/// `message` encodes to `hex` and `hex` decodes to `message`.
template <class M>
void expect_vector(std::uint8_t sequence, const M& message, std::string_view hex) {
  Encoder encoder(1, 191);
  encoder.set_sequence(sequence);
  std::array<std::uint8_t, kMaxFrame> out{};
  const std::size_t n = encoder.encode(message, out);
  EXPECT_EQ(to_hex({out.data(), n}), hex) << M::kName;
  EXPECT_EQ(encoder.encode(message, std::span(out).first(n - 1)), 0u) << "one byte too few";

  int frames = 0;
  Parser parser;
  parser.feed(from_hex(hex), [&](const Frame& frame) noexcept {
    ++frames;
    EXPECT_TRUE(frame.is<M>());
    EXPECT_EQ(frame.version, 2);
    EXPECT_EQ(frame.sequence, sequence);
    EXPECT_EQ(frame.system_id, 1);
    EXPECT_EQ(frame.component_id, 191);
    EXPECT_FALSE(frame.is_signed);
    EXPECT_EQ(packed(frame.as<M>()), packed(message)) << M::kName;
  });
  EXPECT_EQ(frames, 1) << M::kName;
}

TEST(Checksum, HasThePublishedCheckValue) {
  std::array<std::uint8_t, 9> digits{};
  std::memcpy(digits.data(), "123456789", 9);
  EXPECT_EQ(crc_add(kCrcInitial, digits), 0x6F91);
}

TEST(Checksum, CrcExtraOfTheWorkedExample) {
  const std::string_view text =
      "HEARTBEAT uint32_t custom_mode uint8_t type uint8_t autopilot uint8_t base_mode uint8_t system_status uint8_t "
      "mavlink_version ";
  std::uint16_t crc = kCrcInitial;
  for (const char c : text) crc = crc_add(crc, static_cast<std::uint8_t>(c));
  EXPECT_EQ(crc, 11294);
  EXPECT_EQ((crc & 0xFF) ^ (crc >> 8), Heartbeat::kCrcExtra);
}

Heartbeat onboard_heartbeat() {
  Heartbeat m;
  m.type = mav_type::kOnboardController;
  m.autopilot = mav_autopilot::kInvalid;
  m.system_status = mav_state::kActive;
  m.mavlink_version = 3;
  return m;
}

TEST(Vectors, Heartbeat) { expect_vector(0, onboard_heartbeat(), "fd0900000001bf000000000000001208000403aec6"); }

TEST(Vectors, SetAttitudeTarget) {
  SetAttitudeTarget m;
  m.time_boot_ms = 1234;
  m.target_system = m.target_component = 1;
  m.type_mask = 7;
  m.q = {1, 0, 0, 0};
  m.thrust = 0.5f;
  expect_vector(5, m,
                "fd2700000501bf520000d20400000000803f0000000000000000000000000000000000000000000000000000003f010107580"
                "5");
}

TEST(Vectors, TimesyncRequest) {
  Timesync m;
  m.ts1 = 123456789;
  expect_vector(1, m, "fd0c00000101bf6f0000000000000000000015cd5b0759c7");
}

TEST(Vectors, Statustext) {
  Statustext m;
  m.severity = mav_severity::kInfo;
  m.text = chars<50>("wasp ready");
  expect_vector(2, m, "fd0b00000201bffd00000677617370207265616479c3db");
}

TEST(Vectors, AllZeroPayloadIsOneByte) { expect_vector(3, Ping{}, "fd0100000301bf04000000bf5e"); }

TEST(Vectors, OpticalFlowRad) {
  OpticalFlowRad m;
  m.time_usec = 1000000;
  m.integration_time_us = 50000;
  m.integrated_x = 0.01f;
  m.integrated_y = -0.02f;
  m.integrated_xgyro = 0.003f;
  m.integrated_ygyro = -0.004f;
  m.integrated_zgyro = 0.005f;
  m.quality = 200;
  m.distance = 1.5f;
  expect_vector(4, m,
                "fd2c00000401bf6a000040420f000000000050c300000ad7233c0ad7a3bca69b443b6f1283bb0ad7a33b000000000000c03f0"
                "00000c848ba");
}

TEST(Vectors, AttitudeQuaternion) {
  AttitudeQuaternion m;
  m.time_boot_ms = 1000;
  m.q1 = m.q2 = m.q4 = 0.5f;
  m.q3 = -0.5f;
  m.rollspeed = 0.1f;
  m.pitchspeed = 0.2f;
  m.yawspeed = -0.3f;
  expect_vector(6, m, "fd2000000601bf1f0000e80300000000003f0000003f000000bf0000003fcdcccc3dcdcc4c3e9a9999be444b");
}

TEST(Vectors, HighresImu) {
  HighresImu m;
  m.time_usec = 2000000;
  m.xacc = 0.25f;
  m.yacc = -0.5f;
  m.zacc = -9.75f;
  m.xgyro = 0.125f;
  m.zgyro = -0.125f;
  m.xmag = 0.5f;
  m.ymag = 0.25f;
  m.abs_pressure = 1013.25f;
  m.pressure_alt = 100.5f;
  m.temperature = 25;
  m.fields_updated = 0x3f;
  expect_vector(7, m,
                "fd3d00000701bf69000080841e00000000000000803e000000bf00001cc10000003e00000000000000be0000003f0000803e0"
                "000000000507d44000000000000c9420000c8413f253f");
}

TEST(Vectors, ObstacleDistance) {
  ObstacleDistance m;
  m.time_usec = 3000000;
  m.sensor_type = mav_distance_sensor::kUnknown;
  m.distances.fill(65535);
  m.distances[0] = 100;
  m.distances[1] = 200;
  m.increment = 5;
  m.min_distance = 20;
  m.max_distance = 1000;
  m.increment_f = 2.5f;
  m.angle_offset = -90;
  m.frame = mav_frame::kBodyFrd;
  expect_vector(
      8, m,
      "fda700000801bf4a0100c0c62d00000000006400c800" + std::string(280, 'f') + "1400e8030405000020400000b4c20c59de");
}

TEST(Vectors, CommandLongAndAck) {
  CommandLong arm;
  arm.target_system = arm.target_component = 1;
  arm.command = mav_cmd::kComponentArmDisarm;
  arm.param1 = 1;
  expect_vector(10, arm, "fd2000000a01bf4c00000000803f000000000000000000000000000000000000000000000000900101010a83");
  CommandAck ack;
  ack.command = mav_cmd::kComponentArmDisarm;
  expect_vector(11, ack, "fd0200000b01bf4d000090011b27");
}

TEST(Vectors, ParamValue) {
  ParamValue m;
  m.param_value = 20;
  m.param_id = chars<16>("WASP_RATE_HZ");
  m.param_type = mav_param_type::kReal32;
  m.param_count = 3;
  m.param_index = 1;
  expect_vector(12, m, "fd1900000c01bf1600000000a04103000100574153505f524154455f485a00000000095318");
}

TEST(Vectors, NamedValues) {
  NamedValueFloat tau;
  tau.time_boot_ms = 5000;
  tau.name = chars<10>("tau");
  tau.value = 1.5f;
  expect_vector(13, tau, "fd0b00000d01bffb0000881300000000c03f7461755c12");
  DebugVect foe;
  foe.name = chars<10>("foe");
  foe.time_usec = 6000000;
  foe.x = 1;
  foe.y = -1;
  foe.z = 0.5f;
  expect_vector(14, foe, "fd1700000e01bffa0000808d5b00000000000000803f000080bf0000003f666f65b17c");
}

TEST(Vectors, HilActuatorControls) {
  HilActuatorControls m;
  m.time_usec = 7000000;
  for (std::size_t motor = 0; motor < 4; ++motor) m.controls[motor] = 0.5f;
  m.mode = 129;
  m.flags = 1;
  expect_vector(15, m,
                "fd5100000f01bf5d0000c0cf6a000000000001000000000000000000003f0000003f0000003f0000003f" +
                    std::string(96, '0') + "8192b9");
}

TEST(Vectors, DistanceSensor) {
  DistanceSensor m;
  m.time_boot_ms = 8000;
  m.min_distance = 10;
  m.max_distance = 500;
  m.current_distance = 123;
  m.type = mav_distance_sensor::kUnknown;
  m.orientation = 25;
  m.covariance = 255;
  expect_vector(16, m, "fd0e00001001bf840000401f00000a00f4017b00040019ff2e50");
}

/// Key bytes 00 ... 1f; link 3, timestamp 0x112233445566.
TEST(Vectors, SignedHeartbeat) {
  const std::string hex = "fd0901000901bf0000000000000012080004039de0036655443322115145f78df360";
  SigningKey key;
  std::iota(key.bytes.begin(), key.bytes.end(), std::uint8_t{0});
  SigningClock clock(0x112233445566);
  std::array<std::uint8_t, kMaxFrame> out{};
  FrameSigner signer(key, clock, 3);
  Encoder encoder(1, 191);
  encoder.sign_with(signer);
  encoder.set_sequence(9);
  const std::size_t n = encoder.encode(onboard_heartbeat(), out);
  EXPECT_EQ(to_hex({out.data(), n}), hex);

  SigningClock receiver(0x112233445566);
  SignatureCheck check(key, receiver, true);
  Parser parser;
  parser.check_signatures(check);
  parser.feed(from_hex(hex), [&](const Frame& frame) noexcept {
    EXPECT_TRUE(frame.is_signed);
    EXPECT_TRUE(frame.is_verified);
    EXPECT_EQ(to_hex(frame.signature), "036655443322115145f78df360");
    EXPECT_EQ(to_hex(frame.wire), hex);
    EXPECT_EQ(frame.as<Heartbeat>().type, mav_type::kOnboardController);
  });
  EXPECT_EQ(parser.counts().signed_frames, 1u);
  EXPECT_EQ(check.counts().verified, 1u);
}

}  // namespace
}  // namespace wasp::mavlink
