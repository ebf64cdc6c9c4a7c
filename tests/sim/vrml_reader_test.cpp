// A child that parses in our stead: its deaths are errors of the file, and the next world is read all the same.
#include "sim/vrml_reader.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <csignal>
#include <cstring>
#include <stdexcept>

namespace wasp::sim {
namespace {

namespace fs = std::filesystem;

Scene of_one_face(const fs::path& file) {
  Scene scene;
  scene.title = file.string();
  scene.world.textures.push_back(Texture(1, [](int, int) { return 1.0; }));
  scene.world.add_quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {});
  return scene;
}

/// What a library might do with a file of that name.
Scene parse_or_die(const fs::path& file) {
  if (file == "wild") raise(SIGSEGV);
  if (file == "aborts") std::abort();
  if (file == "exits") _exit(7);
  if (file == "refused") throw std::runtime_error("refused:3: no world");
  Scene scene = of_one_face(file);
  if (file == "damaged") scene.world.quads[0][2] = 1000;
  return scene;
}

std::string error_of(VrmlReader& reader, const char* file) {
  try {
    reader.read(file);
  } catch (const std::runtime_error& e) {
    return e.what();
  }
  return "";
}

TEST(VrmlReader, OneChildReadsManyWorlds) {
  VrmlReader reader(of_one_face);
  EXPECT_EQ(reader.pid(), 0);
  EXPECT_EQ(reader.read("first").title, "first");
  const pid_t child = reader.pid();
  EXPECT_GT(child, 0);
  EXPECT_EQ(reader.read("second").title, "second");
  EXPECT_EQ(reader.pid(), child);
  reader.replace();
  EXPECT_EQ(kill(child, 0), -1) << "ended and reaped";
  EXPECT_EQ(reader.read("third").title, "third");
}

TEST(VrmlReader, WhateverItDiesOfIsAnErrorOfTheFileAndTheNextWorldIsRead) {
  VrmlReader reader(parse_or_die);
  EXPECT_EQ(error_of(reader, "refused"), "refused:3: no world");
  const pid_t first = reader.pid();
  for (const auto& [file, how] : {std::pair{"wild", strsignal(SIGSEGV)}, {"aborts", strsignal(SIGABRT)}}) {
    const std::string error = error_of(reader, file);
    EXPECT_EQ(error, std::string(file) + ": the VRML library fails on this file: " + how);
    EXPECT_EQ(reader.read("good").title, "good");
  }
  EXPECT_NE(error_of(reader, "exits").find("exit code 7"), std::string::npos);
  EXPECT_NE(error_of(reader, "damaged").find("damaged: scene: a face without its corner"), std::string::npos)
      << "what comes back is not believed";
  EXPECT_NE(reader.pid(), first);
  EXPECT_EQ(kill(first, 0), -1);
}

}  // namespace
}  // namespace wasp::sim
