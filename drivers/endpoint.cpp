#include "drivers/endpoint.h"

#include <arpa/inet.h>
#include <netdb.h>
#include <sys/socket.h>

#include <array>
#include <charconv>
#include <stdexcept>

#include "drivers/serial_line.h"

namespace wasp::drivers {
namespace {

struct Scheme {
  std::string_view prefix;
  EndpointKind kind;
  const char* form;
};
constexpr std::array kSchemes{
    Scheme{"serial:", EndpointKind::kSerial, "serial:<device>:<baud>, for example serial:/dev/ttyUSB0:921600"},
    Scheme{"udp://", EndpointKind::kUdpListen, "udp://<own address>:<port>, for example udp://127.0.0.1:14540"},
    Scheme{"udpout://", EndpointKind::kUdpSend, "udpout://<host>:<port>, for example udpout://192.168.1.5:14550"},
    Scheme{"tcp://", EndpointKind::kTcp, "tcp://<host>:<port>, for example tcp://127.0.0.1:5760"}};

[[noreturn]] void refuse(std::string_view text, const std::string& why) {
  throw std::runtime_error("endpoint \"" + std::string(text) + "\": " + why);
}

template <class Number>
bool whole_number(std::string_view text, Number& value) {
  const auto [end, error] = std::from_chars(text.begin(), text.end(), value);
  return error == std::errc{} && end == text.end();
}

Endpoint serial(std::string_view text, std::string_view device, std::string_view baud) {
  Endpoint endpoint{std::string(device), 0};
  if (endpoint.path.front() != '/') refuse(text, "device \"" + endpoint.path + "\" is not an absolute path");
  if (!whole_number(baud, endpoint.baud)) refuse(text, "baud rate \"" + std::string(baud) + "\" is not a number");
  if (!has_baud_rate(endpoint.baud)) refuse(text, "baud rate " + std::string(baud) + " is not one termios has");
  return endpoint;
}

/// IPv4 address of a host name or of dotted numbers.
std::uint32_t look_up(std::string_view text, const std::string& host) {
  addrinfo wanted{};
  wanted.ai_family = AF_INET;
  addrinfo* found = nullptr;
  if (const int error = getaddrinfo(host.c_str(), nullptr, &wanted, &found); error != 0)
    refuse(text, "host \"" + host + "\": " + gai_strerror(error));
  const std::uint32_t address = ntohl(reinterpret_cast<const sockaddr_in*>(found->ai_addr)->sin_addr.s_addr);
  freeaddrinfo(found);
  return address;
}

Endpoint socket(std::string_view text, EndpointKind kind, std::string_view host, std::string_view port) {
  Endpoint endpoint{std::string(text), 0, kind};
  if (!whole_number(port, endpoint.port) || endpoint.port == 0)
    refuse(text, "port \"" + std::string(port) + "\" is not a number from 1 to 65535");
  if (host.empty() && kind != EndpointKind::kUdpListen) refuse(text, "no host");
  if (!host.empty()) endpoint.host = look_up(text, std::string(host));
  return endpoint;
}

}  // namespace

Endpoint Endpoint::parse(std::string_view text) {
  for (const Scheme& scheme : kSchemes) {
    if (!text.starts_with(scheme.prefix)) continue;
    const std::string_view rest = text.substr(scheme.prefix.size());
    const auto colon = rest.rfind(':');
    const bool is_serial = scheme.kind == EndpointKind::kSerial;
    if (colon == std::string_view::npos || (is_serial && colon == 0))
      refuse(text, std::string("expected ") + scheme.form);
    return is_serial ? serial(text, rest.substr(0, colon), rest.substr(colon + 1))
                     : socket(text, scheme.kind, rest.substr(0, colon), rest.substr(colon + 1));
  }
  std::string forms;
  for (const Scheme& scheme : kSchemes) forms += (forms.empty() ? "" : "; ") + std::string(scheme.form);
  refuse(text, "expected one of " + forms);
}

}  // namespace wasp::drivers
