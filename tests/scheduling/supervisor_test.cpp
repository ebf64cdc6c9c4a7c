// The supervisor: one file for a provoked miss, bounded in number, and a flight that goes on where none can be written.
#include "scheduling/supervisor.h"

#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "shm/bus_guard.h"
#include "tests/scheduling/control_bench.h"

namespace wasp::scheduling {
namespace {

namespace fs = std::filesystem;

class SupervisorTest : public ::testing::Test {
 protected:
  SupervisorTest() {
    std::string pattern = (fs::temp_directory_path() / "wasp_incidents_XXXXXX").string();
    root_ = mkdtemp(pattern.data());
    options_.instance = "test";
    options_.incident_dir = (root_ / "incidents").string();
    options_.trace_switches = false;
  }
  ~SupervisorTest() override { fs::remove_all(root_); }

  std::vector<fs::path> files() const {
    std::vector<fs::path> list;
    if (fs::exists(options_.incident_dir))
      for (const auto& e : fs::directory_iterator(options_.incident_dir)) list.push_back(e.path());
    return list;
  }
  static std::string text_of(const fs::path& path) {
    std::ifstream file(path);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  /// The last line of a file.
  static nlohmann::json json_of(const fs::path& path) {
    std::ifstream file(path);
    std::string line, last;
    while (std::getline(file, line))
      if (!line.empty()) last = line;
    return nlohmann::json::parse(last);
  }
  std::function<void(const std::string&)> logger() {
    return [this](const std::string& line) { log_.push_back(line); };
  }
  int said(const std::string& words) const {
    return static_cast<int>(
        std::count_if(log_.begin(), log_.end(), [&](const auto& l) { return l.find(words) != std::string::npos; }));
  }
  /// A miss far from the last one.
  Miss a_miss() {
    Miss m;
    m.number = ++tick_;
    m.due_at_ns = static_cast<TimeNs>(tick_) * 10 * kSecond;
    m.released_at_ns = m.due_at_ns + kMillisecond;
    m.computed_at_ns = m.due_at_ns + 2 * kMillisecond;
    m.written_at_ns = m.due_at_ns + 12 * kMillisecond;
    m.late_ns = 12 * kMillisecond;
    m.limit_ns = 10 * kMillisecond;
    m.usage.involuntary_switches = 3;
    return m;
  }

  fs::path root_;
  SupervisorOptions options_;
  std::vector<std::string> log_;
  RunStatus status_;
  std::uint64_t tick_ = 0;
};

TEST_F(SupervisorTest, AProvokedMissOfTheControlThreadWritesExactlyOneFile) {
  for (int attempt = 0; attempt < 5; ++attempt) {  // a host that stands still by itself adds misses of its own
    fs::remove_all(options_.incident_dir);
    log_.clear();
    ControlBench bench({});
    Supervisor supervisor(bench.board, bench.status(), options_, logger());
    bench.start();
    ASSERT_TRUE(bench.wait_until_flying());
    supervisor.look();
    if (!files().empty()) continue;
    bench.stall_once(130 * kMillisecond);
    for (int i = 0; i < 1200 && (bench.stalled_tick() == 0 || files().empty()); ++i) {
      rt::sleep_until(rt::now() + Supervisor::kPeriod);
      supervisor.look();
    }
    ASSERT_TRUE(bench.wait_for_tick(bench.stalled_tick() + 6));
    supervisor.look();
    bench.end();
    if (files().size() > 1) continue;
    ASSERT_EQ(files().size(), 1u);
    EXPECT_EQ(bench.status().incidents.load(), 1u);
    const std::string text = text_of(files()[0]);
    const auto doc = json_of(files()[0]);
    if (doc["tick"].get<std::uint64_t>() != bench.stalled_tick()) continue;
    EXPECT_EQ(doc["thread"], "control");
    EXPECT_GE(doc["late_ns"].get<DurationNs>(), 130 * kMillisecond);
    EXPECT_TRUE(doc.contains("involuntary_switches"));
    EXPECT_EQ(doc["threads"][0]["name"], "control");
    EXPECT_GT(doc["threads"][0]["events"].size(), 3u);
    EXPECT_NE(text.find("control: deadline missed, tick " + std::to_string(bench.stalled_tick())), std::string::npos)
        << text;
    EXPECT_NE(text.find("involuntary switches"), std::string::npos);
    EXPECT_NE(text.find("ready and waiting"), std::string::npos);
    EXPECT_EQ(said("incident 1: control: deadline missed"), 1);
    EXPECT_EQ(bench.board.frozen.load(), 0u);  // and the trace runs again
    return;
  }
  ADD_FAILURE() << "not once in five attempts";
}

TEST_F(SupervisorTest, TheNumberOfFilesIsBoundedAndSaidOnce) {
  options_.incidents = 3;
  WatchBoard board;
  ThreadWatch& control = board.add({"control", 0, 80, kMillisecond});
  Supervisor supervisor(board, status_, options_, logger());
  for (int i = 0; i < 10; ++i) {
    control.report(a_miss());
    supervisor.look();
  }
  EXPECT_EQ(files().size(), 3u);
  EXPECT_EQ(said("are the limit of this flight"), 1);
  EXPECT_EQ(status_.incidents.load(), 3u);
  EXPECT_EQ(board.frozen.load(), 0u);
}

TEST_F(SupervisorTest, MissesThatFollowSoonBelongToTheSameIncident) {
  WatchBoard board;
  ThreadWatch& control = board.add({"control", 0, 80, kMillisecond});
  Supervisor supervisor(board, status_, options_, logger());
  Miss m = a_miss();
  control.report(m);
  supervisor.look();
  m.due_at_ns += 50 * kMillisecond;
  control.report(m);
  supervisor.look();
  EXPECT_EQ(files().size(), 1u);
  control.report(a_miss());
  supervisor.look();
  EXPECT_EQ(files().size(), 2u);
  EXPECT_EQ(said("1 more misses followed"), 1);
}

TEST_F(SupervisorTest, ABehaviourGetsOneFileAndCannotUseUpTheRoomOfControl) {
  options_.incidents = 2;
  WatchBoard board;
  ThreadWatch& behaviour = board.add({"edge_altitude", 0, 40, kMillisecond, true});
  ThreadWatch& control = board.add({"control", 0, 80, kMillisecond});
  Supervisor supervisor(board, status_, options_, logger());
  for (int i = 0; i < 5; ++i) {
    Miss m = a_miss();
    m.kind = MissKind::kOverBudget;
    behaviour.report(m);
    supervisor.look();
  }
  EXPECT_EQ(files().size(), 1u);
  EXPECT_NE(text_of(files()[0]).find("edge_altitude: over budget, frame 1"), std::string::npos);
  control.report(a_miss());
  supervisor.look();
  EXPECT_EQ(files().size(), 2u);
}

TEST_F(SupervisorTest, AFolderThatCannotBeWrittenIsSaidOnceAndTheFlightGoesOn) {
  std::ofstream(root_ / "file") << "not a folder";
  options_.incident_dir = (root_ / "file" / "incidents").string();
  WatchBoard board;
  ThreadWatch& control = board.add({"control", 0, 80, kMillisecond});
  Supervisor supervisor(board, status_, options_, logger());
  for (int i = 0; i < 5; ++i) {
    control.report(a_miss());
    supervisor.look();
  }
  EXPECT_EQ(said("no incident file can be written"), 1);
  EXPECT_EQ(said(options_.incident_dir), 1);
  EXPECT_EQ(log_.size(), 1u);
  EXPECT_EQ(board.frozen.load(), 0u);
}

TEST_F(SupervisorTest, LostPagesAreCountedAndNamed) {
  options_.incidents = 0;
  shm::install_bus_guard();
  const std::string name = "test-lost-" + std::to_string(getpid());
  const shm::Region region =
      shm::Region::create(name, std::vector<shm::TopicSpec>{{"data", "T", shm::TopicKind::kBlock, 1, 5 * shm::kPage}});
  WatchBoard board;
  Supervisor supervisor(board, status_, options_, logger());
  supervisor.look();
  ASSERT_EQ(truncate(("/dev/shm/" + name).c_str(), 0), 0);
  for (std::size_t page = 0; page < 3; ++page)
    EXPECT_EQ(*reinterpret_cast<const volatile std::uint64_t*>(region.at(page * shm::kPage)), 0u);
  supervisor.look();
  supervisor.look();
  EXPECT_EQ(said("shared memory lost: 3 pages of " + name), 1);
  EXPECT_EQ(status_.pages_lost.load(), 3u);
  shm::Region::remove(name);
}

TEST_F(SupervisorTest, ACoreStolenFromControlIsSaidWithinOneLookAndBarsArming) {
  cpu_set_t all;
  ASSERT_EQ(sched_getaffinity(0, sizeof all, &all), 0);
  if (CPU_COUNT(&all) < 2) GTEST_SKIP() << "one core only";
  options_.real_time = false;
  options_.incidents = 0;
  const int core = rt::nearest_usable_core(0);
  ControlBench bench({.control_thread = {.name = "control", .core = core}});
  bench.autopilot_refuses = true;
  Supervisor supervisor(bench.board, bench.status(), options_, logger());
  bench.start();
  ASSERT_TRUE(bench.wait_for_tick(3));
  for (int i = 0; i <= ScheduleWatch::kTakeBacks; ++i) {  // once more than it is taken back
    ASSERT_EQ(sched_setaffinity(bench.watch->tid.load(), sizeof all, &all), 0);
    supervisor.look();
  }
  EXPECT_EQ(bench.status().schedule_thefts.load(), 4u);
  EXPECT_EQ(said("control: SCHED_OTHER on core"), 4);
  ASSERT_TRUE(bench.wait_for_said("not arming: control does not run as the thread table says"));
  bench.wire();
  ASSERT_TRUE(bench.wait_for_more_ticks(30));
  for (const auto& m : bench.wire()) EXPECT_EQ(std::get_if<mavlink::CommandLong>(&m), nullptr);  // nothing is asked
  cpu_set_t own;
  CPU_ZERO(&own);
  CPU_SET(core, &own);
  ASSERT_EQ(sched_setaffinity(bench.watch->tid.load(), sizeof own, &own), 0);
  supervisor.look();
  bench.autopilot_refuses = false;
  EXPECT_TRUE(bench.wait_until_flying());
}

TEST_F(SupervisorTest, NoIncidentsWantedMeansNoFileAndNoWord) {
  options_.incidents = 0;
  WatchBoard board;
  ThreadWatch& control = board.add({"control", 0, 80, kMillisecond});
  Supervisor supervisor(board, status_, options_, logger());
  control.report(a_miss());
  supervisor.look();
  EXPECT_TRUE(files().empty());
  EXPECT_TRUE(log_.empty());
}

}  // namespace
}  // namespace wasp::scheduling
