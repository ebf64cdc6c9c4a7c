// Import: frames that a stranger publishes, read back from the camera region as a flight reads them.
#include <cstring>
#include <functional>
#include <random>

#include "shm/broadcast_ring.h"
#include "shm/topics.h"
#include "tests/iceoryx/client.h"
#include "tests/iceoryx/fixture.h"
#include "tests/tools/fake_flight.h"
#include "tools/iceoryx_message.h"
#include "types/messages.h"

namespace wasp::test {
namespace {

Bytes noise(std::size_t bytes, unsigned seed) {
  std::mt19937 random(seed);
  Bytes result(bytes);
  for (auto& b : result) b = static_cast<std::byte>(random());
  return result;
}

/// A message as docs/iceoryx.md describes it.
Bytes frame_message(PixelFormat format, std::uint32_t width, std::uint32_t height, std::uint32_t stride,
                    std::uint32_t sequence) {
  iceoryx::MessageHead head;
  std::memcpy(head.type.data(), "Frame", 5);
  head.number = sequence;
  head.payload_bytes = static_cast<std::uint32_t>(kFramePixelOffset) + stride * height;
  FrameHeader frame;
  frame.exposed_at_ns = 1000 + sequence;
  frame.sequence = sequence;
  frame.format = format;
  frame.width_px = width;
  frame.height_px = height;
  frame.stride_bytes = stride;
  Bytes message = noise(sizeof head + head.payload_bytes, sequence);
  std::memcpy(message.data(), &head, sizeof head);
  std::memcpy(message.data() + sizeof head, &frame, sizeof frame);
  return message;
}

/// The pixels of such a message, padding left out.
Bytes packed_pixels(const Bytes& message, std::uint32_t row, std::uint32_t height, std::uint32_t stride) {
  Bytes pixels;
  for (std::uint32_t v = 0; v < height; ++v) {
    const auto* from = message.data() + sizeof(iceoryx::MessageHead) + kFramePixelOffset + v * stride;
    pixels.insert(pixels.end(), from, from + row);
  }
  return pixels;
}

struct Step {
  std::atomic<std::uint32_t> wanted{0}, sent{0};
  std::atomic<bool> connected{false};
};

/// Publishes messages[0], [1], ... as `Step::wanted` rises.
pid_t start_camera(const SharedMemory<Step>& step, const std::string& event, const std::vector<Bytes>& messages) {
  return start_child([&] {
    start_runtime("camera-" + event);
    Publisher out(service("stranger", "camera", event));
    for (;; std::this_thread::sleep_for(std::chrono::microseconds(200))) {
      step->connected = out.has_subscribers();
      if (step->sent == step->wanted) continue;
      out.send(messages.at(step->sent));
      step->sent.fetch_add(1);
    }
    return 0;
  });
}

std::optional<shm::Region> camera_of(const std::string& instance) {
  try {
    return shm::Region::attach(shm::camera_region(instance));
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

class IceoryxImport : public WithRoudi {
 protected:
  void start_import(std::vector<std::string> options) {
    std::vector<std::string> arguments{built("wasp-iceoryx"), "import", "--instance", instance, "--json"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    gateway.emplace(start_program(arguments, log));
  }
  void send(const SharedMemory<Step>& step) {
    const std::uint32_t n = step->wanted.fetch_add(1) + 1;
    ASSERT_TRUE(eventually([&] { return step->sent == n; }));
  }
  /// Waits until the ring holds `n` messages and compares the newest.
  void expect_newest(const char* topic, std::uint64_t n, std::uint32_t sequence, const Bytes& pixels) {
    std::optional<shm::Region> region;
    ASSERT_TRUE(eventually([&] { return (region = camera_of(instance)).has_value(); })) << read_text(log);
    const shm::RingReader reader(*region, topic, "Frame");
    ASSERT_TRUE(eventually([&] { return reader.newest() == n; })) << topic << " " << n << "\n" << read_text(log);
    const shm::Sample sample = reader.look(n);
    FrameHeader header;
    std::memcpy(&header, sample.data, sizeof header);
    EXPECT_EQ(header.sequence, sequence);
    EXPECT_EQ(header.stride_bytes * header.height_px, pixels.size());
    EXPECT_EQ(std::memcmp(sample.data + kFramePixelOffset, pixels.data(), pixels.size()), 0) << topic << " " << n;
  }
  std::string said() { return read_text(log); }

  const std::string instance = unique_instance("import");
  const std::filesystem::path log = folder.path / "import.log";
  std::optional<Reaped> gateway;
};

TEST_F(IceoryxImport, FramesArriveByteForByteAndWhatIsNoneIsRefusedByName) {
  WASP_START_ROUDI();
  using enum PixelFormat;
  std::vector<Bytes> messages = {frame_message(kMono8, 64, 48, 64, 1),
                                 frame_message(kMono8, 64, 48, 80, 2),
                                 noise(500, 3),
                                 frame_message(kMono8, 128, 96, 128, 4),
                                 frame_message(kDepth16Mm, 64, 48, 128, 5),
                                 frame_message(kMono8, 64, 48, 64, 6)};
  messages[2][0] = std::byte{0};
  Bytes cut = frame_message(kMono8, 64, 48, 64, 7);
  cut.resize(2000);
  messages.push_back(cut);
  messages.push_back(frame_message(kMono8, 64, 48, 64, 9));
  const SharedMemory<Step> step;
  const Reaped camera(start_camera(step, "gray", messages));
  start_import({"--gray", "stranger/camera/gray"});
  ASSERT_TRUE(eventually([&] { return step->connected.load(); })) << said();
  const auto good = [&](std::size_t i, std::uint64_t n, std::uint32_t sequence, std::uint32_t stride) {
    send(step);
    expect_newest("gray", n, sequence, packed_pixels(messages[i], 64, 48, stride));
  };
  good(0, 1, 1, 64);
  good(1, 2, 2, 80);  // rows with padding come out packed
  for (int bad = 0; bad < 3; ++bad) send(step);
  good(5, 3, 6, 64);
  send(step);
  good(7, 4, 9, 64);
  EXPECT_EQ(gateway->stop(), 0);
  for (const char* word :
       {"not a message of wasp (for bare pixels say --raw)", "wrong size: 128x96 mono8 does not fit a camera of 64x48",
        "it is depth16, not mono8", "wrong size: the head speaks of 3136 bytes, 1936 follow it",
        R"("taken": 4, "rejected": 4, "missed": 5)"})
    EXPECT_NE(said().find(word), std::string::npos) << word << "\n" << said();
  EXPECT_FALSE(camera_of(instance)) << "the region outlived its program";
}

TEST_F(IceoryxImport, BarePixelsOfTwoServicesFillBothRings) {
  WASP_START_ROUDI();
  const std::vector<Bytes> gray = {noise(64 * 48, 1), noise(64 * 48 + 1, 2), noise(64 * 48, 3)};
  const std::vector<Bytes> depth = {noise(64 * 48 * 2, 4), noise(64 * 48 * 2, 5)};
  const SharedMemory<Step> gray_step, depth_step;
  const Reaped gray_camera(start_camera(gray_step, "g", gray)), depth_camera(start_camera(depth_step, "d", depth));
  start_import({"--raw", "--size", "64x48", "--gray", "stranger/camera/g", "--depth", "stranger/camera/d"});
  ASSERT_TRUE(eventually([&] { return gray_step->connected && depth_step->connected; })) << said();
  send(gray_step);
  expect_newest("gray", 1, 0, gray[0]);
  send(gray_step);  // one byte too many
  send(gray_step);
  expect_newest("gray", 2, 2, gray[2]);
  for (std::uint32_t i = 0; i < 2; ++i) {
    send(depth_step);
    expect_newest("depth", i + 1, i, depth[i]);
  }
  EXPECT_EQ(gateway->stop(), 0);
  EXPECT_NE(said().find("64x48 mono8 has 3072 bytes, the message holds 3073"), std::string::npos) << said();
}

TEST_F(IceoryxImport, AWorkerKilledGivesWayToAnotherAndTheReaderGoesOn) {
  WASP_START_ROUDI();
  std::vector<Bytes> messages;
  for (std::uint32_t i = 1; i <= 40; ++i) messages.push_back(frame_message(PixelFormat::kMono8, 64, 48, 64, i));
  const SharedMemory<Step> step;
  const Reaped camera(start_camera(step, "gray", messages));
  start_import({"--service", "stranger/camera/gray"});
  ASSERT_TRUE(eventually([&] { return step->connected.load(); })) << said();
  send(step);
  expect_newest("gray", 1, 1, packed_pixels(messages[0], 64, 48, 64));
  std::optional<shm::Region> region = camera_of(instance);
  ASSERT_TRUE(region);
  const pid_t first = region->header().writer_pid;
  kill(first, SIGKILL);
  ASSERT_TRUE(eventually([&] { return region->header().writer_pid != first; })) << said();
  const shm::RingReader reader(*region, "gray");  // mapped before the kill, valid after it
  ASSERT_TRUE(eventually([&] {
    if (step->wanted < messages.size() && step->sent == step->wanted) step->wanted.fetch_add(1);
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    return reader.newest() > 1;
  })) << said();
  EXPECT_EQ(region->header().writer_restarts, 1u);
  EXPECT_EQ(gateway->stop(), 0);
}

}  // namespace
}  // namespace wasp::test
