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
#include "sim/pty.h"
#include "tools/child_process.h"
#include "tools/program_paths.h"
#include "types/messages.h"

namespace wasp::faults {
namespace {

namespace fs = std::filesystem;

constexpr double kPatience_s = 60;

/// The file `bad` holds `content`; the shell runs `command` with $wasp, $bad, $dir and $name. $good is a configuration
/// with a serial line, and a camera offers its streams, so that nothing else is missing.
struct StartRow {
  std::string_view what, content, command;
};

constexpr const char* kFlight = "$wasp flight --no-rt --instance $name --config $bad";

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
    StartRow{"no recording", "", "$wasp flight --no-rt --instance $name-r --config $good --replay $dir/absent"},
    StartRow{"empty recording", "",
             "mkdir $dir/rec; $wasp flight --no-rt --instance $name-r --config $good --replay $dir/rec"},
    StartRow{"broken recording", "1.0 depth/1.png\nnonsense\n",
             "mkdir $dir/rec; cp $bad $dir/rec/depth.txt; "
             "$wasp flight --no-rt --instance $name-r --config $good --replay $dir/rec"},
    StartRow{"broken world", "#VRML V2.0 utf8\nShape { geometry IndexedFaceSet { coord Coordinate { point [ 1 2",
             "$wasp sim --no-camera --instance $name --tty-link $dir/tty --seconds 1 --world $bad && "
             "$wasp sim --camera-only --instance $name --seconds 1 --world $bad"},
    StartRow{"broken sim config", "[vehicle]\nmass_kg = -3.0\n",
             "$wasp sim --no-camera --instance $name --tty-link $dir/tty --seconds 1 --config $bad"},
    StartRow{"broken timeline", "[[fault]]\nat_s = 1.0\nwhat = \"camera.levitate\"\nfor_s = 1.0\n",
             "$wasp flight --no-rt --instance $name --config $good --faults $bad"},
    StartRow{"timeline key", "[[fault]]\nat_s = 1.0\nwhat = \"camera.freeze\"\nfor_s = 1.0\nwhom = 3\n",
             "$wasp flight --no-rt --instance $name --config $good --faults $bad"},
    StartRow{"second flight", "", "$wasp flight --no-rt --instance $name --config $good"},
    StartRow{"memlock 8 MiB", "",
             "setpriv --bounding-set=-all --inh-caps=-all sh -c 'ulimit -l 8192; exec $wasp flight --instance $name "
             "--config $good'"},
    StartRow{"no priority", "",
             "setpriv --bounding-set=-all --inh-caps=-all sh -c 'ulimit -r 0; exec $wasp flight --instance $name "
             "--config $good'"},
    StartRow{"shm full", "",
             "unshare -m sh -c 'mount -t tmpfs -o size=64k tmpfs /dev/shm && exec $wasp flight --no-rt --instance "
             "$name --config $good'"},
    StartRow{"budget", "1000\n",
             "unshare -m sh -c 'mount --bind $bad /proc/sys/kernel/sched_rt_runtime_us && exec $wasp flight --instance "
             "$name --config $good'"},
    StartRow{"budget of the kernel", "",
             "kernel=/proc/sys/kernel/sched_rt_runtime_us; before=$(cat $kernel); echo 1000 >$kernel; $wasp flight "
             "--instance $name --config $good; code=$?; echo $before >$kernel; exit $code"},
    StartRow{"time namespace", "",
             "unshare --time --monotonic 3600 --fork $wasp flight --no-rt --instance $name --config $good"},
    StartRow{"stale layout", "", "$wasp flight --no-rt --instance $name --config $good"},
    StartRow{"no watchdog", "[guardian]\nwatchdog = \"/dev/absent\"\n",
             "$wasp guard --no-rt --instance $name --config $good --config $bad"},
    StartRow{"not a watchdog", "[guardian]\nwatchdog = \"/dev/null\"\n",
             "$wasp guard --no-rt --instance $name --config $good --config $bad"},
    StartRow{"no descriptors", "", "ulimit -n 6; exec $wasp flight --no-rt --instance $name --config $good"},
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

/// Over a word of a shared memory file, as another version of wasp would have written it.
void write_word(const std::string& region, std::size_t at, std::uint32_t value) {
  std::fstream file("/dev/shm/" + region, std::ios::binary | std::ios::in | std::ios::out);
  file.seekp(static_cast<std::streamoff>(at));
  file.write(reinterpret_cast<const char*>(&value), sizeof value);
}

/// What a flight needs besides its files, and for some cells a flight that is there already.
struct Surroundings {
  Surroundings(std::string_view what, const fs::path& folder, const std::string& name)
      : line((folder / "tty-good").string()), instance(name) {
    std::ofstream(folder / "good.toml") << "[autopilot]\nendpoint = \"serial:" << fs::absolute(folder).string()
                                        << "/tty-good:921600\"\n[guardian]\nrestarts = 0\n";
    using shm::TopicKind;
    const std::vector<shm::TopicSpec> streams{{shm::kGray, "Frame", TopicKind::kRing, 4, 4096},
                                              {shm::kDepth, "Frame", TopicKind::kRing, 4, 4096}};
    if (what != "broken world") camera = shm::Region::create(shm::camera_region(name), streams);
    if (what == "stale layout") write_word(shm::camera_region(name), offsetof(shm::RegionHeader, layout_version), 1);
    const std::vector<shm::TopicSpec> command{{shm::kCommand, "Command", TopicKind::kRing, 4, sizeof(Command)}};
    if (what == "second flight") flight = shm::Region::create(shm::flight_region(name), command);
  }
  ~Surroundings() {
    if (camera) shm::Region::remove(shm::camera_region(instance));
    if (flight) shm::Region::remove(shm::flight_region(instance));
  }
  Surroundings(const Surroundings&) = delete;
  Surroundings& operator=(const Surroundings&) = delete;

  sim::Pty line;
  std::string instance;
  std::optional<shm::Region> camera, flight;
};

std::string leftover(const std::string& instance) {
  for (const auto& entry : fs::directory_iterator("/dev/shm"))
    if (entry.path().filename().string().starts_with("wasp." + instance)) return entry.path().string();
  return {};
}

}  // namespace

StartResult try_start(const Fault& fault, const fs::path& folder, const std::string& instance) {
  const StartRow* row = find(fault.what);
  if (row == nullptr) return {0, {}, fmt::format("no start '{}'", fault.what)};
  fs::create_directories(folder);
  std::ofstream(folder / "bad", std::ios::binary) << row->content;
  const std::string log = (folder / "output.txt").string();
  const std::string script =
      fmt::format("wasp={}; dir={}; name={}; bad=$dir/bad; good=$dir/good.toml; export wasp dir name bad good; {}",
                  tools::program("wasp"), fs::absolute(folder).string(), instance, row->command);
  StartResult result;
  {
    const Surroundings surroundings(fault.what, folder, instance);
    tools::ChildProcess child({"/bin/sh", "-c", script}, log);
    const TimeNs deadline_ns = rt::now() + from_seconds(kPatience_s);
    while (!child.poll() && rt::now() < deadline_ns) rt::sleep_until(rt::now() + 5 * kMillisecond);
    if (!child.poll()) result.wrong = "it did not end";
    if (!child.poll()) kill(-child.pid(), SIGKILL);  // the shell and all that it started: they are one group
    result.exit_code = child.end(SIGKILL, 5);
  }
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
