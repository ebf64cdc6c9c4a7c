// The programs as a user runs them. No bound on time or accuracy here (the host may be slow): what must come out, comes
// out, and what must be refused, is refused by name. Accuracy is judged on virtual time in lockstep_hover_test.cpp.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <span>
#include <sstream>

#include "drivers/image_file.h"
#include "shm/region.h"
#include "shm/topics.h"
#include "tests/tools/program.h"
#include "tools/csv_table.h"

namespace wasp::test {
namespace {

namespace fs = std::filesystem;

const std::string kWasp = program_path("wasp");

/// A unique run name: regions in shared memory carry it.
std::string unique(const std::string& stem) { return stem + "-" + std::to_string(getpid()); }

std::string fly(const TemporaryFolder& out, const std::string& name, const std::string& options) {
  return kWasp + " fly --no-rt --out " + out.path.string() + " --name " + name + " " + options + " 2>&1";
}

/// Flies until a mission comes to its end, three times at most: a host that stands still for seconds can break one off,
/// a defect breaks all. Returns the name of the last run.
std::string fly_to_the_end(const TemporaryFolder& out, const std::string& stem, const std::string& options,
                           const std::string& environment = {}) {
  std::string name;
  for (int attempt = 0; attempt < 3; ++attempt) {
    name = unique(stem) + "-" + std::to_string(attempt);
    run_shell(environment + " " + fly(out, name, options));
    if (read_text(out.path / name / "log/flight.txt").find("mission flown to its end") != std::string::npos) break;
  }
  return name;
}

/// Cues by behaviour and frame: everything the step said, as text to the bit.
std::map<std::string, std::string> cue_bodies(const fs::path& csv) {
  std::map<std::string, std::string> bodies;
  const auto table = tools::CsvTable::read(csv);
  if (!table) return bodies;
  const std::size_t name = *table->column("behaviour"), frame = *table->column("frame_sequence");
  const std::size_t first = *table->column("validity"), last = *table->column("detail_7");
  for (std::size_t r = 0; r < table->rows(); ++r) {
    std::string body;
    for (std::size_t c = first; c <= last; ++c) body += std::string(table->text(r, c)) + ",";
    bodies[std::string(table->text(r, name)) + "#" + std::string(table->text(r, frame))] = body;
  }
  return bodies;
}

/// A serial line with nobody sensible at the other end.
class PseudoTerminal {
 public:
  explicit PseudoTerminal(const fs::path& link) : master_(posix_openpt(O_RDWR | O_NOCTTY)) {
    grantpt(master_);
    unlockpt(master_);
    fs::create_symlink(ptsname(master_), link);
    slave_ = open(ptsname(master_), O_RDWR | O_NOCTTY);  // keeps the line alive while nobody else has it open
    fcntl(master_, F_SETFL, O_NONBLOCK);
  }
  ~PseudoTerminal() {
    close(slave_);
    close(master_);
  }
  PseudoTerminal(const PseudoTerminal&) = delete;
  PseudoTerminal& operator=(const PseudoTerminal&) = delete;
  /// Writes what fits, throws away what came.
  void write(std::span<const std::uint8_t> bytes) {
    if (::write(master_, bytes.data(), bytes.size()) < 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    std::array<char, 4096> sink;
    while (::read(master_, sink.data(), sink.size()) > 0) {
    }
  }

 private:
  int master_, slave_ = -1;
};

/// A camera that offers its streams and never shows a frame.
class CameraOfNothing {
 public:
  explicit CameraOfNothing(const std::string& instance)
      : name_(shm::camera_region(instance)), region_(shm::Region::create(name_, topics())) {}
  ~CameraOfNothing() { shm::Region::remove(name_); }
  CameraOfNothing(const CameraOfNothing&) = delete;
  CameraOfNothing& operator=(const CameraOfNothing&) = delete;

