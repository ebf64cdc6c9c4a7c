// The emulated machine, on virtual time: one processor at 500 million instructions a second, time standing still
// whenever the emulator does, so that latencies do not depend on the host. Several processors share the host's time,
// and nothing they say of latencies means anything: for what needs a second one.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "tools/rt_guest/console.h"
#include "tools/rt_guest/prepare.h"

namespace wasp::tools::rt_guest {

/// The command line. Throws Unavailable if the emulator is not installed.
std::vector<std::string> machine_arguments(const std::string& arch, const Image& image);

/// Boots, follows the console until the guest powers off, and returns what it said. `look` is called a few times a
/// second. Throws std::runtime_error with the console's last lines if the guest panics, falls
/// silent for `patience_s`, or ends before its jobs do.
Console boot(const std::string& arch, const Image& image, const std::filesystem::path& console_file, double patience_s,
             const std::function<void(const Console&)>& look);

}  // namespace wasp::tools::rt_guest
