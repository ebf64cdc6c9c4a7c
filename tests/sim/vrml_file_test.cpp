#include "sim/vrml_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "sim/renderer.h"

namespace wasp::sim {
namespace {

namespace fs = std::filesystem;

class VrmlFile : public testing::Test {
 protected:
  VrmlFile() : folder_(fs::temp_directory_path() / ("wasp-vrml-" + std::to_string(getpid()))) {
    fs::create_directories(folder_);
  }
  ~VrmlFile() override { fs::remove_all(folder_); }

  fs::path text(const std::string& name, const std::string& content) {
    std::ofstream(folder_ / name) << content;
    return folder_ / name;
  }
  /// The message of the error that reading gives.
  static std::string error_of(const fs::path& file) {
    try {
      read_vrml(file);
    } catch (const std::runtime_error& e) {
      return e.what();
    }
    return "";
  }
  fs::path folder_;
};

struct Picture {
  std::vector<float> luminance, depth_m;
};

/// What a camera at the start, 1.1 m up and pitched down by 20 degrees, sees.
Picture picture_of(const Scene& scene) {
  const Intrinsics k{.width_px = 160, .height_px = 120, .fx_px = 120, .fy_px = 120, .cx_px = 79.5f, .cy_px = 59.5f};
  const Renderer renderer(placed_at_start(scene), k);
  Picture picture{std::vector<float>(160 * 120), std::vector<float>(160 * 120)};
  for (int row = 0; row < 120; row += Renderer::kBandRows)
    renderer.render_band({Vec3(0, 0, -1.1f), R_body_cam_from_pitch_down(Radians{0.35})}, row,
                         picture.luminance.data() + row * 160, picture.depth_m.data() + row * 160);
  return picture;
}

class EveryKind : public VrmlFile, public testing::WithParamInterface<SceneKind> {};

TEST_P(EveryKind, LooksTheSameAfterWritingAndReading) {
  Scene scene = GetParam().make({.seed = 3});
  scene.start_yaw_rad = 0.3f;
  write_vrml(scene, folder_ / "world.wrl");
  const Scene again = read_vrml(folder_ / "world.wrl");
  EXPECT_EQ(again.title, scene.title);
  EXPECT_NEAR(again.start_yaw_rad, 0.3f, 1e-5f);
  EXPECT_LT((again.start_ned_m - scene.start_ned_m).norm(), 1e-5f);
  EXPECT_NEAR(static_cast<double>(again.world.quads.size()), static_cast<double>(scene.world.quads.size()),
              0.02 * static_cast<double>(scene.world.quads.size()))
      << "quads come back as quads, but for slivers";
  const Picture before = picture_of(scene), after = picture_of(again);
  int different = 0, seen = 0;
  for (std::size_t i = 0; i < before.depth_m.size(); ++i) {
    seen += before.depth_m[i] > 0 ? 1 : 0;
    const bool same = std::abs(before.depth_m[i] - after.depth_m[i]) < 1e-3f * (1 + before.depth_m[i]) &&
                      std::abs(before.luminance[i] - after.luminance[i]) < 3.f;
    different += same ? 0 : 1;
  }
  EXPECT_GT(seen, 8000) << "of 19200 pixels: the start looks at something";
  EXPECT_LT(different, 60) << "edges, where a rounding error decides what is hit";
}

TEST_P(EveryKind, SeedDecidesAndNothingStandsWhereTheFlightBegins) {
  const Picture one = picture_of(GetParam().make({.seed = 1})), other = picture_of(GetParam().make({.seed = 2}));
  if (std::string(GetParam().name) != "arena") {
    EXPECT_NE(one.luminance, other.luminance);
  }
  for (const float depth : other.depth_m) EXPECT_TRUE(depth == 0.f || depth > 0.7f);
}

TEST_F(VrmlFile, TheSameSeedMakesTheSameScene) {
  EXPECT_EQ(picture_of(make_scene("city", 7)).luminance, picture_of(make_scene("city", 7)).luminance);
}

INSTANTIATE_TEST_SUITE_P(Kinds, EveryKind, testing::ValuesIn(scene_kinds().begin(), scene_kinds().end()),
                         [](const auto& kind) {
                           std::string name = kind.param.name;
                           std::erase(name, '-');
                           return name;
                         });

constexpr char kHead[] = "#VRML V2.0 utf8\n";

TEST_F(VrmlFile, ForeignFilesArePlacedLitAndTextured) {
  const auto file = text("a.wrl", std::string(kHead) + R"(
    Viewpoint { position 0 0 5 orientation 0 1 0 0 }
    Transform { translation 1 2 3 children Shape {
      appearance Appearance { material Material { diffuseColor .5 .5 .5 }
        texture PixelTexture { image 2 1 1 0x00 0xff } }
      geometry Box { size 2 2 2 } } })");
  const Scene scene = read_vrml(file);
  EXPECT_EQ(scene.world.quads.size(), 6u);
  Vec3 low = scene.world.vertices_ned_m.front(), high = low;
  for (const Vec3& v : scene.world.vertices_ned_m) low = low.cwiseMin(v), high = high.cwiseMax(v);
  EXPECT_LT((low - Vec3(-4, 0, -3)).norm(), 1e-5f);  // north = -z, east = x, down = -y
  EXPECT_LT((high - Vec3(-2, 2, -1)).norm(), 1e-5f);
  EXPECT_LT((scene.start_ned_m - Vec3(-5, 0, 0)).norm(), 1e-5f);
  for (const Surface& s : scene.world.surfaces) EXPECT_NEAR(s.brightness, 0.5f * World::lit(s.normal), 1e-5f);
  EXPECT_EQ(scene.world.textures[static_cast<std::size_t>(scene.world.surfaces[0].texture)].size_px(), 2);
}

/// Where the moving parts' corners are at a time, and nothing else.
std::vector<Vec3> moving_corners(const World& world, double at_s) {
  const World still = world.at(at_s);
  std::vector<Vec3> corners;
  for (std::size_t quad = world.still_quads(); quad < still.quads.size(); ++quad)
    for (const std::uint32_t v : still.quads[quad]) corners.push_back(still.vertices_ned_m[v]);
  const auto before = [](const Vec3& a, const Vec3& b) {
    for (int i = 0; i < 3; ++i)
      if (std::abs(a[i] - b[i]) > 1e-3f) return a[i] < b[i];
    return false;
  };
  std::sort(corners.begin(), corners.end(), before);
  return corners;
}

TEST_F(VrmlFile, WhatMovesMovesTheSameAfterWritingAndReading) {
  for (const char* kind : {"arena-step", "corridor-people"}) {
    const Scene scene = make_scene(kind, 5);
    write_vrml(scene, folder_ / "moving.wrl");
    const Scene again = read_vrml(folder_ / "moving.wrl");
    ASSERT_EQ(again.world.movers.size(), scene.world.movers.size());
    for (std::size_t i = 0; i < scene.world.movers.size(); ++i) {
      const Mover &a = scene.world.movers[i], &b = again.world.movers[i];
      EXPECT_EQ(a.name, b.name);
      EXPECT_EQ(a.looped, b.looped);
      EXPECT_EQ(a.quad_count, b.quad_count);
      ASSERT_EQ(a.keys.size(), b.keys.size());
      for (std::size_t k = 0; k < a.keys.size(); ++k) EXPECT_NEAR(a.keys[k].at_s, b.keys[k].at_s, 1e-4f);
    }
    for (const double t : {0.0, 3.0, 9.99, 10.5, 47.0}) {
      const std::vector<Vec3> before = moving_corners(scene.world, t), after = moving_corners(again.world, t);
      ASSERT_EQ(before.size(), after.size());
      float worst = 0;
      for (std::size_t c = 0; c < before.size(); ++c) worst = std::max(worst, (before[c] - after[c]).norm());
      EXPECT_LT(worst, 2e-3f) << kind << " at " << t;
    }
  }
}

constexpr char kRoutes[] = R"(
    ROUTE Clock.fraction_changed TO Path.set_fraction
    ROUTE Path.value_changed TO Lift.set_translation
)";

TEST_F(VrmlFile, AForeignLiftMovesInsideItsScaledAndTurnedParent) {
  const auto file = text("lift.wrl", std::string(kHead) + R"(
    Transform { translation 10 0 0 rotation 0 1 0 1.5707963 scale 2 2 2 children
      DEF Lift Transform { translation 9 9 9 children Shape { geometry Box { size 1 1 1 } } } }
    Shape { geometry Box { size 1 1 1 } }
    DEF Clock TimeSensor { cycleInterval 4 loop TRUE }
    DEF Path PositionInterpolator { key [ 0.5 1 ] keyValue [ 0 0 0, 1 2 0 ] })" +
                                         kRoutes);
  const World world = read_vrml(file).world;
  ASSERT_EQ(world.movers.size(), 1u);
  EXPECT_EQ(world.movers[0].name, "Lift");
  EXPECT_TRUE(world.movers[0].looped);
  EXPECT_EQ(world.still_quads(), 6u);
  const auto middle = [&](double t) {
    Vec3 sum = Vec3::Zero();
    const std::vector<Vec3> corners = moving_corners(world, t);
    for (const Vec3& c : corners) sum += c / static_cast<float>(corners.size());
    return sum;
  };
  EXPECT_LT((middle(1) - Vec3(0, 10, 0)).norm(), 1e-3f) << "before its first key";
  EXPECT_LT((middle(3) - Vec3(1, 10, -2)).norm(), 1e-3f) << "half of 2 x (1, 2, 0), x of the lift being north";
  EXPECT_LT((moving_corners(world, 1).back() - Vec3(1, 11, 1)).norm(), 1e-3f) << "a box of 2 m";
}

