#include "tools/rt_guest/machine.h"

#include <fmt/format.h>
#include <signal.h>

#include <array>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>

#include "rt/clock.h"
#include "tools/child_process.h"

namespace wasp::tools::rt_guest {
namespace {

namespace fs = std::filesystem;

constexpr const char* kKernelWords = "quiet loglevel=1 panic=-1 rdinit=/init";

[[noreturn]] void fail(const std::string& what, const Console& console) {
  std::string text = what + "; its console ended with:";
  for (const auto& line : console.tail()) text += "\n  " + line;
  throw std::runtime_error(text);
}

std::vector<std::string> split(const std::string& words) {
  std::istringstream in(words);
  return {std::istream_iterator<std::string>(in), {}};
}

/// Hands on what has been written to the file since the last look. True if there was anything.
bool follow(std::ifstream& file, Console& console) {
  bool any = false;
  std::array<char, 16384> bytes;
  for (;;) {
    file.clear();
    file.read(bytes.data(), bytes.size());
    if (file.gcount() <= 0) return any;
    console.feed({bytes.data(), static_cast<std::size_t>(file.gcount())});
    any = true;
  }
}

}  // namespace

std::vector<std::string> machine_arguments(const std::string& arch, const Image& image) {
  const bool arm = arch == "arm64";
  std::string words =
      arm ? find_program("qemu-system-aarch64", "qemu-system-arm") + " -machine virt,gic-version=3 -cpu cortex-a72"
          : find_program("qemu-system-x86_64", "qemu-system-x86") + " -machine q35 -cpu max";
  words += image.cores == 1 ? " -smp 1 -accel tcg,thread=single,tb-size=256 -icount shift=1,sleep=off"
                            : fmt::format(" -smp {} -accel tcg,thread=multi,tb-size=256", image.cores);
  words += " -m 1024";
  if (!arm) words += " -device i6300esb";  // a hardware watchdog; it resets, and a reset is the emulator's end
  words += " -nodefaults -no-reboot -display none -monitor none -serial stdio";
  std::vector<std::string> arguments = split(words);
  const std::string console = arm ? "console=ttyAMA0,115200 " : "console=ttyS0,115200 tsc=reliable no_timer_check ";
  arguments.insert(arguments.end(), {"-kernel", image.kernel.string(), "-initrd", image.initrd.string(), "-append",
                                     console + kKernelWords});
  return arguments;
}

Console boot(const std::string& arch, const Image& image, const fs::path& console_file, double patience_s,
             const std::function<void(const Console&)>& look) {
  Console console;
  std::ofstream(console_file, std::ios::trunc).flush();
  ChildProcess machine(machine_arguments(arch, image), console_file.string());
  std::ifstream file(console_file, std::ios::binary);
  TimeNs heard_ns = rt::now();
  for (;;) {
    const bool over = machine.poll().has_value();
    if (follow(file, console)) heard_ns = rt::now();
    if (over) {
      console.machine_ended();
      break;
    }
    look(console);
    if (console.ended()) {  // nothing left but to power off
      machine.end(SIGTERM, 20.0);
      return console;
    }
    if (rt::now() - heard_ns > from_seconds(patience_s))
      fail(fmt::format("the guest was silent for {:.0f} s", patience_s), console);
    rt::sleep_until(rt::now() + 200 * kMillisecond);
  }
  if (!console.ended())
    fail(fmt::format("the guest ended before its jobs did (emulator exit code {})", machine.poll().value_or(-1)),
         console);
  return console;
}

}  // namespace wasp::tools::rt_guest
