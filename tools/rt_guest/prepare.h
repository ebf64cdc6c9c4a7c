// Everything one boot needs: kernel and packages fetched, flight programs built for the guest, frames rendered, all
// packed. What is there already is not made again.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>

#include "tools/rt_guest/plan.h"

namespace wasp::tools::rt_guest {

/// The guest cannot be had on this machine: a program or the network is missing. Not a failed measurement.
struct Unavailable : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct Image {
  std::filesystem::path kernel, initrd;
  std::string kernel_package;
  int cores = 1;
};

/// `work` is a folder of this run's own. Says each step on standard error. Throws Unavailable, or std::runtime_error
/// with the end of the step's output.
Image prepare(const Plan& plan, const std::filesystem::path& work);

/// Path of a program in $PATH; throws Unavailable naming the Debian package that has it.
std::string find_program(const std::string& name, const std::string& package);

}  // namespace wasp::tools::rt_guest
