// The real program in real time: what another process sees of it.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>

#include "messages/mavlink_frame.h"
#include "rt/clock.h"
#include "shm/broadcast_ring.h"
#include "shm/topics.h"
#include "tests/support/child.h"
#include "types/messages.h"

namespace wasp::sim {
namespace {

/// wasp-sim as a child; ends with the test.
class Program {
 public:
  explicit Program(std::vector<std::string> extra = {}) {
    std::vector<std::string> arguments{WASP_BINARY_DIR "/wasp-sim", "--instance", instance, "--tty-link", link};
    arguments.insert(arguments.end(), extra.begin(), extra.end());
    pid_ = test::start_child([&] {
      std::vector<char*> argv;
      for (auto& a : arguments) argv.push_back(a.data());
      argv.push_back(nullptr);
      execv(argv[0], argv.data());
      return 127;
    });
  }
  ~Program() {
    if (pid_ > 0) end(SIGTERM);
  }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;
  int end(int signal) {
    const int status = test::kill_and_wait(pid_, signal);
    pid_ = -1;
    return status;
  }
  [[nodiscard]] bool ready() const {
    return test::eventually([&] {
      return std::filesystem::exists(link) && access(("/dev/shm/" + shm::truth_region(instance)).c_str(), R_OK) == 0;
    });
  }

  std::string instance = test::unique_name("sim");
  std::string link = testing::TempDir() + instance + ".tty";

