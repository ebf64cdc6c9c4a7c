// Faults that come before a flight can begin: hostile files, missing rights, full disks. A program is run with them and
// must refuse: an exit code that is not 0 and no signal, the cause by name, and nothing half-written.
#pragma once

#include <filesystem>
#include <string>

#include "faults/fault.h"

namespace wasp::faults {

struct StartResult {
  int exit_code = 0;
  std::string output;
  std::string wrong;  ///< empty: it refused as promised
};

/// `folder` is this cell's own, `instance` its name in shared memory.
StartResult try_start(const Fault& fault, const std::filesystem::path& folder, const std::string& instance);

}  // namespace wasp::faults
