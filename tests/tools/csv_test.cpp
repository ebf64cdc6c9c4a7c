// Whole lines whatever the disk does, and a reader that takes what others left.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <random>

#include "tests/tools/program.h"
#include "tools/csv_file.h"
#include "tools/csv_rows.h"
#include "tools/csv_table.h"

namespace wasp {
namespace {

using tools::CsvFile;
using tools::CsvTable;

TEST(CsvFile, LinesArriveWholeAndInOrder) {
  test::TemporaryFolder folder;
  std::string expected = "a,b\n";
  {
    CsvFile file(folder.path / "x.csv", "a,b");
    for (int i = 0; i < 20'000; ++i) {
      const std::string line = std::to_string(i) + "," + std::string(static_cast<std::size_t>(i % 97), 'x');
      file.line(line);
      expected += line + "\n";
      if (i % 333 == 0) file.flush();
    }
    EXPECT_EQ(file.lines(), 20'000u);
  }
  EXPECT_EQ(test::read_text(folder.path / "x.csv"), expected);
}

TEST(CsvFile, ALineLongerThanAPageIsWhole) {
  test::TemporaryFolder folder;
  { CsvFile(folder.path / "x.csv", "").line(std::string(10'000, 'y')); }
  EXPECT_EQ(test::read_text(folder.path / "x.csv"), std::string(10'000, 'y') + "\n");
}

/// A limit on file size stands in for a full disk.
TEST(CsvFile, FullDiskLosesLinesNotTheFileAndCountsThem) {
  test::TemporaryFolder folder;
  const pid_t child = fork();
  if (child == 0) {
    signal(SIGXFSZ, SIG_IGN);
    const rlimit small{10'000, 10'000};
    setrlimit(RLIMIT_FSIZE, &small);
    CsvFile file(folder.path / "x.csv", "number,text");
    for (int i = 0; i < 1000; ++i) file.line(std::to_string(i) + ",twenty characters...");
    file.flush();
    const auto table = CsvTable::read(folder.path / "x.csv");
    const bool ok = table && !table->cut() && table->bad_lines() == 0 && table->rows() > 300 &&
                    table->rows() + file.failed_lines() == 1000;
    _exit(ok ? 0 : 1);
  }
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST(CsvFile, UnwritablePathNamesIt) {
  try {
    CsvFile file("/nowhere/at/all.csv", "a");
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("/nowhere/at/all.csv"), std::string::npos);
  }
}

TEST(CsvTable, CutAndCrookedLinesAreToldApart) {
  test::TemporaryFolder folder;
  std::ofstream(folder.path / "x.csv") << "a,b,c\n1,2.5,hello\n1,2\n-7,nan,\n9,1e3,wor";
  const auto table = CsvTable::read(folder.path / "x.csv");
  ASSERT_TRUE(table);
  EXPECT_EQ(table->rows(), 2u);
  EXPECT_EQ(table->bad_lines(), 1u);
  EXPECT_TRUE(table->cut());
  EXPECT_EQ(table->integers("a"), (std::vector<std::int64_t>{1, -7}));
  EXPECT_EQ(table->numbers("b")[0], 2.5);
  EXPECT_TRUE(std::isnan(table->numbers("b")[1]));
  EXPECT_EQ(table->texts("c"), (std::vector<std::string>{"hello", ""}));
  EXPECT_TRUE(std::isnan(table->numbers("absent")[0]));
  EXPECT_FALSE(CsvTable::read(folder.path / "absent.csv"));
}

TEST(CsvRows, EveryColumnHasAField) {
  const auto commas = [](std::string_view text) { return std::count(text.begin(), text.end(), ','); };
  EXPECT_EQ(commas(tools::csv_row(ImuSample{}, {})), commas(tools::imu_columns()));
  EXPECT_EQ(commas(tools::csv_row(AttitudeSample{}, {})), commas(tools::attitude_columns()));
  EXPECT_EQ(commas(tools::csv_row(Cue{}, {}, "x")), commas(tools::cue_columns()));
  EXPECT_EQ(commas(tools::csv_row(Command{}, {})), commas(tools::command_columns()));
  EXPECT_EQ(commas(tools::csv_row(Truth{}, {})), commas(tools::truth_columns()));
}

TEST(CsvRows, AnyFiniteFloatRoundTripsToTheBit) {
  std::mt19937 random(1);
  AttitudeSample sample;
  for (int i = 0; i < 100'000; ++i) {
    const auto value = std::bit_cast<float>(static_cast<std::uint32_t>(random()));
    if (!std::isfinite(value)) continue;
    sample.q_ned_body[0] = value;
    const std::string row = tools::csv_row(sample, {});
    const std::size_t begin = row.find(',', row.find(',') + 1) + 1;
    float back = 0;
    std::from_chars(row.data() + begin, row.data() + row.size(), back);
    ASSERT_EQ(std::bit_cast<std::uint32_t>(back), std::bit_cast<std::uint32_t>(value)) << row;
  }
}

}  // namespace
}  // namespace wasp
