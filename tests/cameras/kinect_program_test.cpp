// The Kinect end to end without hardware: the real wasp-camera over libfreenect's own fakenect, which plays dumps that
// the simulator wrote.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "drivers/kinect_depth.h"
#include "rt/clock.h"
#include "shm/broadcast_ring.h"
#include "shm/topics.h"
#include "sim/fakenect_dump.h"
#include "sim/sim_config.h"
#include "tests/tools/program.h"
#include "types/messages.h"
#include "vision/ground_altitude.h"

namespace wasp {
namespace {

namespace fs = std::filesystem;

/// Folder of fakenect's libfreenect.so.0.5, wherever this architecture has it; empty if it is not installed.
std::string fakenect() {
  for (const auto& entry : fs::directory_iterator("/usr/lib"))
    if (fs::exists(entry.path() / "fakenect" / "libfreenect.so.0.5")) return (entry.path() / "fakenect").string();
  return {};
}

/// A frame as another process saw it.
struct Seen {
  FrameHeader header;
  TimeNs published_at_ns = 0;
  std::vector<std::uint8_t> bytes;
};

class KinectProgram {
 public:
  explicit KinectProgram(const fs::path& dump, const std::string& options = "")
      : instance_("kinect" + std::to_string(getpid()) + "-" + std::to_string(++count_)) {
    const std::string command = "FAKENECT_PATH=" + dump.string() + " LD_LIBRARY_PATH=" + fakenect() + " exec " +
                                test::program_path("wasp-camera") + " --instance " + instance_ +
                                " --no-rt --json --driver kinect " + options + " >" + file("out") + " 2>" + file("log");
    program_ = std::make_unique<test::Program>(std::vector<std::string>{"/bin/sh", "-c", command});
  }
  ~KinectProgram() {
    program_.reset();
    shm::Region::remove(shm::camera_region(instance_));
  }

  /// Reads both rings until the log says that the device is gone, or nothing comes any more.
  void follow_to_the_end() {
    ASSERT_TRUE(test::eventually([&] {
      try {
        region_.emplace(shm::Region::attach_with_bells(shm::camera_region(instance_)));
      } catch (const std::exception&) {
        return false;
      }
      return true;
    })) << log();
    shm::RingReader gray_reader(*region_, shm::kGray, "Frame"), depth_reader(*region_, shm::kDepth, "Frame");
    gray_reader.rewind(), depth_reader.rewind();
    for (bool ended = false; !ended;) {
      ended = log().find("gone") != std::string::npos || program_ended();
      while (take(depth_reader, depth) || take(gray_reader, gray)) {
      }
      gray_reader.wait(rt::now() + 5 * kMillisecond);
    }
    lost = gray_reader.lost() + depth_reader.lost();
  }

  /// Its figures; it must end in order.
  nlohmann::json finish() {
    program_->signal(SIGTERM);
    EXPECT_EQ(program_->wait(), 0) << log();
    const std::string out = test::read_text(folder_.path / "out");  // fakenect speaks there as well
    const auto at = out.rfind("[{");
    const auto document = nlohmann::json::parse(at == std::string::npos ? "" : out.substr(at, out.find('\n', at) - at), nullptr, false);
    if (!document.is_array() || document.empty()) {
      ADD_FAILURE() << "no figures: " << out << log();
      return {};
    }
    return document.at(0);
  }
  int wait() { return program_->wait(); }
  [[nodiscard]] std::string log() const { return test::read_text(folder_.path / "log"); }
  [[nodiscard]] std::string file(const std::string& name) const { return (folder_.path / name).string(); }

  std::map<std::uint32_t, Seen> gray, depth;  ///< by sequence
  std::uint64_t lost = 0;                     ///< to this reader, on a busy machine

 private:
  [[nodiscard]] bool program_ended() const { return log().find("wasp-camera: kinect: ") != std::string::npos; }

