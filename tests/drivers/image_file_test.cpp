#include "drivers/image_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <filesystem>
#include <fstream>
#include <random>
#include <stdexcept>

namespace wasp::drivers {
namespace {

namespace fs = std::filesystem;

class ImageFile : public testing::Test {
 protected:
  void SetUp() override {
    folder = fs::temp_directory_path() / ("wasp_image_file_test_" + std::to_string(::getpid()));
    fs::create_directories(folder);
  }
  void TearDown() override { fs::remove_all(folder); }

  /// The message of the std::runtime_error that `call` throws.
  template <class F>
  static std::string error_of(F&& call) {
    try {
      call();
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "nothing was thrown";
  }
  void write(const fs::path& name, const std::string& bytes) const {
    std::ofstream(folder / name, std::ios::binary) << bytes;
  }

  fs::path folder;
};

template <class T>
std::vector<T> noise(std::size_t n) {
  std::mt19937 random(1);
  std::vector<T> out(n);
  for (T& x : out) x = static_cast<T>(random());
  return out;
}

TEST_F(ImageFile, DepthAndGraySurviveARoundTripAtEveryLevel) {
  const auto depth = noise<std::uint16_t>(64 * 40);
  const auto gray = noise<std::uint8_t>(64 * 40);
  for (const int level : {0, 1, 9}) {
    save_png(folder / "d.png", DepthView{depth.data(), 60, 40, 64}, level);
    save_png(folder / "g.png", GrayView{gray.data(), 60, 40, 64}, level);
    const auto d = load_gray16(folder / "d.png");
    const auto g = load_gray8(folder / "g.png");
    ASSERT_EQ(d.width_px, 60);
    ASSERT_EQ(g.height_px, 40);
    for (std::size_t v = 0; v < 40; ++v)
      for (std::size_t u = 0; u < 60; ++u) {
        ASSERT_EQ(d.pixels[v * 60 + u], depth[v * 64 + u]);
        ASSERT_EQ(g.pixels[v * 60 + u], gray[v * 64 + u]);
      }
  }
  const ImageInfo info = probe_image(folder / "d.png");
  EXPECT_EQ(info.width_px, 60);
  EXPECT_EQ(info.bits, 16);
  EXPECT_FALSE(info.colour);
}

TEST_F(ImageFile, ReadsPgmOfBothDepths) {
  write("a.pgm", std::string("P5\n# comment\n2 2\n255\n\x01\x02\x03\x04", 26));
  write("b.pgm", std::string("P5 2 1 65535\n\x01\x02\xff\xfe", 17));
  EXPECT_EQ(load_gray8(folder / "a.pgm").pixels, (std::vector<std::uint8_t>{1, 2, 3, 4}));
  EXPECT_EQ(load_gray16(folder / "b.pgm").pixels, (std::vector<std::uint16_t>{0x0102, 0xfffe}));
  EXPECT_EQ(probe_image(folder / "b.pgm").bits, 16);
}

TEST_F(ImageFile, EveryErrorNamesTheFile) {
  const auto gray = noise<std::uint8_t>(64 * 40);
  save_png(folder / "g.png", GrayView{gray.data(), 64, 40, 64});
  write("text.png", "this is no picture");
  write("empty.png", "");
  write("short.pgm", "P5 4 4 255\nabc");
  write("huge.pgm", "P5 999999 4 255\nabc");
  write("no.pgm", "P2 4 4 255\n");
  for (const char* name : {"missing.png", "text.png", "empty.png", "short.pgm", "huge.pgm", "no.pgm"}) {
    EXPECT_NE(error_of([&] { load_gray8(folder / name); }).find(name), std::string::npos) << name;
    EXPECT_NE(error_of([&] { probe_image(folder / name); }).find(name), std::string::npos) << name;
  }
  EXPECT_NE(error_of([&] { load_gray16(folder / "g.png"); }).find("16-bit"), std::string::npos);
  EXPECT_NE(error_of([&] {
              save_png(folder / "no" / "x.png", GrayView{gray.data(), 64, 40, 64});
            }).find("x.png"),
            std::string::npos);
  EXPECT_NE(error_of([&] { save_png(folder / "y.png", GrayView{}); }).find("y.png"), std::string::npos);
}

TEST_F(ImageFile, WhatAHeaderClaimsIsNotAllocatedBeforeTheFileCanHoldIt) {
  write("huge.pgm", "P5 16384 16384 65535\nab");
  EXPECT_NE(error_of([&] { load_gray16(folder / "huge.pgm"); }).find("smaller than its image"), std::string::npos);
  const auto gray = noise<std::uint8_t>(64 * 40);
  save_png(folder / "g.png", GrayView{gray.data(), 64, 40, 64}, 9);
  std::ifstream in(folder / "g.png", std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(in)), {});
  const std::string head("IHDR\0\0\x40\0\0\0\x40\0\x08\0\0\0\0", 17);  // 16384 x 16384, 8 bits
  const auto crc = crc32(0, reinterpret_cast<const Bytef*>(head.data()), static_cast<uInt>(head.size()));
  bytes.replace(12, head.size(), head);
  for (std::size_t i = 0; i < 4; ++i) bytes[29 + i] = static_cast<char>(crc >> (24 - 8 * i));
  write("huge.png", bytes);
  EXPECT_EQ(probe_image(folder / "huge.png").width_px, 16384);
  EXPECT_NE(error_of([&] { load_gray8(folder / "huge.png"); }).find("smaller than its image"), std::string::npos);
}

TEST_F(ImageFile, APipeIsRefusedInsteadOfWaitedFor) {
  for (const char* name : {"pipe.png", "pipe.pgm"}) {
    ASSERT_EQ(mkfifo((folder / name).c_str(), 0600), 0);
    EXPECT_NE(error_of([&] { load_gray8(folder / name); }).find("not a regular file"), std::string::npos) << name;
    EXPECT_NE(error_of([&] { probe_image(folder / name); }).find("not a regular file"), std::string::npos) << name;
  }
}

TEST_F(ImageFile, EveryTruncationOfAPngIsAnErrorNotACrash) {
  const auto depth = noise<std::uint16_t>(24 * 16);
  save_png(folder / "d.png", DepthView{depth.data(), 24, 16, 24});
  std::ifstream in(folder / "d.png", std::ios::binary);
  const std::string whole((std::istreambuf_iterator<char>(in)), {});
  for (std::size_t n = 0; n < whole.size(); n += 7) {
    write("cut.png", whole.substr(0, n));
    EXPECT_THROW(load_gray16(folder / "cut.png"), std::runtime_error) << n << " bytes";
    EXPECT_THROW(probe_image(folder / "cut.png"), std::runtime_error) << n << " bytes";
  }
}

TEST_F(ImageFile, FlippedBytesNeverCrash) {
  const auto depth = noise<std::uint16_t>(24 * 16);
  save_png(folder / "d.png", DepthView{depth.data(), 24, 16, 24});
  std::ifstream in(folder / "d.png", std::ios::binary);
  const std::string whole((std::istreambuf_iterator<char>(in)), {});
  std::mt19937 random(5);
  int refused = 0;
  for (int run = 0; run < 300; ++run) {
    std::string bytes = whole;
    bytes[random() % bytes.size()] ^= static_cast<char>(1 + random() % 255);
    write("bad.png", bytes);
    try {
      EXPECT_LE(load_gray16(folder / "bad.png").pixels.size(), 24u * 16u);
    } catch (const std::runtime_error&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 250);  // checksums catch nearly all
}

}  // namespace
}  // namespace wasp::drivers