TEST_F(VrmlFile, AMotionThatCannotBeFlownInIsRefusedByName) {
  const auto lift = [&](const char* clock, const char* path, const char* more = "") {
    return error_of(text("m.wrl", std::string(kHead) + "DEF Lift Transform { children Shape { geometry Box { } } }\n" +
                                      "DEF Clock TimeSensor { " + clock + " }\nDEF Path PositionInterpolator { " +
                                      path + " }\n" + kRoutes + more));
  };
  EXPECT_EQ(lift("cycleInterval 2", "key [ 0 1 ] keyValue [ 0 0 0, 1 0 0 ]"), "");
  for (const std::string& error :
       {lift("cycleInterval 2", "key [ 0 1 ] keyValue [ 0 0 0 ]"),
        lift("cycleInterval 2", "key [ 1 0 ] keyValue [ 0 0 0, 1 0 0 ]"),
        lift("cycleInterval 0", "key [ 0 1 ] keyValue [ 0 0 0, 1 0 0 ]"),
        lift("cycleInterval 2", "key [ 0 1 ] keyValue [ 0 0 0, 1e9 0 0 ]"),
        lift("cycleInterval 2", "key [ 0 1 ] keyValue [ 0 0 0, 1 0 0 ]",
             "DEF Turn OrientationInterpolator { key [ 0 1 ] keyValue [ 0 1 0 0, 1 0 0 1 ] }\n"
             "ROUTE Clock.fraction_changed TO Turn.set_fraction\nROUTE Turn.value_changed TO Lift.set_rotation\n")}) {
    EXPECT_NE(error.find("m.wrl"), std::string::npos) << error;
  }
  const std::string nested =
      error_of(text("n.wrl", std::string(kHead) + R"(
    DEF Lift Transform { children DEF Inner Transform { children Shape { geometry Box { } } } }
    DEF Clock TimeSensor { } DEF Path PositionInterpolator { key [ 0 1 ] keyValue [ 0 0 0, 1 0 0 ] })" +
                                 kRoutes + "ROUTE Path.value_changed TO Inner.set_translation\n"));
  EXPECT_NE(nested.find("within another"), std::string::npos) << nested;
}

