// Both value encodings of the parameter protocol, against bytes computed by hand, and what must be refused.
#include "drivers/parameter_value.h"

#include <gtest/gtest.h>

#include <vector>

namespace wasp::drivers {
namespace {

using namespace mavlink;  // NOLINT: message names
constexpr auto kCast = ParameterEncoding::kCCast, kBits = ParameterEncoding::kBytewise;

std::uint32_t bits_of(float value) { return std::bit_cast<std::uint32_t>(value); }

TEST(ParameterValue, AnIntegerIsANumberInOneEncodingAndItsBitsInTheOther) {
  EXPECT_EQ(encode_parameter(kCast, mav_param_type::kInt32, 7).value(), 7.0f);
  EXPECT_EQ(bits_of(encode_parameter(kBits, mav_param_type::kInt32, 7).value()), 7u);
  EXPECT_EQ(encode_parameter(kCast, mav_param_type::kInt32, -2).value(), -2.0f);
  EXPECT_EQ(bits_of(encode_parameter(kBits, mav_param_type::kInt32, -2).value()), 0xfffffffeu);
  EXPECT_EQ(bits_of(encode_parameter(kBits, mav_param_type::kInt8, -2).value()), 0xfeu);
  EXPECT_EQ(bits_of(encode_parameter(kBits, mav_param_type::kInt16, -2).value()), 0xfffeu);
  EXPECT_EQ(encode_parameter(kBits, mav_param_type::kReal32, 0.25).value(), 0.25f);
}

TEST(ParameterValue, EveryPortableTypeComesBackInBothEncodings) {
  const struct {
    std::uint8_t type;
    std::vector<double> values;
  } rows[] = {{mav_param_type::kUint8, {0, 1, 255}},
              {mav_param_type::kInt8, {-128, -1, 127}},
              {mav_param_type::kUint16, {0, 65535}},
              {mav_param_type::kInt16, {-32768, 32767}},
              {mav_param_type::kUint32, {0, 16777216, 4294967295.0}},
              {mav_param_type::kInt32, {-2147483648.0, -1, 1, 2147483520.0}},
              {mav_param_type::kReal32, {-1.5, 0, 1e-30, 3e38}}};
  for (const auto& row : rows)
    for (const double value : row.values)
      for (const auto encoding : {kCast, kBits}) {
        const auto wire = encode_parameter(encoding, row.type, value);
        ASSERT_TRUE(wire.has_value()) << int{row.type} << ' ' << value;
        if (encoding == kCast && value == 4294967295.0) continue;  // a float rounds it up, out of the type's range
        const auto back = decode_parameter(encoding, row.type, *wire);
        ASSERT_TRUE(back.has_value()) << int{row.type} << ' ' << value;
        EXPECT_EQ(*back, row.type == mav_param_type::kReal32 ? double{static_cast<float>(value)} : value);
      }
}

TEST(ParameterValue, BitsThatAreNoNumberAsAFloatSurvive) {
  const float wire = std::bit_cast<float>(0x7fa00001u);  // a signalling NaN
  EXPECT_EQ(decode_parameter(kBits, mav_param_type::kInt32, wire), 0x7fa00001);
  EXPECT_EQ(bits_of(encode_parameter(kBits, mav_param_type::kInt32, 0x7fa00001).value()), 0x7fa00001u);
}

TEST(ParameterValue, RefusesWhatDoesNotFit) {
  const double inf = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(encode_parameter(kCast, mav_param_type::kUint8, 256));
  EXPECT_FALSE(encode_parameter(kBits, mav_param_type::kUint8, -1));
  EXPECT_FALSE(encode_parameter(kCast, mav_param_type::kReal64, 1));
  EXPECT_FALSE(encode_parameter(kCast, mav_param_type::kInt64, 1));
  EXPECT_FALSE(encode_parameter(kCast, 0, 1));
  EXPECT_FALSE(encode_parameter(kCast, mav_param_type::kReal32, inf));
  EXPECT_FALSE(decode_parameter(kCast, mav_param_type::kInt8, 200.f));
  EXPECT_FALSE(decode_parameter(kCast, mav_param_type::kReal32, std::numeric_limits<float>::quiet_NaN()));
  EXPECT_FALSE(decode_parameter(kBits, 99, 1.f));
}

TEST(ParameterValue, NamesOfSixteenCharactersHaveNoTerminator) {
  EXPECT_EQ(name_of(parameter_name("COM_OF_LOSS_T")), "COM_OF_LOSS_T");
  EXPECT_EQ(name_of(parameter_name("ABCDEFGHIJKLMNOP")), "ABCDEFGHIJKLMNOP");
  EXPECT_EQ(name_of(parameter_name("ABCDEFGHIJKLMNOPQ")), "ABCDEFGHIJKLMNOP");
  EXPECT_EQ(name_of(parameter_name("")), "");
}

TEST(ParameterValue, CapabilitiesSayWhich) {
  EXPECT_EQ(capability_of(kBits), 16u);
  EXPECT_EQ(capability_of(kCast), 131072u);
  EXPECT_EQ(encoding_of(16 | 8192, kCast), kBits);
  EXPECT_EQ(encoding_of(131072 | 64, kBits), kCast);
  EXPECT_EQ(encoding_of(0, kBits), kBits);
  EXPECT_EQ(encoding_of(16 | 131072, kCast), kCast);
}

}  // namespace
}  // namespace wasp::drivers
