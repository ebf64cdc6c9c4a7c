// The flight and the gateway: a mission flown on a camera that arrives through iceoryx, and a flight whose control does
// not skip a tick while everything of iceoryx is killed and frozen beside it. A host that stands still can skip ticks
// too, so the latter has three attempts: a defect breaks all of them.
#include "scheduling/stage_table.h"
#include "shm/broadcast_ring.h"
#include "shm/topics.h"
#include "tests/iceoryx/fixture.h"
#include "tests/tools/fake_flight.h"
#include "tools/gateway_chaos.h"
#include "types/messages.h"

namespace wasp::test {
namespace {

/// Simulator and flight; the flight's instance may be another than the simulator's.
struct Flying {
  Flying(const std::filesystem::path& folder, const std::string& camera_instance, const std::string& flight_instance,
         double seconds)
      : sim(start_program({built("wasp-sim"), "--instance", camera_instance, "--tty-link", (folder / "tty").string()},
                          folder / "sim.txt")),
        log(folder / "flight.txt") {
    EXPECT_TRUE(eventually([&] { return std::filesystem::exists(folder / "tty"); }));
    std::ofstream(folder / "override.toml")
        << "[run]\nenforce_real_time = false\n[autopilot]\nendpoint = \"serial:" << (folder / "tty").string()
        << ":921600\"\n[mission]\nheights_m = [0.5]\nseconds = [" << seconds << "]\npatience_s = 60.0\n";
    flight.emplace(start_program(
        {built("wasp"), "flight", "--no-rt", "--instance", flight_instance, "--config",
         std::string(WASP_SOURCE_DIR) + "/config/wasp.toml", "--config", (folder / "override.toml").string()},
        log));
    region_name = shm::flight_region(flight_instance);
  }
  ~Flying() {
    flight.reset();
    shm::Region::remove(region_name);
  }
  Flying(const Flying&) = delete;
  Flying& operator=(const Flying&) = delete;

  [[nodiscard]] std::string said() const { return read_text(log); }
  [[nodiscard]] bool flown() const { return said().find("mission flown to its end") != std::string::npos; }
  [[nodiscard]] std::optional<shm::Region> region() const {
    try {
      return shm::Region::attach(region_name);
    } catch (const std::exception&) {
      return std::nullopt;
    }
  }

  Reaped sim;
  std::optional<Reaped> flight;
  std::filesystem::path log;
  std::string region_name;
};

const scheduling::RunStatus& run_status(const shm::Region& region) {
  return *reinterpret_cast<const scheduling::RunStatus*>(region.at(region.topic("run").offset));
}

class IceoryxFlight : public WithRoudi {};

TEST_F(IceoryxFlight, AMissionIsFlownOnACameraThatArrivesThroughIceoryx) {
  WASP_START_ROUDI();
  const std::string origin = unique_instance("origin"), arrived = unique_instance("arrived");
  bool flown = false;
  for (int attempt = 0; attempt < 3 && !flown; ++attempt) {
    const std::filesystem::path here = folder.path / std::to_string(attempt);
    std::filesystem::create_directory(here);
    Reaped in(start_program({built("wasp-iceoryx"), "import", "--instance", arrived, "--gray",
                             "wasp/" + origin + "/gray", "--depth", "wasp/" + origin + "/depth"},
                            here / "import.txt"));
    Flying flying(here, origin, arrived, 3);
    Reaped out(start_program(
        {built("wasp-iceoryx"), "export", "--instance", origin, "--topic", "gray", "--topic", "depth", "--wait", "60"},
        here / "export.txt"));
    const int status = flying.flight->wait();
    flown = flying.flown();
    EXPECT_FALSE(WIFSIGNALED(status));
    if (!flown && attempt == 2)
      ADD_FAILURE() << flying.said() << read_text(here / "import.txt") << read_text(here / "export.txt");
    EXPECT_EQ(in.stop(), 0);
    EXPECT_EQ(out.stop(), 0);
  }
  EXPECT_TRUE(flown);
}

TEST_F(IceoryxFlight, ControlDoesNotSkipATickWhileTheGatewayIsKilledAndFrozen) {
  WASP_START_ROUDI();
  std::uint64_t skipped = 1;
  for (unsigned attempt = 0; attempt < 3 && skipped > 0; ++attempt) {
    const std::filesystem::path here = folder.path / std::to_string(attempt);
    std::filesystem::create_directory(here);
    const std::string instance = unique_instance("ticks");
    Flying flying(here, instance, instance, 8);
    tools::GatewayChaos chaos(*roudi,
                              {built("wasp-iceoryx"), "export", "--all", "--instance", instance, "--wait", "60"},
                              (here / "export.txt").string(), 40 + attempt);
    std::optional<shm::Region> region;
    ASSERT_TRUE(eventually([&] {
      if (!region) region = flying.region();
      return region && run_status(*region).ticks > 5;
    })) << flying.said();
    const std::uint64_t ticks_before = run_status(*region).ticks;
    while (flying.flight->running()) {
      chaos.act();
      std::this_thread::sleep_for(std::chrono::milliseconds(250));
    }
    const auto& status = run_status(*region);
    skipped = status.skipped;
    EXPECT_EQ(status.finished, 1u) << flying.said();
    EXPECT_GT(status.ticks, ticks_before + 100);
    EXPECT_GT(chaos.kills() + chaos.freezes(), 10);
    std::printf("attempt %u: %llu ticks, %llu skipped, %llu frames lost to behaviours; %s; mission %s\n", attempt,
                static_cast<unsigned long long>(status.ticks), static_cast<unsigned long long>(skipped),
                static_cast<unsigned long long>(status.frames_lost), chaos.account().c_str(),
                flying.flown() ? "flown" : "broken off");
    if (skipped == 0) {
      EXPECT_TRUE(flying.flown()) << flying.said();
      EXPECT_EQ(status.frames_lost, 0u);
    }
  }
  EXPECT_EQ(skipped, 0u);
}

}  // namespace
}  // namespace wasp::test
