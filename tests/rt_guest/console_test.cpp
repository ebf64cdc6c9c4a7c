// What is understood of a guest's console, and what becomes of a guest that dies.
#include "tools/rt_guest/console.h"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/tools/program.h"
#include "tools/rt_guest/machine.h"

namespace wasp::tools::rt_guest {
namespace {

TEST(Console, ReadsAWholeRunInPiecesOfAnySize) {
  const std::string said =
      "EFI stub: booting\r\n@wasp up 6.1.0-rt realtime=1\r\n@wasp start quiet\r\n@wasp tick quiet 20\r\n"
      "[    9.1] some driver speaks\r\n@wasp log quiet      1.2  armed\r\n"
      "@wasp result quiet 0 {\"run\":{\"ticks\":7}}\r\n@wasp error no job 'x'\r\n@wasp end\r\n";
  for (const std::size_t piece : {1u, 7u, 4096u}) {
    Console console;
    for (std::size_t at = 0; at < said.size(); at += piece) {
      EXPECT_FALSE(console.ended());
      console.feed(std::string_view(said).substr(at, piece));
    }
    EXPECT_TRUE(console.ended());
    EXPECT_EQ(console.kernel(), "6.1.0-rt realtime=1");
    EXPECT_EQ(console.running(), "quiet");
    EXPECT_EQ(console.elapsed_s(), 20);
    ASSERT_EQ(console.outcomes().count("quiet"), 1u);
    const JobOutcome& quiet = console.outcomes().at("quiet");
    EXPECT_EQ(quiet.exit_code, 0);
    EXPECT_EQ(quiet.figures["run"]["ticks"], 7);
    EXPECT_EQ(quiet.log, std::vector<std::string>{"     1.2  armed"});
    EXPECT_EQ(console.errors(), std::vector<std::string>{"no job 'x'"});
  }
}

TEST(Console, AResultCutShortIsNoResult) {
  Console console;
  console.feed("@wasp result quiet 0 {\"run\":{\"tic\n");
  EXPECT_FALSE(console.outcomes().at("quiet").figures.is_object());
}

TEST(Console, KeepsTheLastLinesOnly) {
  Console console;
  for (int i = 0; i < 1000; ++i) console.feed("line " + std::to_string(i) + std::string(500, 'x') + "\n");
  EXPECT_LE(console.tail().size(), 40u);
  EXPECT_EQ(console.tail().back().substr(0, 8), "line 999");
  EXPECT_LE(console.tail().back().size(), 200u);
}

/// A stand-in for the emulator that says `script` and ends; found in $PATH before the real one.
class StandIn {
 public:
  explicit StandIn(const std::string& script) {
    const auto program = folder_.path / "qemu-system-aarch64";
    std::ofstream(program) << "#!/bin/sh\n" << script << "\n";
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    setenv("PATH", (folder_.path.string() + ":" + before_).c_str(), 1);
  }
  ~StandIn() { setenv("PATH", before_.c_str(), 1); }
  StandIn(const StandIn&) = delete;
  StandIn& operator=(const StandIn&) = delete;
  Console boot(double patience_s = 600) {
    return rt_guest::boot("arm64", {}, folder_.path / "console.txt", patience_s, [](const Console&) {});
  }

 private:
  std::string before_ = getenv("PATH");
  test::TemporaryFolder folder_;
};

std::string failure_of(StandIn& machine, double patience_s = 600) {
  try {
    machine.boot(patience_s);
  } catch (const std::exception& e) {
    return e.what();
  }
  return "no failure";
}

TEST(Machine, AGuestThatEndsItsJobsIsHeard) {
  StandIn machine("echo '@wasp up k'; echo '@wasp result a 0 {}'; echo '@wasp end'");
  EXPECT_EQ(machine.boot().outcomes().at("a").exit_code, 0);
}

TEST(Machine, ARestartThatTheLastJobWaitedForIsItsEnd) {
  StandIn machine(
      "echo '@wasp up k'; echo '@wasp result dog 0 {}'; echo '@wasp last dog'; echo '@wasp alive dog 1980'; exit 0");
  const auto figures = machine.boot().outcomes().at("dog").figures;
  EXPECT_EQ(figures["restarted"], true);
  EXPECT_EQ(figures["alive_ms"], 1980);
}

TEST(Machine, APanicIsReportedWithTheLastLines) {
  StandIn machine("echo '@wasp up k'; echo 'Kernel panic - not syncing: no init'; exit 0");
  const std::string said = failure_of(machine);
  EXPECT_NE(said.find("before its jobs did"), std::string::npos) << said;
  EXPECT_NE(said.find("Kernel panic - not syncing"), std::string::npos) << said;
}

TEST(Machine, AGuestThatFallsSilentIsEnded) {
  StandIn machine("echo '@wasp up k'; exec sleep 600");
  EXPECT_NE(failure_of(machine, 1.0).find("silent for 1 s"), std::string::npos);
}

TEST(Machine, AMissingEmulatorIsNamedWithItsPackage) {
  const std::string before = getenv("PATH");
  setenv("PATH", "/nowhere", 1);
  std::string said;
  try {
    machine_arguments("arm64", {});
  } catch (const Unavailable& e) {
    said = e.what();
  }
  setenv("PATH", before.c_str(), 1);
  EXPECT_NE(said.find("apt-get install qemu-system-arm"), std::string::npos) << said;
}

}  // namespace
}  // namespace wasp::tools::rt_guest
