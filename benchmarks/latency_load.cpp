#include "benchmarks/latency_load.h"

#include <unistd.h>

#include <filesystem>
#include <stdexcept>

#include "rt/thread.h"

namespace wasp::bench {

std::vector<std::string> load_arguments(const std::string& program, const std::string& load, int cores,
                                        const std::string& folder) {
  const std::string n = std::to_string(cores);
  std::vector<std::string> a{"/usr/bin/nice", "-n", "19", program, "--temp-path", folder, "--quiet"};
  if (load == "cpu")
    a.insert(a.end(), {"--cpu", n});
  else if (load == "memory")  // page faults, unmapping and bandwidth
    a.insert(a.end(), {"--vm", n, "--vm-bytes", "128M", "--stream", "1"});
  else if (load == "io")  // written, flushed and read again
    a.insert(a.end(), {"--hdd", n, "--hdd-bytes", "64M", "--iomix", "1", "--iomix-bytes", "64M", "--io", "1"});
  else
    a.clear();
  return a;
}

Load::Load(const std::string& load) {
  const std::string program = "/usr/bin/stress-ng";
  const auto arguments =
      load_arguments(program, load, rt::usable_cores(), std::filesystem::temp_directory_path().string());
  if (arguments.empty()) return;
  if (access(program.c_str(), X_OK) != 0)
    throw std::runtime_error("load '" + load + "' needs stress-ng: sudo apt-get install stress-ng");
  child_.emplace(arguments, "/dev/null");
}

bool Load::running() { return !child_ || !child_->poll(); }

}  // namespace wasp::bench