TEST_F(VrmlFile, OrdinaryDamageIsAnErrorThatNamesTheFile) {
  const std::string png("\x89PNG\r\n\x1a\n\0\0\0", 11);
  for (const std::string& content :
       {png, std::string(4096, '\xff'), std::string(kHead) + "Shape { geometry Box {", std::string(kHead) + "}}}}",
        std::string(kHead) + "ROUTE a.b TO c.d\n", std::string("<X3D></X3D>"),
        std::string(kHead) + "Shape { geometry IndexedFaceSet { coord Coordinate { point [ 0 0 0 ] } coordIndex [ 0 7 "
                             "8 -1 ] } }\n"})
    EXPECT_NE(error_of(text("damaged.wrl", content)).find("damaged.wrl"), std::string::npos) << content.substr(0, 60);
  write_vrml(make_scene("city", 1), folder_ / "whole.wrl");
  std::ostringstream whole;
  whole << std::ifstream(folder_ / "whole.wrl").rdbuf();
  const std::string cut = error_of(text("damaged.wrl", whole.str().substr(0, whole.str().size() / 2)));
  EXPECT_NE(cut.find("damaged.wrl"), std::string::npos) << "a file cut off in the middle";
  EXPECT_NE(cut.find("line"), std::string::npos) << cut;
}

