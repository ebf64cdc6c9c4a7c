// The program as a user runs it. Nothing here depends on how fast the host is: the short set judges whether things
// came, never when.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "shm/region.h"
#include "tests/tools/program.h"

namespace wasp::test {
namespace {

const std::string kFaults = program_path("wasp-faults");

/// Regions of a campaign with this process number.
std::vector<std::string> regions_of(const std::string& pid) { return shm::Region::list("wasp.faults-" + pid + "-"); }

TEST(FaultsProgram, ListsItsCatalogueAndRefusesBadArguments) {
  const auto [list, code] = run_shell(kFaults + " --list");
  EXPECT_EQ(code, 0);
  EXPECT_NE(list.find("camera-freeze"), std::string::npos);
  EXPECT_NE(list.find("hover"), std::string::npos);
  EXPECT_EQ(run_shell(kFaults + " --help").second, 0);
  EXPECT_EQ(run_shell(kFaults + " --phase nowhere 2>&1").second, 2);
  EXPECT_EQ(run_shell(kFaults + " --class 19 2>&1").second, 2);
}

TEST(FaultsProgram, HostileInputIsRefusedByName) {
  TemporaryFolder out;
  const auto [text, code] =
      run_shell(kFaults + " --class 17 --out " + out.path.string() + " --json " + (out.path / "r.json").string());
  EXPECT_EQ(code, 0) << text;
  const auto json = nlohmann::json::parse(read_text(out.path / "r.json"));
  EXPECT_GE(json["cells"].size(), 15u);
  for (const auto& cell : json["cells"]) EXPECT_NE(cell["verdict"], "MISS") << cell;
}

TEST(FaultsProgram, TheShortSetKeepsItsPromisesAndLeavesNothing) {
  TemporaryFolder out;
  std::string text;
  int code = 1;
  for (int attempt = 0; attempt < 3 && code != 0; ++attempt) {  // a host that stands still breaks one, a defect all
    const std::string run = (out.path / std::to_string(attempt)).string();
    std::tie(text, code) = run_shell(kFaults + " --short --out " + run + " 2>&1");
  }
  EXPECT_EQ(code, 0) << text;
  EXPECT_NE(text.find(" 0 MISS"), std::string::npos) << text;
  EXPECT_EQ(text.find("never came so far"), std::string::npos) << text;
}

TEST(FaultsProgram, FlightsThatWereWeakenedOnPurposeComeOutAsMisses) {
  TemporaryFolder out;
  const auto [text, code] = run_shell(kFaults + " --negative --out " + out.path.string() + " 2>&1");
  EXPECT_EQ(code, 0) << text;
  EXPECT_NE(text.find("the bar fails, as it must"), std::string::npos) << text;
  EXPECT_EQ(text.find("NOT SEEN"), std::string::npos) << text;
}

TEST(FaultsProgram, AnInterruptEndsEverythingItStarted) {
  TemporaryFolder out;
  Program faults(
      {kFaults, "--only", "^line-silence$", "--phase", "hover", "--seeds", "50", "--out", out.path.string()});
  const auto flies = [&] {
    for (const auto& entry : std::filesystem::directory_iterator(out.path))
      if (read_text(entry.path() / "flight.txt").find("mission") != std::string::npos) return true;
    return false;
  };
  ASSERT_TRUE(eventually(flies));
  std::string pid;
  for (const auto& entry : std::filesystem::directory_iterator(out.path)) {
    const std::string name = entry.path().filename().string();  // faults-PID-N
    pid = name.substr(7, name.find('-', 7) - 7);
  }
  EXPECT_FALSE(regions_of(pid).empty());
  faults.signal(SIGINT);
  const int code = faults.wait();
  EXPECT_EQ(code, 4) << "interrupted, nothing broken";
  EXPECT_TRUE(regions_of(pid).empty());
  const auto [left, ignored] = run_shell("pgrep -fc 'instance faults-" + pid + "-' || true");
  EXPECT_EQ(std::stoi(left), 1) << "only the shell that asks";
}

}  // namespace
}  // namespace wasp::test
