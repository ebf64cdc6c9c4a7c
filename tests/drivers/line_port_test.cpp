// The line on a pseudo-terminal: set-up, partial writes, hang-up, reopening by path, exclusive use; and as a socket:
// who is answered, and what is no loss.
#include "drivers/line_port.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <pty.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <thread>
#include <vector>

#include "drivers/line_handover.h"
#include "rt/clock.h"

namespace wasp::drivers {
namespace {

/// The far end of the line, and a path that stays the same when the device behind it changes.
class FarEnd {
 public:
  explicit FarEnd(std::filesystem::path link) : link_(std::move(link)) { plug_in(); }
  ~FarEnd() {
    unplug();
    std::filesystem::remove(link_);
  }
  void plug_in() {
    int slave = -1;
    std::array<char, 128> name{};
    ASSERT_EQ(openpty(&master_, &slave, name.data(), nullptr, nullptr), 0);
    ::close(slave);
    std::filesystem::remove(link_);
    std::filesystem::create_symlink(name.data(), link_);
  }
  void unplug() {
    if (master_ >= 0) ::close(master_);
    master_ = -1;
  }
  [[nodiscard]] int fd() const { return master_; }
  [[nodiscard]] std::string path() const { return link_.string(); }

 private:
  std::filesystem::path link_;
  int master_ = -1;
};

std::filesystem::path own_link() {
  const auto* test = testing::UnitTest::GetInstance()->current_test_info();
  return std::filesystem::temp_directory_path() / ("wasp-serial-" + std::to_string(getpid()) + "-" + test->name());
}

/// Waits up to two seconds for `done`, by reading again and again.
template <class Done>
bool eventually(Done&& done) {
  for (int i = 0; i < 2000; ++i) {
    if (done()) return true;
    rt::sleep_until(rt::now() + kMillisecond);
  }
  return false;
}

std::string refusal(std::string_view text) {
  try {
    Endpoint::parse(text);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return {};
}

TEST(Endpoint, Parses) {
  const auto usb = Endpoint::parse("serial:/dev/ttyUSB0:921600");
  EXPECT_EQ(usb.path, "/dev/ttyUSB0");
  EXPECT_EQ(usb.baud, 921600u);
  const auto by_path = Endpoint::parse("serial:/dev/serial/by-path/pci-0000:00:14.0-usb-0:3:1.0-port0:57600");
  EXPECT_EQ(by_path.path, "/dev/serial/by-path/pci-0000:00:14.0-usb-0:3:1.0-port0");
  EXPECT_EQ(by_path.baud, 57600u);
}

TEST(Endpoint, NamesWhatIsWrong) {
  EXPECT_NE(refusal("/dev/ttyUSB0").find("/dev/ttyUSB0"), std::string::npos);
  EXPECT_NE(refusal("serial:/dev/ttyUSB0").find("serial:<device>:<baud>"), std::string::npos);
  EXPECT_NE(refusal("serial::921600").find("serial:<device>:<baud>"), std::string::npos);
  EXPECT_NE(refusal("serial:ttyUSB0:921600").find("ttyUSB0"), std::string::npos);
  EXPECT_NE(refusal("serial:/dev/ttyUSB0:fast").find("\"fast\""), std::string::npos);
  EXPECT_NE(refusal("serial:/dev/ttyUSB0:921601").find("921601"), std::string::npos);
  EXPECT_NE(refusal("serial:/dev/ttyUSB0:0").find("0"), std::string::npos);
  EXPECT_NE(refusal("serial:/dev/ttyUSB0:").find("not a number"), std::string::npos);
  EXPECT_NE(refusal("udp://127.0.0.1").find("udp://<own address>:<port>"), std::string::npos);
  EXPECT_NE(refusal("udp://127.0.0.1:0").find("1 to 65535"), std::string::npos);
  EXPECT_NE(refusal("udp://127.0.0.1:70000").find("70000"), std::string::npos);
  EXPECT_NE(refusal("tcp://:5760").find("no host"), std::string::npos);
  EXPECT_NE(refusal("tcp://no.such.host.invalid:5760").find("no.such.host.invalid"), std::string::npos);
}

TEST(Endpoint, ParsesSockets) {
  const auto listens = Endpoint::parse("udp://127.0.0.1:14540");
  EXPECT_EQ(listens.kind, EndpointKind::kUdpListen);
  EXPECT_EQ(listens.host, 0x7f000001u);
  EXPECT_EQ(listens.port, 14540);
  EXPECT_EQ(Endpoint::parse("udp://:14540").host, 0u);
  EXPECT_EQ(Endpoint::parse("udpout://10.1.2.3:14550").kind, EndpointKind::kUdpSend);
  EXPECT_EQ(Endpoint::parse("tcp://localhost:5760").kind, EndpointKind::kTcp);
}

/// A socket of the autopilot's side on the loopback.
class FarSocket {
 public:
  explicit FarSocket(int type) : fd_(::socket(AF_INET, type | SOCK_CLOEXEC, 0)) { bind_to(0); }
  ~FarSocket() { ::close(fd_); }
  FarSocket(const FarSocket&) = delete;
  FarSocket& operator=(const FarSocket&) = delete;
  [[nodiscard]] int fd() const { return fd_; }
  [[nodiscard]] std::uint16_t port() const {
    sockaddr_in a{};
    socklen_t size = sizeof a;
    getsockname(fd_, reinterpret_cast<sockaddr*>(&a), &size);
    return ntohs(a.sin_port);
  }
  void send_to(std::uint16_t port, std::string_view text) const {
    const sockaddr_in a = loopback(port);
    ASSERT_EQ(::sendto(fd_, text.data(), text.size(), 0, reinterpret_cast<const sockaddr*>(&a), sizeof a),
              std::ssize(text));
  }
  [[nodiscard]] std::string receive() const {
    std::array<char, 512> text;
    const ssize_t n = ::recv(fd_, text.data(), text.size(), MSG_DONTWAIT);
    return n > 0 ? std::string(text.data(), static_cast<std::size_t>(n)) : std::string();
  }

 private:
  static sockaddr_in loopback(std::uint16_t port) {
    sockaddr_in a{};
    a.sin_family = AF_INET, a.sin_addr.s_addr = htonl(INADDR_LOOPBACK), a.sin_port = htons(port);
    return a;
  }
  void bind_to(std::uint16_t port) const {
    const sockaddr_in a = loopback(port);
    ASSERT_EQ(::bind(fd_, reinterpret_cast<const sockaddr*>(&a), sizeof a), 0);
  }
  int fd_;
};

std::uint16_t free_udp_port() { return FarSocket(SOCK_DGRAM).port(); }

std::span<const std::uint8_t> bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

/// Reads until something comes.
std::string hear(LinePort& port) {
  std::array<std::uint8_t, 512> buffer{};
  std::string heard;
  eventually([&] {
    const IoResult got = port.read(buffer);
    EXPECT_NE(got.status, IoStatus::kGone);
    heard.assign(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(got.bytes));
    return got.bytes > 0;
  });
  return heard;
}

TEST(LinePortUdp, ListensAnswersTheAdoptedPeerAndHearsNobodyElse) {
  const std::uint16_t own = free_udp_port();
  LinePort port(Endpoint::parse("udp://127.0.0.1:" + std::to_string(own)));
  EXPECT_EQ(port.write(bytes_of("early")).status, IoStatus::kWouldBlock) << "there is nobody yet";
  FarSocket stranger(SOCK_DGRAM), autopilot(SOCK_DGRAM);
  stranger.send_to(own, "noise");
  EXPECT_EQ(hear(port), "noise");
  autopilot.send_to(own, "frame");
  EXPECT_EQ(hear(port), "frame");
  port.adopt_peer();
  EXPECT_EQ(port.write(bytes_of("setpoint")).bytes, 8u);
  EXPECT_TRUE(eventually([&] { return autopilot.receive() == "setpoint"; }));
  stranger.send_to(own, "more noise");
  autopilot.send_to(own, "again");
  EXPECT_EQ(hear(port), "again");
  EXPECT_EQ(stranger.receive(), "");
  port.forget_peer();
  stranger.send_to(own, "it moved here");
  EXPECT_EQ(hear(port), "it moved here");
}

TEST(LinePortUdp, APeerThatIsNotThereIsSilenceAndOneThatComesBackIsHeard) {
  const std::uint16_t there = free_udp_port();
  LinePort port(Endpoint::parse("udpout://127.0.0.1:" + std::to_string(there)));
  std::array<std::uint8_t, 16> buffer{};
  for (int i = 0; i < 5; ++i) {  // each second write meets the error of the one before
    EXPECT_NE(port.write(bytes_of("x")).status, IoStatus::kGone);
    EXPECT_EQ(port.read(buffer).status, IoStatus::kWouldBlock);
  }
  EXPECT_FALSE(port.hung_up(POLLERR));
  EXPECT_EQ(port.pending_output_bytes(), 0);
  EXPECT_FALSE(port.wait_readable(rt::now() + 5 * kMillisecond)) << "nothing to wake for";
}

TEST(LinePortTcp, ConnectsCarriesAndNoticesTheEnd) {
  FarSocket server(SOCK_STREAM);
  const auto endpoint = Endpoint::parse("tcp://127.0.0.1:" + std::to_string(server.port()));
  try {
    LinePort early(endpoint);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("tcp://127.0.0.1:"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("refused"), std::string::npos) << error.what();
  }
  ASSERT_EQ(::listen(server.fd(), 1), 0);
  LinePort port(endpoint);
  const int far = ::accept(server.fd(), nullptr, nullptr);
  ASSERT_GE(far, 0);
  EXPECT_EQ(port.write(bytes_of("hello")).bytes, 5u);
  EXPECT_EQ(::send(far, "you", 3, 0), 3);
  EXPECT_EQ(hear(port), "you");
  ::close(far);
  std::array<std::uint8_t, 16> buffer{};
  EXPECT_TRUE(eventually([&] { return port.read(buffer).status == IoStatus::kGone; }));
  EXPECT_TRUE(port.try_reopen()) << "the server still listens";
}

TEST(LinePort, NamesTheDeviceItCannotOpen) {
  try {
    LinePort port({"/dev/wasp-no-such-device", 115200});
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("/dev/wasp-no-such-device"), std::string::npos);
  }
  EXPECT_THROW(LinePort({"/dev/null", 115200}), std::runtime_error);  // not a terminal
}

TEST(LinePort, IsRawAndCloseOnExec) {
  FarEnd far(own_link());
  LinePort port({far.path(), 921600});
  termios line{};
  ASSERT_EQ(tcgetattr(port.fd(), &line), 0);
  EXPECT_EQ(cfgetospeed(&line), static_cast<speed_t>(B921600));
  EXPECT_EQ(cfgetispeed(&line), static_cast<speed_t>(B921600));
  EXPECT_EQ(line.c_lflag & (ICANON | ECHO | ISIG), 0u);
  EXPECT_EQ(line.c_iflag & (IXON | ICRNL | ISTRIP), 0u);
  EXPECT_EQ(line.c_oflag & OPOST, 0u);
  EXPECT_EQ(line.c_cflag & CSIZE, static_cast<tcflag_t>(CS8));
  EXPECT_EQ(line.c_cc[VMIN], 0);
  EXPECT_EQ(line.c_cc[VTIME], 0);
  EXPECT_NE(fcntl(port.fd(), F_GETFD) & FD_CLOEXEC, 0);
  EXPECT_NE(fcntl(port.fd(), F_GETFL) & O_NONBLOCK, 0);
}

TEST(LinePort, CarriesEveryByteValueBothWays) {
  FarEnd far(own_link());
  LinePort port({far.path(), 115200});
  std::array<std::uint8_t, 256> all{};
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::uint8_t>(i);

  ASSERT_EQ(::write(far.fd(), all.data(), all.size()), 256);
  std::vector<std::uint8_t> got;
  ASSERT_TRUE(eventually([&] {
    std::array<std::uint8_t, 64> piece{};
    const IoResult result = port.read(piece);
    got.insert(got.end(), piece.begin(), piece.begin() + static_cast<std::ptrdiff_t>(result.bytes));
    return got.size() >= all.size();
  }));
  EXPECT_TRUE(std::equal(all.begin(), all.end(), got.begin(), got.end()));

  const IoResult sent = port.write(all);
  EXPECT_EQ(sent.status, IoStatus::kOk);
  ASSERT_EQ(sent.bytes, all.size());
  std::array<std::uint8_t, 512> back{};
  std::size_t n = 0;
  while (n < all.size()) {
    const ssize_t k = ::read(far.fd(), back.data() + n, back.size() - n);
    ASSERT_GT(k, 0);
    n += static_cast<std::size_t>(k);
  }
  EXPECT_TRUE(std::equal(all.begin(), all.end(), back.begin()));
  EXPECT_GE(port.pending_output_bytes(), 0);
}

TEST(LinePort, AnEmptyLineIsNotADeadOne) {
  FarEnd far(own_link());
  LinePort port({far.path(), 115200});
  std::array<std::uint8_t, 8> buffer{};
  EXPECT_EQ(port.read(buffer).status, IoStatus::kWouldBlock);
  EXPECT_FALSE(port.wait_readable(rt::now() + 2 * kMillisecond));
  EXPECT_FALSE(port.wait_readable(rt::now() - kSecond));
}

TEST(LinePort, WakesWhenBytesArrive) {
  FarEnd far(own_link());
  LinePort port({far.path(), 115200});
  std::thread sender([&far] {
    rt::sleep_until(rt::now() + 10 * kMillisecond);
    EXPECT_EQ(::write(far.fd(), "x", 1), 1);
  });
  EXPECT_TRUE(port.wait_readable(rt::now() + 10 * kSecond));
  sender.join();
  std::array<std::uint8_t, 8> buffer{};
  EXPECT_EQ(port.read(buffer).bytes, 1u);
}

/// Nobody reads: the line fills, a write is cut short, then none fits; nothing blocks and no byte is lost or doubled.
TEST(LinePort, WritesInPartsWhenTheLineIsFull) {
  FarEnd far(own_link());
  LinePort port({far.path(), 115200});
  std::vector<std::uint8_t> block(3000);
  std::size_t accepted = 0, tries = 0;
  bool cut_short = false;
  std::uint8_t value = 0;
  IoResult result{IoStatus::kOk, 0};
  while (result.status == IoStatus::kOk && ++tries < 10'000) {
    for (std::size_t i = 0; i < block.size(); ++i) block[i] = static_cast<std::uint8_t>(value + i);
    result = port.write(block);
    cut_short = cut_short || (result.bytes > 0 && result.bytes < block.size());
    value = static_cast<std::uint8_t>(value + result.bytes);
    accepted += result.bytes;
  }
  EXPECT_EQ(result.status, IoStatus::kWouldBlock);
  EXPECT_TRUE(cut_short);

  ASSERT_EQ(fcntl(far.fd(), F_SETFL, O_NONBLOCK), 0);
  std::size_t arrived = 0;
  ASSERT_TRUE(eventually([&] {
    std::array<std::uint8_t, 4096> buffer{};
    const ssize_t n = ::read(far.fd(), buffer.data(), buffer.size());
    for (ssize_t i = 0; i < n; ++i, ++arrived)
      EXPECT_EQ(buffer[static_cast<std::size_t>(i)], static_cast<std::uint8_t>(arrived));
    return arrived >= accepted;
  }));
  EXPECT_EQ(arrived, accepted);
  EXPECT_EQ(port.write(block).status, IoStatus::kOk);
}

TEST(LinePort, NoticesHangUpAndComesBackUnderTheSamePath) {
  FarEnd far(own_link());
  LinePort port({far.path(), 115200});
  const int fd = port.fd();
  std::array<std::uint8_t, 8> buffer{};
  for (int round = 0; round < 3; ++round) {
    far.unplug();
    EXPECT_TRUE(port.wait_readable(rt::now() + kSecond));
    EXPECT_EQ(port.read(buffer).status, IoStatus::kGone);
    EXPECT_EQ(port.write(buffer).status, IoStatus::kGone);
    EXPECT_FALSE(port.try_reopen());  // the path leads nowhere
    EXPECT_EQ(port.last_error(), ENOENT);
    EXPECT_EQ(port.read(buffer).status, IoStatus::kGone);
    EXPECT_EQ(port.write(buffer).status, IoStatus::kGone);
    EXPECT_EQ(port.pending_output_bytes(), -1);

    far.plug_in();
    ASSERT_TRUE(port.try_reopen());
    EXPECT_EQ(port.fd(), fd);
    EXPECT_EQ(port.read(buffer).status, IoStatus::kWouldBlock);
    ASSERT_EQ(::write(far.fd(), "abc", 3), 3);
    EXPECT_TRUE(port.wait_readable(rt::now() + kSecond));
    EXPECT_EQ(port.read(buffer).bytes, 3u);
    EXPECT_EQ(port.write(std::span(buffer).first(3)).bytes, 3u);
  }
}

TEST(LinePort, AGivenLineThatIsLostComesBackFromWhoGaveIt) {
  FarEnd far(own_link());
  LinePort giver({far.path(), 115200});
  const HandoverSockets sockets = make_handover();
  LinePort taker({far.path(), 115200}, {dup(giver.fd()), sockets.taker});
  std::array<std::uint8_t, 8> buffer{};
  EXPECT_EQ(taker.write(buffer).bytes, buffer.size());
  for (int round = 0; round < 2; ++round) {
    far.unplug();
    ASSERT_TRUE(eventually([&] { return taker.read(buffer).status == IoStatus::kGone; }));
    EXPECT_FALSE(taker.try_reopen());  // it never opens by itself
    far.plug_in();
    EXPECT_FALSE(taker.try_reopen());
    ASSERT_TRUE(giver.try_reopen());
    ASSERT_TRUE(give_descriptor(sockets.giver, giver.fd()));
    ASSERT_TRUE(taker.try_reopen());
    EXPECT_EQ(taker.write(buffer).bytes, buffer.size());
    std::array<std::uint8_t, 8> heard{};
    EXPECT_TRUE(eventually([&] { return ::read(far.fd(), heard.data(), heard.size()) > 0; }));
  }
  ::close(sockets.giver);
}

TEST(LineHandover, TheNewestOfSeveralIsTakenAndNoneIsLeaked) {
  const HandoverSockets sockets = make_handover();
  EXPECT_EQ(take_descriptor(sockets.taker), -1);
  const int before = dup(0);
  ::close(before);
  const int first = ::open("/dev/null", O_RDONLY | O_CLOEXEC), second = ::open("/dev/zero", O_RDONLY | O_CLOEXEC);
  ASSERT_TRUE(give_descriptor(sockets.giver, first));
  ASSERT_TRUE(give_descriptor(sockets.giver, second));
  ::close(first);
  ::close(second);
  const int taken = take_descriptor(sockets.taker);
  ASSERT_GE(taken, 0);
  char byte = 1;
  EXPECT_EQ(::read(taken, &byte, 1), 1);  // /dev/zero, not /dev/null
  EXPECT_EQ(byte, 0);
  ::close(taken);
  const int after = dup(0);
  EXPECT_EQ(after, before);
  ::close(after);
  ::close(sockets.taker);
  EXPECT_FALSE(give_descriptor(sockets.giver, 0));  // nobody takes any more: refused, not a signal
  ::close(sockets.giver);
}

TEST(LinePort, LetsTheDeviceGoOnRelease) {
  FarEnd far(own_link());
  LinePort port({far.path(), 115200});
  EXPECT_THROW(LinePort({far.path(), 115200}), std::runtime_error) << "exclusive use";
  port.release();
  EXPECT_EQ(port.write(std::array<std::uint8_t, 1>{1}).status, IoStatus::kGone);
  { LinePort other({far.path(), 115200}); }
}

TEST(LinePort, StaleInputIsDiscardedOnOpening) {
  FarEnd far(own_link());
  int keeper = ::open(far.path().c_str(), O_RDWR | O_NOCTTY);
  ASSERT_GE(keeper, 0);
  ASSERT_EQ(::write(far.fd(), "old\n", 4), 4);
  LinePort port({far.path(), 115200});
  std::array<std::uint8_t, 8> buffer{};
  EXPECT_EQ(port.read(buffer).status, IoStatus::kWouldBlock);
  ::close(keeper);
}

}  // namespace
}  // namespace wasp::drivers
