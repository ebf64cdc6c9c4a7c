// Motion JPEG frames, whole and damaged in every place.
#include "drivers/jpeg_gray.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <vector>

#include <jpeglib.h>

#include "tests/cameras/camera_program.h"

namespace wasp::drivers {
namespace {

constexpr int kWidth = 160, kHeight = 120;

std::uint8_t brightness(int x, int y) {
  return static_cast<std::uint8_t>(128 + 60 * std::sin(x * 0.09) + 50 * std::cos(y * 0.13));
}

/// A colour picture of that brightness, as cameras send it.
std::vector<std::uint8_t> encode() {
  jpeg_compress_struct c{};
  jpeg_error_mgr errors{};
  c.err = jpeg_std_error(&errors);
  jpeg_create_compress(&c);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&c, &bytes, &size);
  c.image_width = kWidth, c.image_height = kHeight, c.input_components = 3, c.in_color_space = JCS_YCbCr;
  jpeg_set_defaults(&c);
  jpeg_set_quality(&c, 95, TRUE);
  jpeg_start_compress(&c, TRUE);
  for (int y = 0; y < kHeight; ++y) {
    std::vector<std::uint8_t> row;
    for (int x = 0; x < kWidth; ++x)
      row.insert(row.end(), {brightness(x, y), static_cast<std::uint8_t>(x), static_cast<std::uint8_t>(2 * y)});
    JSAMPROW pointer = row.data();
    jpeg_write_scanlines(&c, &pointer, 1);
  }
  jpeg_finish_compress(&c);
  jpeg_destroy_compress(&c);
  std::vector<std::uint8_t> out(bytes, bytes + size);
  std::free(bytes);
  return out;
}

/// Without its Huffman tables (marker DHT), as UVC cameras send it.
std::vector<std::uint8_t> without_tables(const std::vector<std::uint8_t>& jpeg) {
  std::vector<std::uint8_t> out;
  std::size_t at = 2;
  out.assign(jpeg.begin(), jpeg.begin() + 2);
  while (jpeg[at + 1] != 0xda) {
    const std::size_t length = 2 + jpeg[at + 2] * 256u + jpeg[at + 3];
    const auto begin = jpeg.begin() + static_cast<std::ptrdiff_t>(at);
    if (jpeg[at + 1] != 0xc4) out.insert(out.end(), begin, begin + static_cast<std::ptrdiff_t>(length));
    at += length;
  }
  out.insert(out.end(), jpeg.begin() + static_cast<std::ptrdiff_t>(at), jpeg.end());
  return out;
}

int worst_error(const std::vector<std::uint8_t>& gray) {
  int worst = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      worst = std::max(worst, std::abs(gray[static_cast<std::size_t>(y * kWidth + x)] - brightness(x, y)));
  return worst;
}

TEST(JpegGray, TheBrightnessComesOutOfAColourPicture) {
  JpegGray decoder;
  std::vector<std::uint8_t> gray(kWidth * kHeight);
  int announced = 0;
  const auto jpeg = encode();
  ASSERT_TRUE(decoder.decode(jpeg, kWidth, kHeight, gray.data(), [&] { ++announced; })) << decoder.why();
  EXPECT_LE(worst_error(gray), 3);
  EXPECT_EQ(announced, 1);
  std::fill(gray.begin(), gray.end(), 0);
  ASSERT_TRUE(decoder.decode(without_tables(jpeg), kWidth, kHeight, gray.data())) << decoder.why();
  EXPECT_LE(worst_error(gray), 3) << "standard tables stand in";
}

TEST(JpegGray, WhateverIsCutShortIsRefusedAndTheNextOneIsGoodAgain) {
  JpegGray decoder;
  std::vector<std::uint8_t> gray(kWidth * kHeight);
  const auto jpeg = encode();
  for (std::size_t length = 0; length + 2 < jpeg.size(); length += 97)
    EXPECT_FALSE(decoder.decode(std::span(jpeg).first(length), kWidth, kHeight, gray.data())) << length << " bytes";
  EXPECT_TRUE(decoder.decode(jpeg, kWidth, kHeight, gray.data())) << decoder.why();
}

TEST(JpegGray, AnotherSizeAndGarbageAreRefused) {
  JpegGray decoder;
  std::vector<std::uint8_t> gray(kWidth * kHeight);
  EXPECT_FALSE(decoder.decode(encode(), kWidth, kHeight / 2, gray.data()));
  EXPECT_NE(decoder.why().find("160 x 120"), std::string::npos) << decoder.why();
  const std::vector<std::uint8_t> garbage(5000, 0xa5);
  EXPECT_FALSE(decoder.decode(garbage, kWidth, kHeight, gray.data()));
}

TEST(JpegGray, AMotionJpegCameraEndToEnd) {
  const test::TemporaryFolder folder;
  const auto jpeg = encode();
  std::ofstream(folder.path / "frame.jpg", std::ios::binary)
      .write(reinterpret_cast<const char*>(jpeg.data()), static_cast<std::streamsize>(jpeg.size()));
  test::CameraProgram camera(
      "libwasp_v4l2_standin.so",
      "format MJPG 160 120 100\njpeg " + (folder.path / "frame.jpg").string() + "\nframes 10\ncorrupt 3\nframes 10\n",
      {"--driver", "v4l2", "--width", "160", "--height", "120", "--rate", "100"});
  camera.compare_pixels = false;
  camera.follow(22);
  const auto figures = camera.finish();
  EXPECT_EQ(figures.at("corrupt"), 3) << camera.log();
  EXPECT_EQ(figures.at("dropped"), 0) << camera.log();
}

}  // namespace
}  // namespace wasp::drivers
