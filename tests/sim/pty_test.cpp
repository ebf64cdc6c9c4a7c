#include "sim/pty.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>

#include "rt/clock.h"

namespace wasp::sim {
namespace {

std::string link_path() { return testing::TempDir() + "wasp_pty_test_" + std::to_string(getpid()); }

TEST(Pty, CarriesEveryByteBothWaysUnchanged) {
  Pty pty(link_path());
  const int fd = open(link_path().c_str(), O_RDWR | O_NOCTTY);
  ASSERT_GE(fd, 0);
  std::array<std::uint8_t, 256> all{};
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::uint8_t>(i);
  pty.write(all);
  std::array<std::uint8_t, 256> got{};
  for (std::size_t n = 0; n < got.size();) {
    const ssize_t m = read(fd, got.data() + n, got.size() - n);
    ASSERT_GT(m, 0);
    n += static_cast<std::size_t>(m);
  }
  EXPECT_EQ(got, all);
  ASSERT_EQ(write(fd, all.data(), all.size()), 256);
  std::vector<std::uint8_t> heard;
  while (heard.size() < 256 && pty.wait(rt::now() + kSecond)) {
    const auto bytes = pty.read();
    heard.insert(heard.end(), bytes.begin(), bytes.end());
  }
  EXPECT_TRUE(std::equal(heard.begin(), heard.end(), all.begin(), all.end()));
  close(fd);
}

TEST(Pty, NeverBlocksWhenNobodyReadsAndSurvivesReopening) {
  Pty pty(link_path());
  const std::vector<std::uint8_t> piece(1000, 0x55);
  for (int i = 0; i < 500; ++i) pty.write(piece);
  EXPECT_GT(pty.dropped_bytes(), 0u);
  for (int round = 0; round < 3; ++round) {
    const int fd = open(link_path().c_str(), O_RDWR | O_NOCTTY);
    ASSERT_GE(fd, 0);
    ASSERT_EQ(write(fd, "x", 1), 1);
    ASSERT_TRUE(pty.wait(rt::now() + kSecond)) << "round " << round;
    EXPECT_EQ(pty.read().size(), 1u);
    close(fd);
  }
}

TEST(Pty, RemovesItsLinkAndRefusesToReplaceAFile) {
  { Pty pty(link_path()); }
  EXPECT_NE(access(link_path().c_str(), F_OK), 0);
  const int fd = open(link_path().c_str(), O_CREAT | O_WRONLY, 0600);
  close(fd);
  EXPECT_THROW(Pty{link_path()}, std::runtime_error);
  EXPECT_EQ(access(link_path().c_str(), F_OK), 0);
  unlink(link_path().c_str());
}

}  // namespace
}  // namespace wasp::sim