TEST_F(VrmlFile, NothingIsLeftOfAWorldWhoseLastFileFails) {
  fs::create_directories(folder_ / "w.wrl.part" / "in the way");
  EXPECT_THROW(write_vrml(make_scene("wall", 1), folder_ / "w.wrl"), std::runtime_error);
  fs::create_directories(folder_ / "v.wrl" / "in the way");
  EXPECT_THROW(write_vrml(make_scene("wall", 1), folder_ / "v.wrl"), std::runtime_error);
  int entries = 0;
  for ([[maybe_unused]] const auto& entry : fs::directory_iterator(folder_)) ++entries;
  EXPECT_EQ(entries, 2) << "textures are gone again";
}

TEST_F(VrmlFile, ASmoothWorldComesBackSmooth) {
  write_vrml(make_scene("edges", 2), folder_ / "edges.wrl");
  EXPECT_TRUE(read_vrml(folder_ / "edges.wrl").world.smooth);
  write_vrml(make_scene("ground", 2), folder_ / "ground.wrl");
  EXPECT_FALSE(read_vrml(folder_ / "ground.wrl").world.smooth);
}

TEST_F(VrmlFile, WhatIsNoWorldIsSaidByFileAndReason) {
  EXPECT_NE(error_of(folder_ / "absent.wrl").find("absent.wrl: cannot be read"), std::string::npos);
  EXPECT_NE(error_of(text("b.wrl", "#VRML V1.0 ascii\nCube {}\n")).find("b.wrl:1: not VRML97"), std::string::npos);
  EXPECT_NE(error_of(text("c.wrl", "")).find("c.wrl"), std::string::npos);
  EXPECT_NE(error_of(text("d.wrl", kHead)).find("d.wrl: no geometry"), std::string::npos);
  const std::string broken = error_of(text("e.wrl", std::string(kHead) + "\nShape {\n geometry Bx { }\n}\n"));
  EXPECT_NE(broken.find("e.wrl"), std::string::npos);
  EXPECT_NE(broken.find("e.wrl:4"), std::string::npos) << broken;
  const auto face = [](const char* corner) {
    return std::string(kHead) + "Shape { geometry IndexedFaceSet { coord Coordinate { point [ 0 0 0, 1 0 0, " + corner +
           " ] } coordIndex [ 0, 1, 2, -1 ] } }\n";
  };
  EXPECT_NE(error_of(text("f.wrl", face("1e9 1 0"))).find("not finite or beyond"), std::string::npos);
  EXPECT_FALSE(error_of(text("g.wrl", face("nan 1 0"))).empty());
  EXPECT_EQ(error_of(text("h.wrl", face("1 1 0"))), "");
  const auto textured = text("i.wrl", std::string(kHead) +
                                          "Shape { appearance Appearance { texture ImageTexture { url \"gone.png\" } } "
                                          "geometry Box { } }\n");
  EXPECT_NE(error_of(textured).find("gone.png"), std::string::npos);
}

