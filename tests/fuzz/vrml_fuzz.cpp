// VRML97 worlds. Promises: a world is read, or refused with an error that names the file; what is read is finite and
// within the documented bounds; whatever the library Coin dies of, this process goes on and says so.
//
// Worlds are read as users read them, by sim::VrmlReader's child, but one child reads many (a fork for each world gives
// 60 a second under the sanitizer). Its coverage counters are handed to libFuzzer. A death is tried again in a fresh
// child: it counts as the library's only when the innermost frame that is not of the C library or the sanitizer is
// Coin's; a death in code of ours, or a report of a sanitizer there, is a finding.
#include <dlfcn.h>
#include <execinfo.h>
#include <sanitizer/common_interface_defs.h>
#include <signal.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <stdexcept>

#include "sim/vrml_file.h"
#include "sim/vrml_reader.h"
#include "tests/fuzz/fuzz_input.h"
#include "tests/fuzz/scratch_file.h"

extern "C" char __start___sancov_cntrs, __stop___sancov_cntrs;  // of every file compiled for the fuzzer

namespace {

using namespace wasp;
constexpr int kWorldsOfAChild = 20'000;  // Coin leaks on worlds it refuses
constexpr std::string_view kLibrary = "the VRML library fails on this file";
constexpr int kOurs = 77;  // exit code of a child that died of code of ours; libFuzzer's limits have codes too

/// Seen by libFuzzer as more coverage: what the child's counters counted.
__attribute__((section("__libfuzzer_extra_counters"))) std::array<std::uint8_t, 1 << 17> counted;

std::span<std::uint8_t> counters() {
  auto* first = reinterpret_cast<std::uint8_t*>(&__start___sancov_cntrs);
  return {first, static_cast<std::size_t>(&__stop___sancov_cntrs - &__start___sancov_cntrs)};
}

std::uint8_t* shared_counters() {
  fuzz::require(counters().size() <= counted.size(), "the counters fit");
  void* shared = mmap(nullptr, counters().size(), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  fuzz::require(shared != MAP_FAILED, "memory can be shared");
  return static_cast<std::uint8_t*>(shared);
}

/// The file a frame lies in, or empty for frames of the C library and the sanitizer's runtime.
std::string_view blamed(void* frame) {
  static char text[1024];
  __sanitizer_symbolize_pc(frame, "%f", text, sizeof text);
  const std::string_view function = text;
  for (const char* runtime : {"interceptor", "__asan", "__sanitizer", "__ubsan", "__lsan", "__interception"})
    if (function.find(runtime) != std::string_view::npos) return {};
  Dl_info info{};
  if (dladdr(frame, &info) == 0 || info.dli_fname == nullptr) return "nowhere";
  const std::string_view object = info.dli_fname;
  for (const char* library : {"libc.so", "libm.so", "libgcc_s", "libstdc++", "ld-linux"})
    if (object.find(library) != std::string_view::npos) return {};
  return object;
}

bool coin_is_to_blame() {
  std::array<void*, 64> frames;
  const int n = backtrace(frames.data(), static_cast<int>(frames.size()));
  for (int i = 2; i < n; ++i)  // behind this function and the one that heard of the death
    if (const auto object = blamed(frames[static_cast<std::size_t>(i)]); !object.empty())
      return object.find("libCoin") != std::string_view::npos;
  return false;
}

void on_signal(int number) {
  if (!coin_is_to_blame()) _exit(kOurs);
  signal(number, SIG_DFL);
  raise(number);
}
void on_report() { on_signal(SIGABRT); }

/// In the child: Coin's reading between two accounts of the counters.
sim::Scene read_counted(const std::filesystem::path& file, std::uint8_t* shared) {
  static const bool armed = [] {
    for (const int s : {SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL}) {
      struct sigaction action {};
      action.sa_handler = on_signal;
      action.sa_flags = SA_ONSTACK | SA_NODEFER;
      sigaction(s, &action, nullptr);
    }
    __sanitizer_set_death_callback(on_report);
    return true;
  }();
  static_cast<void>(armed);
  const auto own = counters();
  std::fill(own.begin(), own.end(), 0);
  struct Account {
    std::span<std::uint8_t> own;
    std::uint8_t* shared;
    ~Account() { std::copy(own.begin(), own.end(), shared); }
  } account{own, shared};
  return sim::read_vrml_with_coin(file);
}

/// The reader that the fuzzer keeps, and what became of its children.
struct LongReader {
  std::uint8_t* shared = shared_counters();
  sim::VrmlReader reader{[this](const std::filesystem::path& file) { return read_counted(file, shared); }};
  int worlds = 0;
  long deaths = 0, of_earlier_worlds = 0;

  ~LongReader() {
    std::fprintf(stderr, "reader died of %ld worlds by the library, and %ld times of earlier worlds\n", deaths,
                 of_earlier_worlds);
  }
  sim::Scene read(const std::filesystem::path& file) {
    if (++worlds % kWorldsOfAChild == 0) reader.replace();
    const auto once = [&] {
      sim::Scene scene = reader.read(file);
      std::copy_n(shared, counters().size(), counted.begin());
      return scene;
    };
    try {
      return once();
    } catch (const std::runtime_error& error) {
      std::copy_n(shared, counters().size(), counted.begin());
      if (std::string_view(error.what()).find(kLibrary) == std::string_view::npos) throw;
    }
    try {  // of this world, or of what an earlier one left behind?
      sim::Scene scene = once();
      ++of_earlier_worlds;
      return scene;
    } catch (const std::runtime_error& error) {
      const std::string_view text = error.what();
      const bool dead = text.find(kLibrary) != std::string_view::npos;
      ++(dead ? deaths : of_earlier_worlds);
      fuzz::require(!dead || text.find("exit code") == std::string_view::npos,
                    "the reader does not die of code of ours");
      throw;
    }
  }
};

void check(const sim::Scene& scene) {
  fuzz::require(!scene.world.quads.empty() && scene.world.quads.size() == scene.world.surfaces.size(),
                "every face has a surface");
  for (const Vec3& v : scene.world.vertices_ned_m)
    fuzz::require(v.allFinite() && v.cwiseAbs().maxCoeff() <= 2e5f, "coordinates are finite and bounded");
  for (const auto& quad : scene.world.quads)
    for (const auto i : quad) fuzz::require(i < scene.world.vertices_ned_m.size(), "faces have their corners");
  for (const sim::Surface& s : scene.world.surfaces)
    fuzz::require(s.texture >= 0 && static_cast<std::size_t>(s.texture) < scene.world.textures.size(),
                  "faces have their textures");
  fuzz::require(scene.start_ned_m.allFinite() && std::isfinite(scene.start_yaw_rad), "the start is finite");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static fuzz::ScratchFile file(".wrl");
  static LongReader reader;
  file.write({data, size});
  try {
    check(reader.read(file.path()));
  } catch (const std::runtime_error& error) {
    fuzz::require_clear(error.what(), file.path().string());
  }
  return 0;
}
