// Includes go down only: the floors of docs/architecture.md, read from the sources themselves.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>

namespace fs = std::filesystem;

namespace {

/// What each folder may include besides itself.
const std::map<std::string, std::set<std::string>> kMayInclude = {
    {"types", {}},
    {"rt", {"types"}},
    {"shm", {"types", "rt"}},
    {"messages", {"types", "rt"}},
    {"drivers", {"types", "rt", "shm", "messages"}},
    {"vision", {"types"}},
    {"control", {"types"}},
    {"scheduling", {"types", "rt", "shm", "messages", "drivers", "vision", "control"}},
    {"sim", {"types", "rt", "shm", "messages", "drivers", "vision", "control"}},
    {"tools", {"types", "rt", "shm", "messages", "drivers", "vision", "control", "scheduling", "sim"}},
    {"benchmarks", {"types", "rt", "shm", "messages", "drivers", "vision", "control", "scheduling", "sim", "tools"}},
    {"missions", {"types", "rt", "shm", "messages", "drivers", "vision", "control", "scheduling", "sim", "tools"}},
    {"calibration",
     {"types", "rt", "shm", "messages", "drivers", "vision", "control", "scheduling", "sim", "tools"}},
    {"faults", {"types", "rt", "shm", "messages", "drivers", "vision", "control", "scheduling", "sim", "tools"}},
};

/// Violations in one file, as "file includes folder".
std::vector<std::string> violations(const fs::path& file, const std::string& folder,
                                    const std::set<std::string>& allowed) {
  static const std::regex kInclude(R"re(^\s*#\s*include\s*"([a-z_]+)/)re");
  std::vector<std::string> found;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    std::smatch m;
    if (!std::regex_search(line, m, kInclude)) continue;
    const std::string target = m[1];
    if (target != folder && kMayInclude.contains(target) && !allowed.contains(target))
      found.push_back(file.string() + ": " + line);
  }
  return found;
}

TEST(IncludeFloor, IncludesGoDownOnly) {
  const fs::path root = WASP_SOURCE_DIR;
  int files = 0;
  for (const auto& [folder, allowed] : kMayInclude) {
    for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
      const auto ext = entry.path().extension();
      if (ext != ".h" && ext != ".cpp") continue;
      ++files;
      for (const auto& v : violations(entry.path(), folder, allowed)) ADD_FAILURE() << v;
    }
  }
  EXPECT_GT(files, 40);
}

TEST(IncludeFloor, VisionAndControlKnowNoClockThreadFileOrSharedMemory) {
  static const std::regex kForbidden(
      R"re(#\s*include\s*<(thread|mutex|chrono|fstream|iostream|filesystem|condition_variable|future|pthread\.h|sys/.*|unistd\.h|time\.h|ctime)>)re");
  for (const char* folder : {"vision", "control"}) {
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(WASP_SOURCE_DIR) / folder)) {
      if (entry.path().extension() != ".h" && entry.path().extension() != ".cpp") continue;
      std::ifstream in(entry.path());
      for (std::string line; std::getline(in, line);)
        EXPECT_FALSE(std::regex_search(line, kForbidden)) << entry.path() << ": " << line;
    }
  }
}

TEST(IncludeFloor, DetectsAnIncludeThatRunsUp) {
  const fs::path file = fs::temp_directory_path() / "wasp_include_floor_probe.h";
  std::ofstream(file) << "#include \"scheduling/config.h\"\n#include \"types/time.h\"\n";
  EXPECT_EQ(violations(file, "rt", kMayInclude.at("rt")).size(), 1u);
  fs::remove(file);
}

}  // namespace