TEST_F(VrmlFile, WhatCoinWouldCrashHangOrReadOnIsRefusedByName) {
  const auto refused = [&](const std::string& body, const char* reason) {
    const std::string error = error_of(text("hostile.wrl", std::string(kHead) + "\n" + body));
    EXPECT_NE(error.find("hostile.wrl"), std::string::npos) << error;
    EXPECT_NE(error.find(reason), std::string::npos) << error;
  };
  const auto face = [](const std::string& more) {
    return "Shape { geometry IndexedFaceSet { coord Coordinate { point [0 0 0, 1 0 0, 1 1 0] } " + more + " } }";
  };
  refused(face("coordIndex [0, 1, 2147483647, -1]"), "index");
  refused(face("coordIndex [0, 1, -2, -1]"), "index");
  refused(face("coordIndex [0 1 2 -1] texCoord TextureCoordinate { point [0 0] } texCoordIndex [0 0 7 -1]"), "index");
  refused(face("coordIndex [0 1 2 -1] normal Normal { vector [0 0 1] }"), "index");
  refused(face("coordIndex [0 1 2 -1] color Color { color [1 0 0] } colorIndex [0]"), "fewer indices");
  refused("Shape { geometry ElevationGrid { xDimension 50000 zDimension 50000 height [1 2] } }", "heights");
  refused("Shape { geometry Extrusion { spine [0 0 0] } }", "Extrusion");
  refused("Shape { appearance Appearance { texture PixelTexture { image 16000 16000 4 0 } } geometry Box {} }",
          "picture");
  refused("DEF A Group { children [ Shape { geometry Box {} } USE A ] }", "");
  std::string doubling = "DEF A0 Shape { geometry Box {} }\n";
  for (int i = 1; i < 60; ++i) {
    const std::string inner = "USE A" + std::to_string(i - 1);
    doubling += "DEF A" + std::to_string(i) + " Group { children [ " + inner + " " + inner + " ] }\n";
  }
  refused(doubling, "instances");
  std::string deep;
  for (int i = 0; i < 100'000; ++i) deep += "Group { children [";
  refused(deep, "nested too deep");
  refused("\nInline { url \"/dev/stdin\" }", ":4: node Inline");
  const std::string look = "Shape { appearance Appearance { texture ImageTexture { url ";
  refused(look + "\"/dev/stdin\" } } geometry Box {} }", "not a regular file");
  refused(look + "[ \"a.png\" \"\\/dev/stdin\" ] } } geometry Box {} }", "backslash");
  refused("Script { url \"javascript:\" }", "node Script");
  refused("EXTERNPROTO P [] \"/dev/stdin\"", "EXTERNPROTO");
  refused("File { name \"/dev/stdin\" }", "not a node of VRML97");
  refused("PROTO P [] { P {} }\nP {}", "not a node of VRML97");
  refused("DEF A Group { children [ DEF B Shape { geometry IndexedFaceSet { coord #" + std::string(kHead) +
              " Coordinate { point [0 0 0, 1 0 0] } coordIndex [0, 1, 2, -1] } } USE B ] }\nUSE A\n",
          "");  // Coin 4.0.0 reads wild here: found by a fuzzer after 185,000 worlds
  EXPECT_EQ(
      error_of(text("proto.wrl", std::string(kHead) + "PROTO P [ field SFVec3f s 1 1 1 ] { Shape { geometry Box { "
                                                      "size IS s } } }\nP { s 2 2 2 }\n")),
      "");
}

/// Coin hides what stands inside a Shape: the path of a search ends at the Shape instead.
TEST_F(VrmlFile, NodesInPlacesThatAreNotTheirsDoNotMislead) {
  const std::string box = std::string(kHead) + "\nShape { geometry Box { } }\n";
  for (const char* node : {"WorldInfo", "Viewpoint", "Background", "Transform"})
    for (const char* field : {"geometry", "appearance"}) {
      const std::string error = error_of(text("odd.wrl", box + "Shape { " + field + " " + node + " { } }\n"));
      EXPECT_EQ(error.find("library fails"), std::string::npos) << node << " as " << field << ": " << error;
    }
  const fs::path titled = text("titled.wrl", box + "Shape { geometry WorldInfo { title \"inside\" } }\n");
  EXPECT_EQ(read_vrml(titled).title, "inside");
}

TEST_F(VrmlFile, AFileThatCannotBeWrittenLeavesNothing) {
  EXPECT_THROW(write_vrml(make_scene("ground", 1), folder_ / "no" / "such" / "folder.wrl"), std::runtime_error);
  EXPECT_THROW(write_vrml(Scene{}, folder_ / "empty.wrl"), std::runtime_error);
  EXPECT_TRUE(fs::is_empty(folder_));
  EXPECT_THROW(make_scene("moon", 1), std::runtime_error);
}

}  // namespace
}  // namespace wasp::sim
