#include "tools/rt_guest/prepare.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <iostream>
#include <sstream>
#include <vector>

#include "rt/clock.h"
#include "tools/child_process.h"
#include "tools/program_paths.h"
#include "tools/rt_guest/clip.h"

namespace wasp::tools::rt_guest {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kShownOutput = 3000;  // bytes of a failed step's output

const fs::path kSource = WASP_SOURCE_DIR;

fs::path cache_folder() {
  const char* xdg = std::getenv("XDG_CACHE_HOME");
  const char* home = std::getenv("HOME");
  const fs::path base =
      xdg != nullptr && *xdg != '\0' ? fs::path(xdg) : fs::path(home != nullptr ? home : "/tmp") / ".cache";
  return base / "wasp/rt_guest";
}

std::string end_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  const std::string all = text.str();
  return all.size() <= kShownOutput ? all : all.substr(all.size() - kShownOutput);
}

/// Runs one step to its end; its output goes to `log`. Returns the exit code.
int run_step(const std::string& what, const std::vector<std::string>& arguments, const fs::path& log) {
  std::cerr << what << " ... " << std::flush;
  const TimeNs start_ns = rt::now();
  fs::remove(log);
  ChildProcess step(arguments, log.string());
  while (!step.poll()) rt::sleep_until(rt::now() + 20 * kMillisecond);
  std::cerr << fmt::format("{:.0f} s\n", to_seconds(rt::now() - start_ns));
  return *step.poll();
}

void must_run(const std::string& what, const std::vector<std::string>& arguments, const fs::path& log) {
  if (const int code = run_step(what, arguments, log); code != 0)
    throw std::runtime_error(fmt::format("{}: exit code {}\n{}", what, code, end_of(log)));
}

fs::path fetch(const Plan& plan, const fs::path& work) {
  const fs::path folder = cache_folder() / plan.arch;
  const fs::path log = work / "fetch.txt";
  if (run_step("kernel and packages", {(kSource / "tools/rt_guest/fetch.sh").string(), plan.arch, folder.string()},
               log) != 0)
    throw Unavailable("the guest's kernel cannot be had:\n" + end_of(log));
  return folder;
}

/// The flight programs for the guest: the host's own for its architecture, else cross-built beside them.
fs::path build_flight(const Plan& plan, const fs::path& cache, const fs::path& work) {
  if (plan.arch == "amd64") return program_folder();
  const fs::path build = program_folder() / "rt_guest" / plan.arch / "build";
  const std::string cmake = find_program("cmake", "cmake");
  find_program("aarch64-linux-gnu-g++", "g++-aarch64-linux-gnu");
  must_run("configuring for " + plan.arch,
           {cmake, "-S", kSource.string(), "-B", build.string(), "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
            "--toolchain", (kSource / ("cmake/" + plan.arch + ".cmake")).string(),
            "-DWASP_ARM64_ROOT=" + (cache / "root").string(), "-DWASP_FLIGHT_ONLY=ON"},
           work / "configure.txt");
  must_run("building for " + plan.arch,
           {cmake, "--build", build.string(), "-j", "2", "--target", "wasp", "wasp-guard", "wasp-sim", "wasp-top",
            "wasp-faults"},
           work / "build.txt");
  return build;
}

void write_jobs(const Plan& plan, const fs::path& file) {
  std::ofstream out(file);
  for (const Job& job : plan.jobs) out << job.line() << "\n";
  if (!out.flush()) throw std::runtime_error("cannot write " + file.string());
}

void gather_config(const fs::path& folder) {
  fs::create_directories(folder);
  constexpr auto kReplace = fs::copy_options::overwrite_existing;
  fs::copy_file(kSource / "config/wasp.toml", folder / "wasp.toml", kReplace);
  fs::copy_file(kSource / "tools/rt_guest/guest.toml", folder / "guest.toml", kReplace);
}

}  // namespace

std::string find_program(const std::string& name, const std::string& package) {
  const char* path = std::getenv("PATH");
  std::stringstream folders(path != nullptr ? path : "/usr/bin:/bin");
  for (std::string folder; std::getline(folders, folder, ':');)
    if (const fs::path file = fs::path(folder) / name; access(file.c_str(), X_OK) == 0) return file.string();
  throw Unavailable("'" + name + "' is missing; install it with: sudo apt-get install " + package);
}

Image prepare(const Plan& plan, const fs::path& work) {
  if (!fs::exists(kSource / "tools/rt_guest/fetch.sh"))
    throw Unavailable("the guest is made from the source tree, and " + kSource.string() + " is not there");
  find_program("cpio", "cpio");
  find_program("readelf", "binutils");
  const fs::path cache = fetch(plan, work);
  const fs::path build = build_flight(plan, cache, work);
  const fs::path clip = work / "clip";
  if (!fs::exists(clip / "camera.toml")) {  // its last file
    std::cerr << "rendering the clip\n";
    make_clip(clip);
  }
  write_jobs(plan, work / "jobs");
  gather_config(work / "config");
  const fs::path initrd = work / "initrd";
  must_run("packing",
           {(kSource / "tools/rt_guest/pack.sh").string(), (cache / "root").string(), build.string(), clip.string(),
            (work / "config").string(), (work / "jobs").string(), initrd.string()},
           work / "pack.txt");
  std::string version;
  std::getline(std::ifstream(cache / "version") >> std::ws, version);
  return {cache / "vmlinuz", initrd, version, plan.cores};
}

}  // namespace wasp::tools::rt_guest
