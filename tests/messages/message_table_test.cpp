// The generated message set against the published table: id, name, CRC_EXTRA, base length, full length.
#include <gtest/gtest.h>

#include <random>
#include <string>

#include "messages/mavlink_frame.h"

namespace wasp::mavlink {
namespace {

constexpr MessageInfo kPublished[] = {
    {0, "HEARTBEAT", 50, 9, 9},
    {1, "SYS_STATUS", 124, 31, 43},
    {2, "SYSTEM_TIME", 137, 12, 12},
    {4, "PING", 237, 14, 14},
    {20, "PARAM_REQUEST_READ", 214, 20, 20},
    {21, "PARAM_REQUEST_LIST", 159, 2, 2},
    {22, "PARAM_VALUE", 220, 25, 25},
    {23, "PARAM_SET", 168, 23, 23},
    {26, "SCALED_IMU", 170, 22, 24},
    {27, "RAW_IMU", 144, 26, 29},
    {29, "SCALED_PRESSURE", 115, 14, 16},
    {30, "ATTITUDE", 39, 28, 28},
    {31, "ATTITUDE_QUATERNION", 246, 32, 48},
    {32, "LOCAL_POSITION_NED", 185, 28, 28},
    {65, "RC_CHANNELS", 118, 42, 42},
    {66, "REQUEST_DATA_STREAM", 148, 6, 6},
    {69, "MANUAL_CONTROL", 243, 11, 30},
    {70, "RC_CHANNELS_OVERRIDE", 124, 18, 38},
    {74, "VFR_HUD", 20, 20, 20},
    {75, "COMMAND_INT", 158, 35, 35},
    {76, "COMMAND_LONG", 152, 33, 33},
    {77, "COMMAND_ACK", 143, 3, 10},
    {82, "SET_ATTITUDE_TARGET", 49, 39, 51},
    {83, "ATTITUDE_TARGET", 22, 37, 37},
    {84, "SET_POSITION_TARGET_LOCAL_NED", 143, 53, 53},
    {85, "POSITION_TARGET_LOCAL_NED", 140, 51, 51},
    {93, "HIL_ACTUATOR_CONTROLS", 47, 81, 81},
    {100, "OPTICAL_FLOW", 175, 26, 34},
    {102, "VISION_POSITION_ESTIMATE", 158, 32, 117},
    {103, "VISION_SPEED_ESTIMATE", 208, 20, 57},
    {105, "HIGHRES_IMU", 93, 62, 63},
    {106, "OPTICAL_FLOW_RAD", 138, 44, 44},
    {107, "HIL_SENSOR", 108, 64, 65},
    {111, "TIMESYNC", 34, 16, 18},
    {113, "HIL_GPS", 124, 36, 39},
    {114, "HIL_OPTICAL_FLOW", 237, 44, 44},
    {115, "HIL_STATE_QUATERNION", 4, 64, 64},
    {132, "DISTANCE_SENSOR", 85, 14, 39},
    {141, "ALTITUDE", 47, 32, 32},
    {147, "BATTERY_STATUS", 154, 36, 54},
    {148, "AUTOPILOT_VERSION", 178, 60, 78},
    {230, "ESTIMATOR_STATUS", 163, 42, 42},
    {244, "MESSAGE_INTERVAL", 95, 6, 6},
    {245, "EXTENDED_SYS_STATE", 130, 2, 2},
    {250, "DEBUG_VECT", 49, 30, 30},
    {251, "NAMED_VALUE_FLOAT", 170, 18, 18},
    {252, "NAMED_VALUE_INT", 44, 18, 18},
    {253, "STATUSTEXT", 83, 51, 54},
    {254, "DEBUG", 46, 9, 9},
    {256, "SETUP_SIGNING", 71, 42, 42},
    {330, "OBSTACLE_DISTANCE", 23, 158, 167},
    {331, "ODOMETRY", 91, 230, 233},
    {350, "DEBUG_FLOAT_ARRAY", 232, 20, 252},
    {390, "ONBOARD_COMPUTER_STATUS", 156, 238, 240},
    {435, "AVAILABLE_MODES", 134, 46, 46},
    {436, "CURRENT_MODE", 193, 9, 9},
    // and of messages that the spec leaves out, from the headers of mavlink/c_library_v2
    {11, "SET_MODE", 89, 6, 6},
    {24, "GPS_RAW_INT", 24, 30, 52},
    {33, "GLOBAL_POSITION_INT", 104, 28, 28},
    {36, "SERVO_OUTPUT_RAW", 222, 21, 37},
    {48, "SET_GPS_GLOBAL_ORIGIN", 41, 13, 21},
    {110, "FILE_TRANSFER_PROTOCOL", 84, 254, 254},
    {300, "PROTOCOL_VERSION", 217, 22, 22},
    {345, "PARAM_ERROR", 209, 21, 21},
};

TEST(MessageTable, AgreesWithThePublishedOne) {
  for (const MessageInfo& want : kPublished) {
    const MessageInfo* got = find_message(want.id);
    ASSERT_NE(got, nullptr) << want.name;
    EXPECT_STREQ(got->name, want.name);
    EXPECT_EQ(got->crc_extra, want.crc_extra) << want.name;
    EXPECT_EQ(got->min_length, want.min_length) << want.name;
    EXPECT_EQ(got->max_length, want.max_length) << want.name;
  }
}

TEST(MessageTable, KnowsNoOtherId) {
  std::size_t known = 0;
  for (std::uint32_t id = 0; id < 100'000; ++id) known += find_message(id) != nullptr ? 1 : 0;
  EXPECT_EQ(known, kMessages.size());
  EXPECT_EQ(find_message(0xFFFFFF), nullptr);
}

TEST(MessageTable, RisesInIdAndFitsAFrame) {
  for (std::size_t i = 1; i < kMessages.size(); ++i) EXPECT_LT(kMessages[i - 1].id, kMessages[i].id);
  for (const MessageInfo& info : kMessages) {
    EXPECT_GE(info.max_length, info.min_length) << info.name;
    EXPECT_LE(info.max_length, kMaxPayload) << info.name;
  }
}

TEST(MessageTable, StructsStandInIt) {
  std::size_t structs = 0;
  for_each_message([&structs]<class M>() {
    const MessageInfo* row = find_message(M::kId);
    ASSERT_NE(row, nullptr) << M::kName;
    EXPECT_STREQ(row->name, M::kName);
    EXPECT_EQ(row->crc_extra, M::kCrcExtra) << M::kName;
    EXPECT_EQ(row->max_length, M::kMaxLength) << M::kName;
    ++structs;
  });
  EXPECT_GT(structs, std::size(kPublished) - 1);
  EXPECT_LT(structs, kMessages.size());
}

/// Fields touch without gaps, base fields fall in element size, and extensions start where the base ends.
TEST(MessageTable, FieldsFillThePayload) {
  for_each_message([]<class M>() {
    M message;
    std::size_t expected = 0, last_size = 8;
    M::for_each_field(message, [&](const char* name, std::size_t offset, auto& field, bool extension) {
      std::size_t element = sizeof(field);
      if constexpr (requires { field[0]; }) element = sizeof(field[0]);
      EXPECT_EQ(offset, expected) << M::kName << '.' << name;
      if (!extension) {
        EXPECT_LE(element, last_size) << M::kName << '.' << name;
        last_size = element;
        EXPECT_LT(offset, M::kMinLength) << M::kName << '.' << name;
      } else {
        EXPECT_GE(offset, M::kMinLength) << M::kName << '.' << name;
      }
      expected += sizeof(field);
    });
    EXPECT_EQ(expected, M::kMaxLength) << M::kName;
  });
}

TEST(MessageTable, OffsetsOfTheFieldsThatFly) {
  std::string offsets;
  SetAttitudeTarget target;
  SetAttitudeTarget::for_each_field(target, [&](const char* name, std::size_t offset, auto&, bool extension) {
    offsets += std::string(extension ? "*" : "") + std::to_string(offset) + ' ' + name + ' ';
  });
  EXPECT_EQ(offsets,
            "0 time_boot_ms 4 q 20 body_roll_rate 24 body_pitch_rate 28 body_yaw_rate 32 thrust 36 target_system 37 "
            "target_component 38 type_mask *39 thrust_body ");
}

/// Any payload survives unpack and pack; a shortened one comes back with zeros, a longer one without the surplus.
TEST(MessageTable, PayloadsOfAnyLength) {
  std::mt19937 random(1);
  for_each_message([&random]<class M>() {
    std::array<std::uint8_t, 255> payload{};
    for (auto& byte : payload) byte = static_cast<std::uint8_t>(random());
    for (std::size_t length = 0; length <= payload.size(); ++length) {
      std::array<std::uint8_t, M::kMaxLength> back{};
      M::unpack(payload.data(), length).pack(back.data());
      for (std::size_t i = 0; i < back.size(); ++i)
        ASSERT_EQ(back[i], i < length ? payload[i] : 0) << M::kName << " length " << length << " byte " << i;
    }
  });
}

}  // namespace
}  // namespace wasp::mavlink
