// What cannot be done is refused at once or after the patience asked for, in words, and never hangs.
#include "shm/topics.h"
#include "tests/iceoryx/fixture.h"
#include "tests/tools/fake_flight.h"
#include "tools/iceoryx_daemon.h"

namespace wasp::test {
namespace {

const std::string kGateway = built("wasp-iceoryx");

void expect_refusal(const std::vector<std::string>& arguments, int code, const std::string& words) {
  std::vector<std::string> all{kGateway};
  all.insert(all.end(), arguments.begin(), arguments.end());
  const auto [text, result] = run_program(all);
  EXPECT_EQ(result, code) << text;
  EXPECT_NE(text.find(words), std::string::npos) << words << "\n" << text;
}

TEST(IceoryxRefusals, BadRequestsAreNamed) {
  const FakeFlight flight(unique_instance("refused"));
  const std::string& name = flight.instance;
  expect_refusal({"export", "--instance", name}, 2, "nothing to export: say --topic NAME or --all");
  expect_refusal({"export", "--instance", name, "--topic", "grey", "--wait", "0"}, 2,
                 "has no topic 'grey' to export; it has: gray, depth, imu, attitude, command, cue.ground_altitude, "
                 "cue.edge_altitude, truth");
  expect_refusal({"export", "--instance", name, "--topic", "stages", "--wait", "0"}, 2, "has no topic 'stages'");
  expect_refusal({"export", "--instance", "nobody", "--all", "--wait", "0.1"}, 2, "no instance 'nobody' is running");
  expect_refusal({"import", "--instance", "x"}, 2, "name a service with --service, --gray or --depth");
  expect_refusal({"import", "--instance", "x", "--service", "a/b"}, 2, "'a/b' is not a service");
  expect_refusal({"import", "--instance", "x", "--service", "a/b/" + std::string(101, 'c')}, 2, "is too long");
  expect_refusal({"import", "--instance", "x", "--service", "a/b/c", "--gray", "a/b/c"}, 2, "exclude each other");
  expect_refusal({"import", "--instance", "x", "--gray", "a/b/c", "--raw"}, 2, "--raw needs --size");
  expect_refusal({"import", "--instance", "x", "--gray", "a/b/c", "--size", "640"}, 2, "is not WIDTHxHEIGHT");
  expect_refusal({"import", "--instance", "x", "--gray", "a/b/c", "--size", "0x480"}, 2, "is not WIDTHxHEIGHT");
}

class IceoryxRefusalsOfTheDaemon : public WithRoudi {};

TEST_F(IceoryxRefusalsOfTheDaemon, StoppedThenAbsent) {
  WASP_START_ROUDI();
  const FakeFlight flight(unique_instance("nodaemon"));
  const pid_t daemon = iceoryx::daemon_pid();
  ASSERT_GT(daemon, 0);
  roudi->signal(SIGSTOP);
  ASSERT_TRUE(eventually([&] { return iceoryx::is_stopped(daemon); }));
  expect_refusal({"export", "--instance", flight.instance, "--all"}, 3,
                 "iox-roudi (process " + std::to_string(daemon) + ") does not answer: it is stopped");
  roudi.reset();
  EXPECT_EQ(iceoryx::daemon_pid(), 0);
  expect_refusal({"export", "--instance", flight.instance, "--all", "--wait", "0.2"}, 3,
                 "no iceoryx daemon came within 0.2 s; start `iox-roudi`");
  expect_refusal({"import", "--instance", "x", "--gray", "a/b/c", "--wait", "0"}, 3, "no iceoryx daemon");
  expect_refusal({"list"}, 0, "no daemon runs");
}

TEST_F(IceoryxRefusalsOfTheDaemon, ACameraThatIsAlreadyThere) {
  WASP_START_ROUDI();
  const FakeFlight flight(unique_instance("taken"));
  expect_refusal({"import", "--instance", flight.instance, "--gray", "a/b/c", "--size", "64x48"}, 1,
                 "another process is writing it");
  EXPECT_NO_THROW(shm::Region::attach(shm::camera_region(flight.instance)));
}

TEST_F(IceoryxRefusalsOfTheDaemon, AMessageLargerThanEveryChunk) {
  WASP_START_ROUDI();
  const std::string instance = unique_instance("large"), name = shm::camera_region(instance);
  const std::vector<shm::TopicSpec> topics{{shm::kGray, "Frame", shm::TopicKind::kRing, 4, 2'000'000}};
  const shm::Region region = shm::Region::create(name, topics);
  shm::RingWriter ring(region, shm::kGray);
  Reaped subscriber(
      start_program({kGateway, "import", "--instance", instance + "b", "--gray", "wasp/" + instance + "/gray"},
                    folder.path / "import.log"));
  Reaped gateway(start_program({kGateway, "export", "--instance", instance, "--all"}, folder.path / "export.log"));
  ASSERT_TRUE(eventually([&] {
    FrameHeader header;
    header.stride_bytes = 2000;
    header.height_px = 900;
    std::memcpy(ring.loan(), &header, sizeof header);
    ring.publish(1);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    return !gateway.running();
  }));
  const std::string text = read_text(folder.path / "export.log");
  EXPECT_NE(text.find("the daemon has no chunk that large"), std::string::npos) << text;
  shm::Region::remove(name);
}

}  // namespace
}  // namespace wasp::test
