// Where the autopilot is: a serial line, or a socket.
//   serial:/dev/ttyUSB0:921600   device and baud rate
//   udp://127.0.0.1:14540        listens there and answers whoever sent the first frame of the autopilot
//   udpout://192.168.1.5:14550   speaks first, to there
//   tcp://127.0.0.1:5760         connects to there
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace wasp::drivers {

enum class EndpointKind : std::uint8_t { kSerial, kUdpListen, kUdpSend, kTcp };

struct Endpoint {
  std::string path;         ///< of a serial device; of a socket the text as given
  unsigned baud = 921600;   ///< serial: one of the rates of termios, 1200 ... 4000000
  EndpointKind kind = EndpointKind::kSerial;
  std::uint32_t host = 0;   ///< sockets: IPv4 address, most significant byte first; 0 with kUdpListen: any of ours
  std::uint16_t port = 0;   ///< sockets

  [[nodiscard]] bool datagrams() const noexcept {
    return kind == EndpointKind::kUdpListen || kind == EndpointKind::kUdpSend;
  }
  /// Throws std::runtime_error naming the text and what is wrong with it. A serial path may contain colons. A host
  /// name is looked up here, once.
  static Endpoint parse(std::string_view text);
};

}  // namespace wasp::drivers
