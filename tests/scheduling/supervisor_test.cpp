// The supervisor: one file for a provoked miss, bounded in number, and a flight that goes on where none can be written.
#include "scheduling/supervisor.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

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
