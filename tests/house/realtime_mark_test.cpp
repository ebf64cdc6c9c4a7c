// The real-time mark on every declaration that needs it: a header of vision/ or control/ spells noexcept WASP_REALTIME,
// so that no function slips out of the proof (tests/proof).
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <string>
#include <vector>

namespace fs = std::filesystem;

namespace {

/// Lines with a plain noexcept; what is asked of a type, noexcept(...), is no declaration.
std::vector<std::string> unmarked(const fs::path& file) {
  static const std::regex kPlain(R"re(^(?!\s*//).*\bnoexcept\b(?!\s*\())re");
  std::vector<std::string> found;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);)
    if (std::regex_search(line, kPlain)) found.push_back(file.string() + ": " + line);
  return found;
}

TEST(RealtimeMark, EveryNoexceptOfVisionAndControlIsMarked) {
  int files = 0;
  for (const char* folder : {"vision", "control"}) {
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(WASP_SOURCE_DIR) / folder)) {
      if (entry.path().extension() != ".h") continue;
      ++files;
      for (const auto& line : unmarked(entry.path())) ADD_FAILURE() << line << "\n  say WASP_REALTIME instead";
    }
  }
  EXPECT_GT(files, 20);
}

TEST(RealtimeMark, DetectsAPlainNoexcept) {
  const fs::path file = fs::temp_directory_path() / "wasp_realtime_mark_probe.h";
  std::ofstream(file) << "int a() noexcept;\nint b() WASP_REALTIME;\n// noexcept in a comment\n"
                      << "static_assert(noexcept(a()));\n";
  EXPECT_EQ(unmarked(file).size(), 1u);
  fs::remove(file);
}

}  // namespace
