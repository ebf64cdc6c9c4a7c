#include "faults/start_cell.h"

#include <fmt/format.h>
#include <signal.h>

#include <array>
#include <fstream>
#include <optional>
#include <regex>
#include <sstream>

#include "rt/clock.h"
#include "shm/region.h"
#include "shm/topics.h"
#include "tools/child_process.h"
#include "tools/program_paths.h"

namespace wasp::faults {
namespace {

namespace fs = std::filesystem;

constexpr double kPatience_s = 60;

/// The file `bad` holds `content`; the shell runs `command` with $wasp, $bad, $dir and $name.
struct StartRow {
  std::string_view what, content, command;
};

constexpr const char* kFlight = "$wasp flight --no-rt --instance $name --config $bad";
constexpr const char* kGoodLine = "[autopilot]\nendpoint = \"serial:/dev/null:115200\"\n";

constexpr std::array kRows = {
    StartRow{"unknown key", "[control]\nrate_hx = 20.0\n", kFlight},
    StartRow{"out of range", "[control]\nrate_hz = -1.0\n", kFlight},
    StartRow{"not a number", "[control]\nmax_tilt_deg = nan\n", kFlight},
    StartRow{"wrong type", "[control]\nrate_hz = \"fast\"\n", kFlight},
    StartRow{"not TOML", "[control\nrate_hz = = 20\n", kFlight},
    StartRow{"key twice", "[control]\nrate_hz = 20.0\nrate_hz = 30.0\n", kFlight},
    StartRow{"binary", "\x7f\x45\x4c\x46\x01\x02\x03\xff\xfe\xfd", kFlight},
    StartRow{"no such behaviour", "[behaviour.levitation]\nenabled = true\n", kFlight},
    StartRow{"no such file", "", "$wasp flight --no-rt --instance $name --config $dir/absent.toml"},
    StartRow{"no serial line", "[autopilot]\nendpoint = \"serial:/dev/absent:921600\"\n", kFlight},
    StartRow{"no baud rate", "[autopilot]\nendpoint = \"serial:/dev/ttyS0:12345\"\n", kFlight},
    StartRow{"no recording", "", "$wasp flight --no-rt --instance $name --replay $dir/absent"},
    StartRow{"empty recording", "", "mkdir $dir/rec; $wasp flight --no-rt --instance $name --replay $dir/rec"},
    StartRow{"broken recording", "1.0 depth/1.png\nnonsense\n",
             "mkdir $dir/rec; cp $bad $dir/rec/depth.txt; $wasp flight --no-rt --instance $name --replay $dir/rec"},
    StartRow{"broken world", "#VRML V2.0 utf8\nShape { geometry IndexedFaceSet { coord Coordinate { point [ 1 2",
             "$wasp sim --no-camera --instance $name --tty-link $dir/tty --seconds 1 --world $bad && "
             "$wasp sim --camera-only --instance $name --seconds 1 --world $bad"},
    StartRow{"broken sim config", "[vehicle]\nmass_kg = -3.0\n",
             "$wasp sim --no-camera --instance $name --tty-link $dir/tty --seconds 1 --config $bad"},
    StartRow{"broken timeline", "[[fault]]\nat_s = 1.0\nwhat = \"camera.levitate\"\nfor_s = 1.0\n",
             "$wasp flight --no-rt --instance $name --faults $bad"},
    StartRow{"timeline key", "[[fault]]\nat_s = 1.0\nwhat = \"camera.freeze\"\nfor_s = 1.0\nwhom = 3\n",
             "$wasp flight --no-rt --instance $name --faults $bad"},
    StartRow{"second flight", kGoodLine, kFlight},
    StartRow{"memlock 8 MiB", "",
             "setpriv --bounding-set=-all --inh-caps=-all sh -c 'ulimit -l 8192; exec $wasp flight --instance $name'"},
    StartRow{"no priority", "",
             "setpriv --bounding-set=-all --inh-caps=-all sh -c 'ulimit -r 0; exec $wasp flight --instance $name'"},
    StartRow{
        "shm full", "",
        "unshare -m sh -c 'mount -t tmpfs -o size=64k tmpfs /dev/shm && exec $wasp flight --no-rt --instance $name'"},
    StartRow{"no descriptors", "", "ulimit -n 4; exec $wasp flight --no-rt --instance $name"},
    StartRow{"disk full", "",
             "mkdir $dir/small; unshare -m sh -c 'mount -t tmpfs -o size=4k tmpfs $dir/small && exec $wasp record "
             "--instance $name --out $dir/small/a/b/c/d'"},
};

const StartRow* find(std::string_view what) {
  for (const StartRow& row : kRows)
    if (row.what == what) return &row;
  return nullptr;
}

std::string read_all(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

/// Somebody else already writes the flight's region.
std::optional<shm::Region> occupy(std::string_view what, const std::string& instance) {
  if (what != "second flight") return std::nullopt;
  const shm::TopicSpec topic{shm::kCommand, "Command", shm::TopicKind::kRing, 4, 64};
  return shm::Region::create(shm::flight_region(instance), {&topic, 1});
}

std::string leftover(const std::string& instance) {
  for (const auto& entry : fs::directory_iterator("/dev/shm"))
    if (entry.path().filename().string().starts_with("wasp." + instance + ".")) return entry.path().string();
  return {};
}

}  // namespace

StartResult try_start(const Fault& fault, const fs::path& folder, const std::string& instance) {
  const StartRow* row = find(fault.what);
  if (row == nullptr) return {0, {}, fmt::format("no start '{}'", fault.what)};
  fs::create_directories(folder);
  std::ofstream(folder / "bad", std::ios::binary) << row->content;
  const std::string log = (folder / "output.txt").string();
  std::string script =
      fmt::format("wasp={} bad={} dir={} name={}; export wasp bad dir name; {}", tools::program("wasp"),
                  (folder / "bad").string(), fs::absolute(folder).string(), instance, row->command);
  StartResult result;
  {
    const auto other = occupy(fault.what, instance);
    tools::ChildProcess child({"/bin/sh", "-c", script}, log);
    const TimeNs deadline_ns = rt::now() + from_seconds(kPatience_s);
    while (!child.poll() && rt::now() < deadline_ns) rt::sleep_until(rt::now() + 5 * kMillisecond);
    if (!child.poll()) result.wrong = "it did not end";
    result.exit_code = child.end(SIGTERM, 5);
  }
  if (fault.what == "second flight") shm::Region::remove(shm::flight_region(instance));
  result.output = read_all(log);
  if (!result.wrong.empty()) return result;
  if (result.exit_code == 0) result.wrong = "exit code 0";
  if (result.exit_code >= 126) result.wrong = fmt::format("ended by force, code {}", result.exit_code);
  if (!std::regex_search(result.output, std::regex(std::string(fault.says), std::regex::icase)))
    result.wrong = fmt::format("does not say '{}'", fault.says);
  if (const std::string left = leftover(instance); !left.empty()) result.wrong = "leaves " + left;
  return result;
}

}  // namespace wasp::faults