  static bool take(shm::RingReader& reader, std::map<std::uint32_t, Seen>& into) {
    const shm::Sample sample = reader.next();
    if (!sample) return false;
    Seen seen;
    std::memcpy(&seen.header, sample.data, sizeof seen.header);
    const auto* pixels = reinterpret_cast<const std::uint8_t*>(sample.data + kFramePixelOffset);
    seen.bytes.assign(pixels, pixels + std::size_t{seen.header.stride_bytes} * seen.header.height_px);
    seen.published_at_ns = sample.published_at_ns;
    if (reader.intact(sample)) into[seen.header.sequence] = std::move(seen);
    return true;
  }

  static inline int count_ = 0;
  std::string instance_;
  test::TemporaryFolder folder_;
  std::unique_ptr<test::Program> program_;
  std::optional<shm::Region> region_;
};

struct Truth {
  double t_s = 0, height_m = 0;
  Quat q_ned_body = Quat::Identity();
};

std::vector<Truth> read_truth(const fs::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  std::vector<Truth> rows;
  while (std::getline(in, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream fields(line);
    Truth t;
    double index = 0, north = 0, east = 0, w = 1, x = 0, y = 0, z = 0;
    fields >> index >> t.t_s >> t.height_m >> north >> east >> w >> x >> y >> z;
    t.q_ned_body = Quat(static_cast<float>(w), static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
    rows.push_back(t);
  }
  return rows;
}

/// Payload of the dump's files of one kind, in order.
std::vector<std::string> payloads(const fs::path& dump, char kind) {
  std::ifstream index(dump / "INDEX.txt");
  std::vector<std::string> out;
  for (std::string name; std::getline(index, name);) {
    if (name.front() != kind) continue;
    const std::string all = test::read_text(dump / name);
    out.push_back(all.substr(all.find('\n') + 1));
  }
  return out;
}

bool same_depth(const std::string& raw_bytes, const Seen& seen, const drivers::KinectTable& table) {
  for (std::size_t i = 0; i < 640 * 480; ++i) {
    std::uint16_t raw = 0, mm = 0;
    std::memcpy(&raw, raw_bytes.data() + 2 * i, 2);
    std::memcpy(&mm, seen.bytes.data() + 2 * i, 2);
    if (mm != table.mm[raw]) return false;
  }
  return true;
}

bool same_gray(const std::string& rgb, const Seen& seen) {
  for (std::size_t i = 0; i < 640 * 480; ++i)
    if (static_cast<std::uint8_t>(rgb[3 * i]) != seen.bytes[i]) return false;
  return true;
}

/// A dump of plain images, each with its number in its pixels.
void write_plain(const fs::path& dump, int exposures, sim::FakenectOptions options = {}) {
  sim::FakenectDump out(dump, options);
  std::vector<std::uint8_t> gray(640 * 480);
  std::vector<std::uint16_t> depth(640 * 480);
  for (int i = 0; i < exposures; ++i) {
    std::fill(gray.begin(), gray.end(), static_cast<std::uint8_t>(i));
    std::fill(depth.begin(), depth.end(), static_cast<std::uint16_t>(1000 + 20 * i));
    out.add(i * kSecond / 30, {gray.data(), 640, 480, 640}, {depth.data(), 640, 480, 640});
  }
}

struct KinectProgramTest : testing::Test {
  void SetUp() override {
    if (fakenect().empty()) GTEST_SKIP() << "no fakenect on this machine (package libfreenect0.5)";
  }
  test::TemporaryFolder folder;
};

/// A hover that the simulator flew: what the rings hold is the dump's to the bit, and ground_altitude finds the height.
TEST_F(KinectProgramTest, ASimulatedHoverComesThroughFakenectIntoTheRingsToTheBit) {
  const fs::path dump = folder.path / "dump";
  const auto [said, code] =
      test::run_shell(test::program_path("wasp-kinect") + " record " + dump.string() + " --from 14 --seconds 3 --seed 5");
  ASSERT_EQ(code, 0) << said;
  std::ofstream(folder.path / "model.toml") << "[camera]\ndepth_model = \"linear\"\n";
  KinectProgram camera(dump, "--config " + (folder.path / "model.toml").string());
  camera.follow_to_the_end();
  const auto figures = camera.finish();

  const auto raw = payloads(dump, 'd'), rgb = payloads(dump, 'r');
  const std::vector<Truth> truth = read_truth(dump / "truth.csv");
  ASSERT_EQ(raw.size(), truth.size());
  ASSERT_NEAR(static_cast<double>(truth.size()), 90.0, 1.0);
  EXPECT_EQ(figures.at("frames"), truth.size()) << camera.log();
  EXPECT_EQ(figures.at("dropped"), 0) << camera.log();
  EXPECT_EQ(figures.at("corrupt"), 0);
  EXPECT_GE(camera.depth.size() + camera.gray.size() + camera.lost, 2 * truth.size());
  EXPECT_GE(camera.depth.size(), truth.size() / 2) << "the machine is too busy to see anything";

  const drivers::KinectTable table = drivers::make_kinect_table(drivers::kBurrusLinear);
  const CameraGeometry geometry = sim::SimConfig().camera;
  vision::GroundAltitude::Params params;
  params.camera = geometry;
  vision::GroundAltitude::State state;
  double worst_m = 0;
  TimeNs last_ns = 0;
  for (const auto& [sequence, seen] : camera.depth) {
    ASSERT_GE(sequence, 1u);
    ASSERT_LE(sequence, truth.size());
    EXPECT_TRUE(same_depth(raw[sequence - 1], seen, table)) << "depth " << sequence;
    EXPECT_GT(seen.header.exposed_at_ns, last_ns);
    EXPECT_LE(seen.header.exposed_at_ns, seen.published_at_ns);
    last_ns = seen.header.exposed_at_ns;
    const Truth& t = truth[sequence - 1];
    BehaviourInput input;
    input.exposed_at_ns = seen.header.exposed_at_ns;
    input.depth = {reinterpret_cast<const std::uint16_t*>(seen.bytes.data()), 640, 480, 640};
    input.attitude_valid = true;
    input.attitude.q_ned_body = {t.q_ned_body.w(), t.q_ned_body.x(), t.q_ned_body.y(), t.q_ned_body.z()};
    const CueBody cue = vision::GroundAltitude::step(params, input, state);
    ASSERT_EQ(cue.validity, Validity::kValid) << sequence;
    worst_m = std::max(worst_m, std::fabs(static_cast<double>(cue.height_m) - t.height_m));
  }
  EXPECT_LT(worst_m, 0.03);
  RecordProperty("worst_height_error_mm", static_cast<int>(1000 * worst_m));

  for (const auto& [sequence, seen] : camera.gray) {
    EXPECT_TRUE(same_gray(rgb[sequence - 1], seen)) << "grey " << sequence;
    const auto pair = camera.depth.find(sequence);
    if (pair == camera.depth.end()) continue;
    EXPECT_EQ(pair->second.header.exposed_at_ns, seen.header.exposed_at_ns);
    EXPECT_LE(pair->second.published_at_ns, seen.published_at_ns) << "depth comes first";
  }
  // When: fakenect plays slower than it recorded, the more so on a busy machine; which, and in what order, it keeps.
  std::uint32_t expected = camera.depth.begin()->first;
  for (const auto& [sequence, seen] : camera.depth) {
    EXPECT_GE(sequence, expected);
    expected = sequence + 1;
  }
}

TEST_F(KinectProgramTest, TheEndOfARecordingIsADeviceThatIsGoneAndDoesNotSpin) {
  write_plain(folder.path / "dump", 20);
  KinectProgram camera(folder.path / "dump");
  camera.follow_to_the_end();
  const TimeNs from_ns = rt::now();
  rt::sleep_until(from_ns + kSecond);
  const auto figures = camera.finish();
  const double waited_s = to_seconds(rt::now() - from_ns);
  EXPECT_EQ(figures.at("frames"), 20) << camera.log();
  EXPECT_LE(figures.at("reopened").get<double>(), 5 * waited_s + 2) << "looks for it at 5 Hz";
}

/// An empty file makes fakenect say that the device failed, once: the camera is opened again and goes on.
TEST_F(KinectProgramTest, GoesOnAfterADeviceThatFailedInTheMiddle) {
  const fs::path dump = folder.path / "dump";
  write_plain(dump, 60);
  std::ifstream index(dump / "INDEX.txt");
  std::vector<std::string> names;
  for (std::string name; std::getline(index, name);) names.push_back(name);
  std::ofstream(dump / names[40], std::ios::trunc).close();
  KinectProgram camera(dump);
  ASSERT_TRUE(test::eventually([&] { return camera.log().find("back after") != std::string::npos; })) << camera.log();
  rt::sleep_until(rt::now() + 500 * kMillisecond);
  const auto figures = camera.finish();
  EXPECT_GE(figures.at("reopened").get<int>(), 1);
  EXPECT_GT(figures.at("frames").get<int>(), 25) << camera.log();
}

TEST_F(KinectProgramTest, WildPixelsAndStampsOutOfOrderAreNotGuessed) {
  const fs::path dump = folder.path / "dump";
  write_plain(dump, 30);
  std::ifstream index(dump / "INDEX.txt");
  std::vector<std::string> names;
  for (std::string name; std::getline(index, name);) names.push_back(name);
  index.close();
  // Depth of exposure 10: nothing but values that no 11-bit sensor has. Exposure 20: the same stamp as 19.
  std::ofstream(dump / names[21], std::ios::binary) << "P5 640 480 65535\n" << std::string(614400, '\xff');
  const auto ticks_at = [](const std::string& name) { return name.rfind('-') + 1; };
  const std::string repeated = names[41].substr(0, ticks_at(names[41])) + names[39].substr(ticks_at(names[39]));
  fs::rename(dump / names[41], dump / repeated);
  names[41] = repeated;
  std::ofstream out(dump / "INDEX.txt");
  for (const auto& name : names) out << name << '\n';
  out.close();
  KinectProgram camera(dump);
  camera.follow_to_the_end();
  const auto figures = camera.finish();
  EXPECT_EQ(figures.at("corrupt"), 1) << camera.log();
  if (const auto wild = camera.depth.find(11); wild != camera.depth.end()) {
    EXPECT_EQ(std::count(wild->second.bytes.begin(), wild->second.bytes.end(), 0), 614400) << "no reading anywhere";
  }
  EXPECT_FALSE(camera.depth.contains(21));
}

TEST_F(KinectProgramTest, RefusesWhatFakenectDoesNotOffer) {
  write_plain(folder.path / "dump", 2);
  std::ofstream(folder.path / "mode.toml") << "[camera]\ndepth_mode = \"registered\"\n";
  KinectProgram camera(folder.path / "dump", "--config " + (folder.path / "mode.toml").string());
  EXPECT_EQ(camera.wait(), 1);
  EXPECT_NE(camera.log().find("offers no depth_mode \"registered\""), std::string::npos) << camera.log();
}

TEST_F(KinectProgramTest, WithoutAKinectTheRealLibrarySaysSo) {
  const auto [said, code] = test::run_shell(test::program_path("wasp-camera") + " --instance none" +
                                            std::to_string(getpid()) + " --driver kinect --no-rt 2>&1");
  EXPECT_EQ(code, 1);
  EXPECT_NE(said.find("no Kinect is plugged in"), std::string::npos) << said;
}

}  // namespace
}  // namespace wasp
