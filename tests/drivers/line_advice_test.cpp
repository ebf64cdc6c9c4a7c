// What is said of a device that cannot be opened.
#include "drivers/line_advice.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>

#include "drivers/line_port.h"

namespace wasp::drivers {
namespace {

std::string refusal_of(const std::string& path) {
  try {
    LinePort port(Endpoint::parse("serial:" + path + ":57600"));
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

TEST(LineAdvice, PermissionDeniedNamesTheGroup) {
  int master = -1, slave = -1;
  std::array<char, 128> name{};
  ASSERT_EQ(openpty(&master, &slave, name.data(), nullptr, nullptr), 0);
  ASSERT_EQ(chmod(name.data(), 0600), 0);
  int channel[2];
  ASSERT_EQ(pipe(channel), 0);
  const pid_t child = fork();
  if (child == 0) {  // as nobody, where this runs as root
    if (geteuid() == 0 && (setgid(65534) != 0 || setuid(65534) != 0)) _exit(2);
    const std::string text = refusal_of(name.data());
    _exit(write(channel[1], text.data(), text.size()) == static_cast<ssize_t>(text.size()) ? 0 : 3);
  }
  int status = 0;
  waitpid(child, &status, 0);
  close(channel[1]);
  std::array<char, 1024> text{};
  const ssize_t n = read(channel[0], text.data(), text.size() - 1);
  close(channel[0]), close(slave), close(master);
  if (geteuid() != 0) GTEST_SKIP() << "the device is ours: nobody denies it";
  ASSERT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  const std::string said(text.data(), n > 0 ? static_cast<std::size_t>(n) : 0);
  EXPECT_NE(said.find(name.data()), std::string::npos) << said;
  EXPECT_NE(said.find("Permission denied"), std::string::npos) << said;
  EXPECT_NE(said.find("group dialout"), std::string::npos) << said;
}

TEST(LineAdvice, SaysWhatElseCanBeWrong) {
  const Endpoint serial = Endpoint::parse("serial:/dev/ttyUSB7:57600"), udp = Endpoint::parse("udp://127.0.0.1:14540");
  EXPECT_NE(line_advice(serial, ENOENT).find("plugged in"), std::string::npos);
  EXPECT_NE(line_advice(serial, EBUSY).find("/dev/ttyUSB7"), std::string::npos);
  EXPECT_NE(line_advice(serial, ENOTTY).find("no serial line"), std::string::npos);
  EXPECT_NE(line_advice(udp, EADDRINUSE).find("another program"), std::string::npos);
  EXPECT_EQ(line_advice(udp, EACCES), "");
  EXPECT_EQ(line_advice(serial, EIO), "");
  EXPECT_NE(refusal_of("/dev/wasp-no-such-device").find("plugged in"), std::string::npos);
  EXPECT_NE(refusal_of("/dev/null").find("no serial line"), std::string::npos);
}

}  // namespace
}  // namespace wasp::drivers