 private:
  static std::vector<shm::TopicSpec> topics() {
    return {{shm::kGray, "Frame", shm::TopicKind::kRing, 4, 4096},
            {shm::kDepth, "Frame", shm::TopicKind::kRing, 4, 4096}};
  }
  std::string name_;
  shm::Region region_;
};

void write_flight_config(const fs::path& path, const fs::path& tty, bool enforce) {
  std::ofstream(path) << "[run]\nenforce_real_time = " << (enforce ? "true" : "false")
                      << "\n[autopilot]\nendpoint = \"serial:" << tty.string()
                      << ":115200\"\n[mission]\npatience_s = 3.0\n";
}

TEST(Fly, RecordsReportsAndItsReplayGivesTheSameCuesToTheBit) {
  TemporaryFolder out;
  const std::string name = unique("rec"), again = unique("rep");
  const fs::path config = out.path / "flow.toml";  // a flow field and two who read it, beside the two that always fly
  std::ofstream(config) << "[behaviour.flow_field]\nenabled = true\n[behaviour.odometry]\nenabled = true\n"
                           "[behaviour.time_to_contact]\nenabled = true\n";
  const std::string with_flow = " --config " + config.string();
  const auto [text, code] = run_shell(fly(out, name, "--seconds 5 --record --json" + with_flow));
  const fs::path run = out.path / name;
  ASSERT_TRUE(fs::exists(run / "report.html")) << text;
  EXPECT_NE(read_text(run / "report.html").find("<svg"), std::string::npos);
  const auto document = nlohmann::json::parse(read_text(run / "run.json"));
  EXPECT_FALSE(document["real_time"].get<bool>());
  EXPECT_FALSE(document["kernel"].get<std::string>().empty());
  EXPECT_FALSE(document.contains("faults"));  // nobody asked for any
  EXPECT_FALSE(nlohmann::json::parse(read_text(run / "log/stages.json"))["run"]["faults_armed"].get<bool>());
  EXPECT_EQ(read_text(run / "log/flight.txt").find("FAULTS ARMED"), std::string::npos);
  std::istringstream lines(text);
  int objects = 0;
  for (std::string line; std::getline(lines, line);)
    if (line.starts_with("{")) {
      const auto result = nlohmann::json::parse(line);
      for (const char* key : {"name", "value", "unit", "bar", "ok"}) EXPECT_TRUE(result.contains(key)) << line;
      ++objects;
    }
  EXPECT_GT(objects, 5);

  const auto live = cue_bodies(run / "recording/cues.csv");
  ASSERT_GT(live.size(), 50u);
  EXPECT_TRUE(std::ranges::any_of(live, [](const auto& cue) { return cue.first.starts_with("time_to_contact#"); }));
  const auto lost = nlohmann::json::parse(read_text(run / "log/record.json"));
  run_shell(fly(out, again, "--replay " + (run / "recording").string() + with_flow));
  const auto replayed = cue_bodies(out.path / again / "log/cues.csv");
  // What the recorder lost (it says so) cannot be replayed; without loss every cue must come back to the bit.
  std::uint64_t lost_count = 0;
  for (const auto& topic : lost["topics"])
    lost_count += topic["lost"].get<std::uint64_t>() + topic["before_attach"].get<std::uint64_t>();
  if (lost_count > 0)
    GTEST_SKIP() << "the recorder lost " << lost_count << " samples on this busy host: " << lost.dump();
  EXPECT_EQ(live, replayed);
}

TEST(Fly, InterruptLandsInOrderAndStillWritesTheReport) {
  TemporaryFolder out;
  bool landed = false;
  for (int attempt = 0; attempt < 3 && !landed; ++attempt) {  // a host that stands still can break one mission off
    const std::string name = unique("int") + "-" + std::to_string(attempt);
    Program program(
        {kWasp, "fly", "--no-rt", "--json", "--out", out.path.string(), "--name", name, "--seconds", "600"});
    const fs::path commands = out.path / name / "log/commands.csv";
    ASSERT_TRUE(eventually([&] { return read_text(commands).find(",behaviour,") != std::string::npos; }));
    program.signal(SIGINT);
    const int code = program.wait();
    ASSERT_TRUE(fs::exists(out.path / name / "report.html"));
    const auto document = nlohmann::json::parse(read_text(out.path / name / "run.json"));
    EXPECT_NE(document["exit_reason"].get<std::string>().find("interrupted"), std::string::npos);
    landed = read_text(out.path / name / "log/flight.txt").find("mission stopped early, in order") != std::string::npos;
    EXPECT_NE(code, 0);  // it was not flown to its end: no success, but
    if (landed) {
      EXPECT_TRUE(code == 4 || code == 1) << code;  // 4: nothing failed; 1: this host missed deadlines
    }
  }
  EXPECT_TRUE(landed);
}

TEST(Fly, AReplayThatNoBehaviourEverCommandsIsNoSuccess) {
  TemporaryFolder out;
  const fs::path folder = out.path / "black";
  fs::create_directories(folder / "depth");
  std::vector<std::uint16_t> nothing(640 * 480, 0);
  for (int i = 0; i < 45; ++i) {
    const std::string name = "depth/" + std::to_string(i) + ".png";
    drivers::save_png(folder / name, DepthView{nothing.data(), 640, 480, 640});
    std::ofstream(folder / "depth.txt", std::ios::app) << static_cast<double>(i) / 30.0 << " " << name << "\n";
  }
  const std::string name = unique("black");
  const auto [text, code] = run_shell(fly(out, name, "--replay " + folder.string()));
  EXPECT_NE(code, 0) << text;
  const std::string log = read_text(out.path / name / "log/flight.txt");
  EXPECT_NE(log.find("no behaviour ever commanded"), std::string::npos) << log << text;
}

TEST(Fly, RealTimeThreadsAllocateNothingAndKeepToTheirSystemCalls) {
  TemporaryFolder out;
  const std::string guard = std::string("LD_PRELOAD=") + WASP_BINARY_DIR +
                            "/lib/libwasp_malloc_guard.so WASP_MALLOC_GUARD_OUT=" + (out.path / "guard.txt").string();
  const std::string name = fly_to_the_end(out, "strict", "--seconds 4 --strict-syscalls", guard);
  const std::string log = read_text(out.path / name / "log/flight.txt");
  EXPECT_NE(log.find("mission flown to its end"), std::string::npos) << log;  // SIGSYS would have ended it
  const std::string guarded = read_text(out.path / "guard.txt");  // written by the one program with real-time code
  ASSERT_FALSE(guarded.empty());
  EXPECT_EQ(guarded.find("violations 0"), 0u) << guarded;
}

/// The whole conversation signed, both ways required, and the signing part of the real-time loops without the heap.
TEST(Fly, OnASignedLine) {
  TemporaryFolder out;
  const std::string guard = std::string("LD_PRELOAD=") + WASP_BINARY_DIR +
                            "/lib/libwasp_malloc_guard.so WASP_MALLOC_GUARD_OUT=" + (out.path / "guard.txt").string();
  const fs::path key = out.path / "key", config = out.path / "signed.toml";
  std::ofstream(key) << std::string(64, '7') << "\n";
  fs::permissions(key, fs::perms::owner_read | fs::perms::owner_write);
  std::ofstream(config) << "[autopilot]\nsigning = \"require\"\nsigning_key_file = \"" << key.string() << "\"\n";
  const std::string name = fly_to_the_end(out, "signed", "--seconds 4 --config " + config.string(), guard);
  const std::string log = read_text(out.path / name / "log/flight.txt");
  EXPECT_NE(log.find("mission flown to its end"), std::string::npos) << log;
  EXPECT_NE(log.find("the autopilot's line is signed"), std::string::npos) << log;
  EXPECT_EQ(log.find("frames refused"), std::string::npos) << log;
  EXPECT_EQ(log.find(std::string(8, '7')), std::string::npos) << "the key is never logged";
  EXPECT_GT(std::stoull(read_text(key.string() + ".time")), 0u);
  const std::string guarded = read_text(out.path / "guard.txt");
  EXPECT_EQ(guarded.find("violations 0"), 0u) << guarded;
}

TEST(Fly, TheShippedExampleIsMadeByOurSimulatorAndReplays) {
  TemporaryFolder out;
  const auto [text, code] = run_shell(fly(out, unique("ex"), "--replay example --seconds 3"));
  EXPECT_TRUE(fs::exists(out.path / "example/recording/depth.txt")) << text;
  EXPECT_NE(text.find("tum"), std::string::npos) << text;
}

class RealRecording : public ::testing::TestWithParam<const char*> {};

TEST_P(RealRecording, Replays) {
  const fs::path folder = fs::path(WASP_SOURCE_DIR) / "../shared/data" / GetParam();
  if (!fs::exists(folder)) GTEST_SKIP() << "no recording at " << folder;
  TemporaryFolder out;
  std::string leaf = GetParam();
  std::replace(leaf.begin(), leaf.end(), '/', '-');
  const std::string name = fly_to_the_end(out, leaf, "--seconds 3 --replay " + folder.string());
  const std::string log = read_text(out.path / name / "log/flight.txt");
  EXPECT_NE(log.find("mission flown to its end"), std::string::npos) << log;
  const auto cues = tools::CsvTable::read(out.path / name / "log/cues.csv");
  ASSERT_TRUE(cues.has_value());
  EXPECT_GT(cues->rows(), 20u);
  const auto commands = tools::CsvTable::read(out.path / name / "log/commands.csv");
  ASSERT_TRUE(commands.has_value());
  EXPECT_GT(commands->rows(), 20u);
  const auto modes = commands->texts("mode_name");
  if (std::string(GetParam()) != "rgbd_tum_pair") {  // a desk, no floor: rightly no behaviour commands
    EXPECT_NE(std::find(modes.begin(), modes.end(), "behaviour"), modes.end());
  }
}

INSTANTIATE_TEST_SUITE_P(Data, RealRecording,
                         ::testing::Values("kinect_7scenes_redkitchen", "kinect_floor_pcl", "rgbd_tum_pair",
                                           "hover_mocap", "hover_mocap/descend"),
                         [](const auto& param) {
                           std::string name = param.param;
                           std::replace(name.begin(), name.end(), '/', '_');
                           return name;
                         });

/// Runs a command line that must fail and say why.
void expect_refusal(const std::string& command, const std::string& word) {
  const auto [text, code] = run_shell(command);
  EXPECT_NE(code, 0) << command << "\n" << text;
  EXPECT_LT(code, 128) << command << "\n" << text;
  EXPECT_NE(text.find(word), std::string::npos) << command << "\n" << text;
}

TEST(Fly, FaultsByTimelineAreSaidInLogRunAndReportAndLeaveNothingBehind) {
  TemporaryFolder out;
  const fs::path timeline = out.path / "t.toml";
  std::ofstream(timeline) << "[[fault]]\nat_s = 0.5\nafter = \"flying\"\nwhat = \"image.noise\"\nfor_s = 0.5\n"
                             "[[fault]]\nat_s = 0.5\nafter = \"flying\"\nwhat = \"imu.slow\"\nfor_s = 0.3\n";
  const std::string name = fly_to_the_end(out, "faults", "--seconds 4 --faults " + timeline.string());
  const fs::path run = out.path / name;
  const std::string log = read_text(run / "log/flight.txt");
  for (const char* words : {"FAULTS ARMED: timeline", "fault: image.noise on for 0.5 s", "fault: image.noise off",
                            "fault: imu.slow on for 0.3 s, 10 Hz", "fault: imu.slow off"})
    EXPECT_NE(log.find(words), std::string::npos) << words << "\n" << log;
  EXPECT_NE(nlohmann::json::parse(read_text(run / "run.json"))["faults"].get<std::string>().find("t.toml"),
            std::string::npos);
  EXPECT_TRUE(nlohmann::json::parse(read_text(run / "log/stages.json"))["run"]["faults_armed"].get<bool>());
  EXPECT_NE(read_text(run / "report.html").find("FAULTS ARMED"), std::string::npos);
  EXPECT_FALSE(fs::exists(run / "faults.sock"));
  EXPECT_TRUE(shm::Region::list(shm::relay_region(name)).empty());
}

/// Nobody's port at this moment.
int free_udp_port() {
  const int fd = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in a{};
  a.sin_family = AF_INET;
  a.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof a;
  EXPECT_EQ(bind(fd, reinterpret_cast<const sockaddr*>(&a), sizeof a), 0);
  getsockname(fd, reinterpret_cast<sockaddr*>(&a), &size);
  close(fd);
  return ntohs(a.sin_port);
}

struct OtherAutopilot {
  const char* flavour;
  bool udp;
};
class FlyAs : public ::testing::TestWithParam<OtherAutopilot> {};

TEST_P(FlyAs, TheSameProgramWithNothingButItsConfiguration) {
  const TemporaryFolder out;
  std::string options = std::string("--seconds 16 --autopilot ") + GetParam().flavour;
  if (GetParam().udp) options += " --udp " + std::to_string(free_udp_port());
  const std::string name = fly_to_the_end(out, GetParam().flavour, options);
  const std::string log = read_text(out.path / name / "log/flight.txt");
  EXPECT_NE(log.find("mission flown to its end"), std::string::npos) << log;
  EXPECT_NE(log.find(std::string("autopilot heard: ") + GetParam().flavour), std::string::npos) << log;
  EXPECT_NE(log.find("ready; its failsafe: after "), std::string::npos) << log;
  const auto run = nlohmann::json::parse(read_text(out.path / name / "run.json"));
  EXPECT_NE(run.value("autopilot", "").find("ready"), std::string::npos);
  EXPECT_NE(read_text(out.path / name / "report.html").find("Check before arming"), std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(Autopilots, FlyAs,
                         ::testing::Values(OtherAutopilot{"px4", false}, OtherAutopilot{"px4", true},
                                           OtherAutopilot{"ardupilot", false}, OtherAutopilot{"ardupilot", true}),
                         [](const auto& of) {
                           return std::string(of.param.flavour) + (of.param.udp ? "_udp" : "_serial");
                         });

/// Vehicle and autopilot are a program of their own; of wasp fly are the flight and a camera that goes along.
TEST(Fly, AnAutopilotOfItsOwnByTheEyesOfACameraThatFollowsIt) {
  const TemporaryFolder out;
  const std::string port = std::to_string(free_udp_port());
  Program vehicle({program_path("wasp-sim"), "--instance", unique("other"), "--no-camera", "--autopilot", "ardupilot",
                   "--udp", "127.0.0.1:" + port});
  const fs::path config = out.path / "other.toml";
  std::ofstream(config) << "[autopilot]\nflavour = \"ardupilot\"\nendpoint = \"udp://127.0.0.1:" << port << "\"\n";
  const std::string name = fly_to_the_end(out, "follow", "--seconds 12 --follow flight --config " + config.string());
  const std::string log = read_text(out.path / name / "log/flight.txt");
  EXPECT_NE(log.find("mission flown to its end"), std::string::npos) << log;
  const auto run = nlohmann::json::parse(read_text(out.path / name / "run.json"));
  EXPECT_NE(run.dump().find("led by flight"), std::string::npos) << run.dump(1);
}

TEST(FlyRefuses, AnAutopilotThatIsNotTheOneConfigured) {
  const TemporaryFolder out;
  const std::string name = unique("wrong"), port = std::to_string(free_udp_port());
  Program vehicle(
      {program_path("wasp-sim"), "--instance", unique("other"), "--no-camera", "--udp", "127.0.0.1:" + port});
  const fs::path config = out.path / "wrong.toml";
  std::ofstream(config) << "[autopilot]\nflavour = \"px4\"\nendpoint = \"udp://127.0.0.1:" << port
                        << "\"\n[mission]\npatience_s = 4\n";
  run_shell(fly(out, name, "--seconds 5 --follow flight --config " + config.string()));
  const std::string log = read_text(out.path / name / "log/flight.txt");
  EXPECT_NE(log.find("the autopilot says MAV_AUTOPILOT 0, autopilot.flavour says px4"), std::string::npos) << log;
  EXPECT_NE(log.find("not arming: the autopilot is not the one"), std::string::npos) << log;
  EXPECT_EQ(log.find("flight mode: behaviour"), std::string::npos) << log;
}

TEST(FlyRefuses, FaultsThatCannotBe) {
  TemporaryFolder out;
  const fs::path timeline = out.path / "t.toml";
  std::ofstream(timeline) << "[[fault]]\nat_s = 0.5\nwhat = \"image.noisy\"\nfor_s = 0.5\n";
  expect_refusal(fly(out, unique("badfault"), "--seconds 2 --faults " + timeline.string()), "t.toml:1");
  expect_refusal(fly(out, unique("nofile"), "--seconds 2 --faults /nowhere.toml"), "/nowhere.toml");
  const fs::path deep = out.path / std::string(90, 'x');
  expect_refusal(kWasp + " fly --no-rt --faults --out " + deep.string() + " --name " + unique("deep") + " 2>&1",
                 "at most 107 bytes");
}

TEST(FlyRefuses, WhatCannotBeFlown) {
  TemporaryFolder out;
  expect_refusal(fly(out, "a", "--replay /nowhere/at/all"), "/nowhere/at/all");
  expect_refusal(fly(out, "a", "--mission teleport"), "unknown mission 'teleport'; known: ");
  expect_refusal(fly(out, "a/../b", ""), "--name");
  expect_refusal(fly(out, "a", "--seconds -3"), "--seconds");
  expect_refusal(kWasp + " dance 2>&1", "dance");
  expect_refusal(kWasp + " flight --no-rt --instance x --config /nowhere.toml 2>&1", "/nowhere.toml");
}

TEST(FlyRefuses, AConfigurationWithAnUnknownKeyOrAnImpossibleValue) {
  TemporaryFolder out;
  const fs::path config = out.path / "bad.toml";
  std::ofstream(config) << "[control]\nturbo = true\n";
  expect_refusal(fly(out, unique("bad"), "--seconds 2 --config " + config.string()), "turbo");
  std::ofstream(config) << "[behaviour.edge_altitude.params]\nedges_per_mile = 3\n";
  expect_refusal(fly(out, unique("bad3"), "--seconds 2 --config " + config.string()), "edges_per_mile");
  std::ofstream(config) << "[threads.control]\npriority = 400\n";
  expect_refusal(fly(out, unique("bad2"), "--seconds 2 --config " + config.string()), "400");
}

TEST(FlyRefuses, BehavioursThatCannotHaveTheirStream) {
  TemporaryFolder out;
  const fs::path config = out.path / "c.toml";
  std::ofstream(config) << "[behaviour.odometry]\nenabled = true\n";
  expect_refusal(fly(out, unique("flowless"), "--seconds 2 --config " + config.string()), "'flow_field'");
  std::ofstream(config) << "[behaviour.flow_field_down]\nenabled = true\n";  // hover has no camera that looks down
  expect_refusal(fly(out, unique("downless"), "--seconds 2 --config " + config.string()), "[camera_down]");
}

TEST(FlyRefuses, ToOverwriteAnEarlierRun) {
  TemporaryFolder out;
  fs::create_directories(out.path / "taken/log");
  std::ofstream(out.path / "taken/run.json") << "precious";
  expect_refusal(fly(out, "taken", "--seconds 2"), "nothing is overwritten");
  EXPECT_EQ(read_text(out.path / "taken/run.json"), "precious");
}

TEST(FlyRefuses, ATruncatedRecording) {
  TemporaryFolder out;
  const fs::path folder = out.path / "broken";
  fs::create_directories(folder / "depth");
  std::ofstream(folder / "depth.txt") << "0.0 depth/0.png\n";
  std::ofstream(folder / "depth/0.png") << "\x89PNG\r\n";
  expect_refusal(fly(out, unique("broken"), "--replay " + folder.string()), "0.png");
}

TEST(FlyRefuses, ASerialLineThatIsNotThere) {
  TemporaryFolder out;
  std::ofstream(out.path / "c.toml") << "[autopilot]\nendpoint = \"serial:/dev/nothing-here:57600\"\n";
  expect_refusal(
      kWasp + " flight --no-rt --instance " + unique("line") + " --config " + (out.path / "c.toml").string() + " 2>&1",
      "/dev/nothing-here");
  std::ofstream(out.path / "c.toml") << "[autopilot]\nendpoint = \"serial:/dev/null:1234\"\n";
  expect_refusal(
      kWasp + " flight --no-rt --instance " + unique("line") + " --config " + (out.path / "c.toml").string() + " 2>&1",
      "1234");
}

TEST(FlyRefuses, ToArmWithoutRealTimeUnlessTheConfigurationAllowsIt) {
  TemporaryFolder out;
  const std::string instance = unique("enforce");
  const PseudoTerminal line(out.path / "tty");
  const CameraOfNothing camera(instance);
  write_flight_config(out.path / "c.toml", out.path / "tty", true);
  expect_refusal(
      kWasp + " flight --no-rt --instance " + instance + " --config " + (out.path / "c.toml").string() + " 2>&1",
      "enforce_real_time");
  shm::Region::remove(shm::flight_region(instance));
}

TEST(Plan, SaysWhetherTheTableIsSchedulableAndWhyNot) {
  TemporaryFolder out;
  const auto [good, good_code] = run_shell(kWasp + " plan 2>&1");
  EXPECT_EQ(good_code, 0) << good;
  EXPECT_NE(good.find("schedulable"), std::string::npos);
  EXPECT_NE(good.find("####"), std::string::npos);  // the picture
  std::ofstream(out.path / "c.toml") << "[behaviour.edge_altitude]\nbudget_us = 60000\n";
  const auto [json, code] = run_shell(kWasp + " plan --json --config " + (out.path / "c.toml").string());
  EXPECT_EQ(code, 1);
  const auto document = nlohmann::json::parse(json);
  EXPECT_FALSE(document["schedulable"].get<bool>());
  EXPECT_EQ(document["reasons"].size(), 1u) << json;
  expect_refusal(kWasp + " plan --config /nowhere.toml 2>&1", "/nowhere.toml");
  expect_refusal(kWasp + " plan --measured " + (out.path / "c.toml").string() + " 2>&1", "c.toml");
}

TEST(FlyRefuses, ToArmATableThatIsNotSchedulableUnlessTheConfigurationOnlyWarns) {
  if (run_shell(kWasp + " flight --check-rights").second != 0) GTEST_SKIP() << "real time is not granted here";
  TemporaryFolder out;
  const std::string instance = unique("admission");
  const PseudoTerminal line(out.path / "tty");
  const CameraOfNothing camera(instance);
  const auto command = [&](const std::string& mode) {
    write_flight_config(out.path / "c.toml", out.path / "tty", true);
    std::ofstream(out.path / "d.toml") << "[run]\nadmission = \"" << mode
                                       << "\"\n[behaviour.edge_altitude]\nbudget_us = 60000\n";
    return kWasp + " flight --instance " + instance + " --config " + (out.path / "c.toml").string() + " --config " +
           (out.path / "d.toml").string() + " 2>&1";
  };
  expect_refusal(command("enforce"), "refusing to arm ([run] admission = \"enforce\")");
  const auto [text, code] = run_shell(command("warn"));
  EXPECT_NE(text.find("not schedulable"), std::string::npos) << text;
  EXPECT_NE(text.find("armed for real time"), std::string::npos) << text;
  shm::Region::remove(shm::flight_region(instance));
}

TEST(Fly, AFloodOfGarbageIsSurvivedAndNeverArms) {
  TemporaryFolder out;
  const std::string instance = unique("flood");
  PseudoTerminal line(out.path / "tty");
  const CameraOfNothing camera(instance);
  write_flight_config(out.path / "c.toml", out.path / "tty", false);
  std::atomic<bool> stop{false};
  std::thread flood([&] {
    std::mt19937 random(99);
    std::array<std::uint8_t, 512> noise{};
    while (!stop) {
      for (auto& b : noise) b = static_cast<std::uint8_t>(random() % 3 == 0 ? 0xFD : random());
      line.write(noise);
    }
  });
  const auto [text, code] = run_shell(kWasp + " flight --no-rt --instance " + instance + " --config " +
                                      (out.path / "c.toml").string() + " 2>&1");
  stop = true;
  flood.join();
  EXPECT_EQ(code, 1) << text;
  EXPECT_NE(text.find("mission broken off"), std::string::npos) << text;
  EXPECT_EQ(text.find("flight mode: behaviour"), std::string::npos) << text;
  shm::Region::remove(shm::flight_region(instance));
}

/// What befalls a flying process in the air.
class FlightLost : public testing::TestWithParam<const char*> {};

TEST_P(FlightLost, TheGuardianSpeaksStartsItAgainAndItNeverCommands) {
  TemporaryFolder out;
  const std::string name = unique("lost") + "-" + GetParam();
  Program program({kWasp, "fly", "--no-rt", "--json", "--out", out.path.string(), "--name", name, "--seconds", "600"});
  const fs::path log = out.path / name / "log";
  ASSERT_TRUE(eventually([&] { return read_text(log / "commands.csv").find(",behaviour,") != std::string::npos; }));
  run_shell(std::string("pkill -") + GetParam() + " -f -- '[w]asp flight --instance " + name + " '");
  EXPECT_NE(program.wait(), 0);
  const std::string said = read_text(log / "flight.txt");
  for (const char* line : {"guardian: took the line", "guardian: flight process ended by signal",
                           "guardian: flight process started again", "watching only", "mission broken off"})
    EXPECT_NE(said.find(line), std::string::npos) << line << "\n" << said;
  // One log over both processes: ticks before and after, nothing sent after.
  const auto commands = tools::CsvTable::read(log / "commands.csv");
  ASSERT_TRUE(commands.has_value());
  const std::size_t phase = *commands->column("mission_phase"), sent = *commands->column("sent");
  std::size_t before = 0, after = 0;
  for (std::size_t r = 0; r < commands->rows(); ++r) {
    const bool watching = commands->text(r, phase) == "24";
    ++(watching ? after : before);
    EXPECT_TRUE(!watching || commands->text(r, sent) == "0") << "row " << r;
  }
  EXPECT_GT(before, 0u);
  EXPECT_GT(after, 0u);
  EXPECT_TRUE(fs::exists(out.path / name / "report.html"));
  for (const auto& region : shm::Region::list("wasp." + name)) ADD_FAILURE() << "left behind: " << region;
}

INSTANTIATE_TEST_SUITE_P(ByASignal, FlightLost, testing::Values("KILL", "STOP", "SEGV"));

TEST(Fly, TheSimulatorDyingIsSaidAndTheReportIsStillWritten) {
  TemporaryFolder out;
  const std::string name = unique("simdies");
  Program program({kWasp, "fly", "--no-rt", "--json", "--out", out.path.string(), "--name", name, "--seconds", "600"});
  ASSERT_TRUE(eventually(
      [&] { return read_text(out.path / name / "log/commands.csv").find(",behaviour,") != std::string::npos; }));
  run_shell("pkill -KILL -f -- 'wasp-sim --instance " + name + " '");
  EXPECT_NE(program.wait(), 0);
  EXPECT_TRUE(fs::exists(out.path / name / "report.html"));
  for (const auto& region : shm::Region::list("wasp." + name)) ADD_FAILURE() << "left behind: " << region;
}

}  // namespace
}  // namespace wasp::test
