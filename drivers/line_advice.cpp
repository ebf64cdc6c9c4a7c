#include "drivers/line_advice.h"

#include <grp.h>
#include <sys/stat.h>

#include <cerrno>

namespace wasp::drivers {
namespace {

/// The group that may use the device: dialout for serial lines on Debian.
std::string group_of(const std::string& path) {
  struct stat info {};
  if (stat(path.c_str(), &info) != 0 || info.st_gid == 0 || (info.st_mode & S_IWGRP) == 0) return "dialout";
  const group* g = getgrgid(info.st_gid);
  return g != nullptr ? g->gr_name : "dialout";
}

}  // namespace

std::string line_advice(const Endpoint& endpoint, int error) {
  const bool serial = endpoint.kind == EndpointKind::kSerial;
  if (serial && (error == EACCES || error == EPERM)) {
    const std::string group = group_of(endpoint.path);
    return "; who may use it is in the group " + group + ": sudo usermod -aG " + group + " $USER, then log in again";
  }
  if (serial && (error == EBUSY || error == EWOULDBLOCK))
    return "; another program has it open (sudo fuser -v " + endpoint.path + "; ModemManager looks at new modems)";
  if (serial && error == ENOENT) return "; is it plugged in? (ls /dev/serial/by-id)";
  if (serial && error == ENOTTY) return "; it is no serial line";
  if (error == EADDRINUSE) return "; another program listens there";
  if (error == ECONNREFUSED) return "; nobody listens there (yet)";
  return {};
}

}  // namespace wasp::drivers