 private:
  pid_t pid_ = -1;
};

FrameHeader header_of(const shm::Sample& sample) {
  FrameHeader header;
  std::memcpy(&header, sample.data, sizeof header);
  return header;
}

TEST(SimProgram, PublishesBothImagesOfAnExposureAndTheTruth) {
  Program program;
  ASSERT_TRUE(program.ready());
  const auto camera = shm::Region::attach_with_bells(shm::camera_region(program.instance));
  const auto truth_region = shm::Region::attach_with_bells(shm::truth_region(program.instance));
  shm::RingReader gray(camera, shm::kGray, "Frame"), depth(camera, shm::kDepth, "Frame"),
      truth(truth_region, shm::kTruth, "Truth");
  TimeNs last_ns = 0;
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(gray.wait(rt::now() + 20 * kSecond));
    const shm::Sample g = gray.next();
    ASSERT_TRUE(g);
    const FrameHeader h = header_of(g);
    EXPECT_EQ(h.format, PixelFormat::kMono8);
    EXPECT_EQ(h.stride_bytes, 640u);
    EXPECT_GT(h.exposed_at_ns, last_ns);
    EXPECT_GT(g.published_at_ns, h.exposed_at_ns);
    last_ns = h.exposed_at_ns;
    bool paired = false;  // depth comes first: it is there already
    for (std::uint64_t n = 1; n <= depth.newest(); ++n)
      if (const shm::Sample d = depth.look(n); d && header_of(d).sequence == h.sequence) {
        EXPECT_EQ(header_of(d).format, PixelFormat::kDepth16Mm);
        EXPECT_EQ(header_of(d).stride_bytes, 1280u);
        paired = header_of(d).exposed_at_ns == h.exposed_at_ns;
      }
    EXPECT_TRUE(paired);
  }
  EXPECT_FALSE(camera.has(shm::kGrayDown));
  Truth newest;
  ASSERT_TRUE(truth.copy_newest(newest));
  EXPECT_NEAR(newest.height_m, 0.2f, 0.01f);
  EXPECT_EQ(newest.armed, 0.f);
}

TEST(SimProgram, ASecondCameraIsShownBesideTheFirst) {
  const std::string config = testing::TempDir() + test::unique_name("down") + ".toml";
  std::ofstream(config) << "[camera]\nwidth_px = 64\nheight_px = 48\n[camera_down]\nenabled = true\nrate_hz = 20.0\n"
                           "width_px = 96\nheight_px = 64\n";
  Program program({"--config", config});
  ASSERT_TRUE(program.ready());
  const auto camera = shm::Region::attach_with_bells(shm::camera_region(program.instance));
  shm::RingReader front(camera, shm::kGray, "Frame"), down(camera, shm::kGrayDown, "Frame");
  std::uint32_t last_sequence = 0;
  TimeNs last_ns = 0;
  for (int i = 0; i < 6; ++i) {
    ASSERT_TRUE(down.wait(rt::now() + 20 * kSecond));
    const shm::Sample sample = down.next();
    ASSERT_TRUE(sample);
    const FrameHeader h = header_of(sample);
    EXPECT_EQ(h.format, PixelFormat::kMono8);
    EXPECT_EQ(h.width_px, 96u);
    EXPECT_EQ(h.height_px, 64u);
    if (i > 0) {
      EXPECT_EQ(h.exposed_at_ns - last_ns, (h.sequence - last_sequence) * 50 * kMillisecond);
    }
    last_ns = h.exposed_at_ns;
    last_sequence = h.sequence;
  }
  ASSERT_TRUE(front.wait(rt::now() + 20 * kSecond));
  EXPECT_EQ(header_of(front.next()).width_px, 64u);
  std::filesystem::remove(config);
}

TEST(SimProgram, SpeaksMavlinkOnTheLineAndItSurvivesReopening) {
  Program program({"--no-camera"});
  ASSERT_TRUE(program.ready());
  EXPECT_NE(access(("/dev/shm/" + shm::camera_region(program.instance)).c_str(), F_OK), 0) << "--no-camera";
  for (int round = 0; round < 2; ++round) {
    const int fd = open(program.link.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK);
    ASSERT_GE(fd, 0);
    mavlink::Encoder encoder(1, 191);
    mavlink::CommandLong command{};
    command.command = 176, command.param1 = 1, command.param2 = 1, command.target_system = 1,
    command.target_component = 1;
    std::array<std::uint8_t, 280> bytes{};
    const std::size_t size = encoder.encode(command, bytes);
    ASSERT_EQ(write(fd, bytes.data(), size), static_cast<ssize_t>(size));
    mavlink::Parser parser;
    bool acknowledged = false, heard = false;
    EXPECT_TRUE(test::eventually([&] {
      std::array<std::uint8_t, 4096> in{};
      const ssize_t n = read(fd, in.data(), in.size());
      if (n > 0)
        parser.feed(std::span(in).first(static_cast<std::size_t>(n)), [&](const mavlink::Frame& frame) {
          acknowledged =
              acknowledged || (frame.is<mavlink::CommandAck>() && frame.as<mavlink::CommandAck>().command == 176);
          heard = heard || frame.is<mavlink::HighresImu>();
        });
      return acknowledged && heard;
    })) << "round "
        << round;
    close(fd);
  }
}

TEST(SimProgram, AKilledCameraComesBackIntoTheSameRegionAndItsReadersGoOn) {
  Program vehicle({"--no-camera"});
  ASSERT_TRUE(vehicle.ready());
  const std::string config = testing::TempDir() + test::unique_name("alone") + ".toml";
  std::ofstream(config) << "[camera]\nwidth_px = 64\nheight_px = 48\n";
  const auto start = [&] {
    return test::start_child([&] {
      execl(WASP_BINARY_DIR "/wasp-sim", "wasp-sim", "--camera-only", "--instance", vehicle.instance.c_str(),
            "--config", config.c_str(), nullptr);
      return 127;
    });
  };
  const std::string name = shm::camera_region(vehicle.instance);
  pid_t camera = start();
  ASSERT_TRUE(test::eventually([&] { return access(("/dev/shm/" + name).c_str(), R_OK) == 0; }));
  std::optional<shm::Region> region;
  ASSERT_TRUE(test::eventually([&] {
    try {
      region.emplace(shm::Region::attach_with_bells(name));
    } catch (const std::exception&) {
    }
    return region.has_value();
  }));
  shm::RingReader gray(*region, shm::kGray, "Frame");
  ASSERT_TRUE(gray.wait(rt::now() + 60 * kSecond));
  const TimeNs first_ns = header_of(gray.next()).exposed_at_ns;
  test::kill_and_wait(camera, SIGKILL);
  EXPECT_FALSE(region->writer_alive());
  while (gray.next()) {
  }
  camera = start();
  ASSERT_TRUE(gray.wait(rt::now() + 60 * kSecond)) << "the reader's mapping is still the camera's";
  EXPECT_GT(header_of(gray.next()).exposed_at_ns, first_ns);
  EXPECT_EQ(region->header().writer_restarts.load(), 1u);
  const int status = test::kill_and_wait(camera, SIGTERM);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  std::filesystem::remove(config);
}

TEST(SimProgram, EndsInOrderOnSigterm) {
  Program program({"--no-camera"});
  ASSERT_TRUE(program.ready());
  const int status = program.end(SIGTERM);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  EXPECT_FALSE(std::filesystem::is_symlink(program.link));
  EXPECT_NE(access(("/dev/shm/" + shm::truth_region(program.instance)).c_str(), F_OK), 0);
}

TEST(SimProgram, RefusesABadConfigurationNamingTheKey) {
  const std::string config = testing::TempDir() + "bad_sim.toml";
  FILE* file = std::fopen(config.c_str(), "w");
  std::fputs("[camera]\nrate_hx = 3\n", file);
  std::fclose(file);
  const std::string command =
      std::string(WASP_BINARY_DIR "/wasp-sim --tty-link ") + testing::TempDir() + "never --config " + config + " 2>&1";
  FILE* pipe = popen(command.c_str(), "r");
  std::array<char, 512> text{};
  const std::size_t n = fread(text.data(), 1, text.size() - 1, pipe);
  EXPECT_NE(pclose(pipe), 0);
  EXPECT_NE(std::string(text.data(), n).find("camera.rate_hx"), std::string::npos);
}

}  // namespace
}  // namespace wasp::sim
