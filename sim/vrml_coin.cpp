// Coin parses and hands out triangles with their material, texture coordinates and place; two that make a planar quad
// of one surface become one again. What moves (sim/vrml_motion.h) is gathered apart and put behind the rest.
#include "sim/vrml_coin.h"

#include <Inventor/SbMatrix.h>
#include <Inventor/SoDB.h>
#include <Inventor/SoInput.h>
#include <Inventor/SoPrimitiveVertex.h>
#include <Inventor/VRMLnodes/SoVRMLAppearance.h>
#include <Inventor/VRMLnodes/SoVRMLBackground.h>
#include <Inventor/VRMLnodes/SoVRMLGroup.h>
#include <Inventor/VRMLnodes/SoVRMLImageTexture.h>
#include <Inventor/VRMLnodes/SoVRMLPixelTexture.h>
#include <Inventor/VRMLnodes/SoVRMLShape.h>
#include <Inventor/VRMLnodes/SoVRMLTransform.h>
#include <Inventor/VRMLnodes/SoVRMLViewpoint.h>
#include <Inventor/VRMLnodes/SoVRMLWorldInfo.h>
#include <Inventor/actions/SoCallbackAction.h>
#include <Inventor/actions/SoSearchAction.h>
#include <Inventor/errors/SoDebugError.h>
#include <Inventor/errors/SoReadError.h>
#include <Inventor/nodes/SoShape.h>

#include <bit>
#include <cmath>
#include <map>
#include <stdexcept>

#include "drivers/image_file.h"
#include "sim/lab_textures.h"
#include "sim/vrml_exposure.h"
#include "sim/vrml_motion.h"
#include "sim/vrml_search.h"
#include "sim/vrml_shapes.h"
#include "sim/vrml_text.h"

namespace wasp::sim {
namespace {

namespace fs = std::filesystem;
constexpr float kFarthest_m = 1e5f;
constexpr int kMaxTexturePx = 4096;

std::string read_errors;  // of the parse under way

Vec3 ned_of(const SbVec3f& p) { return {-p[2], p[0], -p[1]}; }

/// A grey image as a square texture whose side is a power of two.
Texture texture_of(const drivers::Image<std::uint8_t>& image) {
  const int longest = std::min(std::max(image.width_px, image.height_px), kMaxTexturePx);
  const int side = static_cast<int>(std::bit_ceil(static_cast<unsigned>(longest)));
  return Texture(side, [&](int u, int v) {
    const int x = static_cast<int>((static_cast<double>(u) + 0.5) * image.width_px / side);
    const int y = static_cast<int>((static_cast<double>(v) + 0.5) * image.height_px / side);
    return image.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width_px) +
                        static_cast<std::size_t>(x)] /
           255.0;
  });
}

/// The picture inside a PixelTexture: 1 ... 4 components, the first row is the lowest.
drivers::Image<std::uint8_t> grey_of(const SoSFImage& field) {
  SbVec2s size;
  int components = 0;
  const unsigned char* bytes = field.getValue(size, components);
  drivers::Image<std::uint8_t> image{size[0], size[1], {}};
  for (int y = size[1] - 1; y >= 0; --y)
    for (int x = 0; x < size[0]; ++x) {
      const unsigned char* p = bytes + (y * size[0] + x) * components;
      image.pixels.push_back(components >= 3 ? static_cast<std::uint8_t>((p[0] * 77 + p[1] * 151 + p[2] * 28) >> 8)
                                             : p[0]);
    }
  return image;
}

class Builder {
 public:
  Builder(fs::path file, bool baked, const VrmlMotions& motions)
      : file_(std::move(file)), baked_(baked), motions_(motions) {
    world_.textures.push_back(Texture(1, [](int, int) { return 1.0; }));
    world_.textures.push_back(paint_detail());
  }

  static SoCallbackAction::Response on_appearance(void* self, SoCallbackAction*, const SoNode* node) {
    static_cast<Builder*>(self)->appearance(*static_cast<const SoVRMLAppearance*>(node));
    return SoCallbackAction::CONTINUE;
  }
  static SoCallbackAction::Response after_shape(void* self, SoCallbackAction*, const SoNode*) {
    static_cast<Builder*>(self)->texture_ = 0;
    return SoCallbackAction::CONTINUE;
  }
  static SoCallbackAction::Response before_transform(void* self, SoCallbackAction* action, const SoNode* node) {
    static_cast<Builder*>(self)->enter(*static_cast<const SoVRMLTransform*>(node), action->getModelMatrix());
    return SoCallbackAction::CONTINUE;
  }
  static SoCallbackAction::Response after_transform(void* self, SoCallbackAction*, const SoNode* node) {
    static_cast<Builder*>(self)->leave(*static_cast<const SoVRMLTransform*>(node));
    return SoCallbackAction::CONTINUE;
  }
  static void on_triangle(void* self, SoCallbackAction* action, const SoPrimitiveVertex* a, const SoPrimitiveVertex* b,
                          const SoPrimitiveVertex* c) {
    static_cast<Builder*>(self)->triangle(*action, {a, b, c});
  }

  /// Coin is no place to throw through: the first problem waits until the traversal is over.
  World take() {
    if (!problem_.empty()) throw std::runtime_error(file_.string() + ": " + problem_);
    for (const Part& part : parts_) append_part(part);
    if (world_.quads.empty()) throw std::runtime_error(file_.string() + ": no geometry");
    return std::move(world_);
  }

 private:
  struct Corner {
    Vec3 p;
    float u, v;
  };
  /// A moving part: its faces, less the parent's place, and where it goes.
  struct Part {
    const SoVRMLTransform* node = nullptr;  ///< for comparison only
    std::string name;
    std::vector<MoverKey> keys;
    bool looped = false;
    Vec3 origin = Vec3::Zero();
    World faces;
  };

  void enter(const SoVRMLTransform& node, const SbMatrix& parent) {
    const auto motion = motions_.find(&node);
    if (motion == motions_.end() || !problem_.empty()) return;
    if (moving_) {
      problem_ = "a moving Transform within another";
      return;
    }
    SbVec3f origin;
    parent.multVecMatrix(SbVec3f(0, 0, 0), origin);
    try {
      parts_.push_back({&node,
                        node.getName().getString(),
                        keys_in_world(motion->second, parent),
                        motion->second.looped,
                        ned_of(origin),
                        {}});
      moving_ = true;
    } catch (const std::exception& e) {
      problem_ = e.what();
    }
    for (const MoverKey& key : moving_ ? parts_.back().keys : std::vector<MoverKey>{})
      if (!near_enough(key.place.position_ned_m)) problem_ = "a place on a path is not finite or beyond 1e5 m";
  }
  void leave(const SoVRMLTransform& node) {
    if (moving_ && parts_.back().node == &node) moving_ = false;
  }
  static bool near_enough(const Vec3& p) { return p.allFinite() && p.cwiseAbs().maxCoeff() <= kFarthest_m; }
  /// Where faces go just now.
  World& faces() { return moving_ ? parts_.back().faces : world_; }

  void append_part(const Part& part) {
    if (part.faces.quads.empty()) return;
    world_.begin_mover(!part.name.empty() ? part.name : "part_" + std::to_string(world_.movers.size()), part.keys,
                       part.looped);
    const auto first = static_cast<std::uint32_t>(world_.vertices_ned_m.size());
    for (const Vec3& v : part.faces.vertices_ned_m) world_.vertices_ned_m.push_back(v);
    for (auto quad : part.faces.quads) {
      for (auto& v : quad) v += first;
      world_.quads.push_back(quad);
    }
    for (const Surface& s : part.faces.surfaces) world_.surfaces.push_back(s);
    world_.end_mover();
  }

  void appearance(const SoVRMLAppearance& a) {
    texture_ = 0;
    const SoNode* node = a.texture.getValue();
    if (node == nullptr || !problem_.empty()) return;
    if (node->isOfType(SoVRMLImageTexture::getClassTypeId())) {
      const auto& url = static_cast<const SoVRMLImageTexture*>(node)->url;
      if (url.getNum() > 0) texture_ = image_texture(url[0].getString());
    } else if (node->isOfType(SoVRMLPixelTexture::getClassTypeId())) {
      const auto image = grey_of(static_cast<const SoVRMLPixelTexture*>(node)->image);
      if (image.pixels.empty()) return;
      world_.textures.push_back(texture_of(image));
      texture_ = static_cast<std::int32_t>(world_.textures.size() - 1);
    } else {
      problem_ = "a texture that is neither ImageTexture nor PixelTexture";
    }
  }

  std::int32_t image_texture(const std::string& url) {
    if (const auto known = by_url_.find(url); known != by_url_.end()) return known->second;
    try {
      world_.textures.push_back(texture_of(drivers::load_gray8(file_.parent_path() / url)));
    } catch (const std::exception& e) {
      problem_ = "texture \"" + url + "\": " + e.what();
      return 0;
    }
    return by_url_[url] = static_cast<std::int32_t>(world_.textures.size() - 1);
  }

  void triangle(SoCallbackAction& action, const std::array<const SoPrimitiveVertex*, 3>& corners) {
    if (!problem_.empty()) return;
    std::array<Corner, 3> t;
    for (std::size_t i = 0; i < 3; ++i) {
      SbVec3f place;
      action.getModelMatrix().multVecMatrix(corners[i]->getPoint(), place);
      SbVec4f at;
      action.getTextureMatrix().multVecMatrix(corners[i]->getTextureCoords(), at);
      t[i] = {moving_ ? Vec3(ned_of(place) - parts_.back().origin) : ned_of(place), at[0], 1.f - at[1]};
      if (!near_enough(t[i].p) || !std::isfinite(t[i].u + t[i].v)) {
        problem_ = "a coordinate is not finite or beyond 1e5 m";
        return;
      }
    }
    Surface surface;
    if (!map_onto(t, surface)) return;
    set_light(action, corners[0]->getMaterialIndex(), surface);
    if (!joins_last(t, surface)) append(t, surface);
  }

  /// Solves for the axes in the triangle's plane that give each corner its texture coordinates.
  bool map_onto(const std::array<Corner, 3>& t, Surface& s) const {
    const Vec3 e1 = t[1].p - t[0].p, e2 = t[2].p - t[0].p, normal = e1.cross(e2);
    Eigen::Matrix2f gram;
    gram << e1.dot(e1), e1.dot(e2), e1.dot(e2), e2.dot(e2);
    if (!(normal.norm() > 1e-9f) || !(gram.determinant() > 0.f)) return false;
    const Eigen::Matrix2f inverse = gram.inverse();
    const auto axis = [&](float d1, float d2) {
      const Eigen::Vector2f k = inverse * Eigen::Vector2f(d1, d2);
      return Vec3(k[0] * e1 + k[1] * e2);
    };
    s.u_axis = axis(t[1].u - t[0].u, t[2].u - t[0].u), s.v_axis = axis(t[1].v - t[0].v, t[2].v - t[0].v);
    s.u0 = t[0].u - s.u_axis.dot(t[0].p), s.v0 = t[0].v - s.v_axis.dot(t[0].p);
    s.normal = normal.normalized();
    s.texture = texture_;
    const Texture& texture = world_.textures[static_cast<std::size_t>(texture_)];
    s.texels_per_m =
        std::fmax(static_cast<float>(texture.size_px()) * std::fmax(s.u_axis.norm(), s.v_axis.norm()), 1e-3f);
    return true;
  }

  void set_light(SoCallbackAction& action, int index, Surface& s) const {
    SbColor ambient, diffuse, specular, emission;
    float shininess = 0, transparency = 0;
    action.getMaterial(ambient, diffuse, specular, emission, shininess, transparency, index);
    const auto grey = [](const SbColor& c) { return 0.299f * c[0] + 0.587f * c[1] + 0.114f * c[2]; };
    s.brightness = grey(diffuse) * (baked_ ? kVrmlExposure : World::lit(s.normal));
    s.glow = 255.f * grey(emission);
  }

  /// True if the triangle and the one before it are the halves of a planar quad of one surface: 0 1 2 and 0 2 3.
  bool joins_last(const std::array<Corner, 3>& t, const Surface& s) {
    World& world = faces();
    if (world.quads.empty()) return false;
    auto& quad = world.quads.back();
    const Surface& last = world.surfaces.back();
    const auto same = [](const Vec3& a, const Vec3& b) { return (a - b).norm() < 1e-5f * (1.f + a.norm()); };
    const auto& v = world.vertices_ned_m;
    if (quad[2] != quad[3] || !same(v[quad[0]], t[0].p) || !same(v[quad[2]], t[1].p)) return false;
    for (const Corner& c : t)
      if (std::abs(last.u_axis.dot(c.p) + last.u0 - c.u) > 2e-3f ||
          std::abs(last.v_axis.dot(c.p) + last.v0 - c.v) > 2e-3f)
        return false;
    if (last.texture != s.texture || std::abs(last.brightness - s.brightness) > 1e-5f || last.glow != s.glow ||
        !(last.normal.dot(s.normal) > 0.99999f))
      return false;
    world.vertices_ned_m.push_back(t[2].p);
    quad[3] = static_cast<std::uint32_t>(world.vertices_ned_m.size() - 1);
    return true;
  }

  void append(const std::array<Corner, 3>& t, const Surface& s) {
    World& world = faces();
    const auto first = static_cast<std::uint32_t>(world.vertices_ned_m.size());
    for (const Corner& corner : t) world.vertices_ned_m.push_back(corner.p);
    world.quads.push_back({first, first + 1, first + 2, first + 2});
    world.surfaces.push_back(s);
  }

  fs::path file_;
  bool baked_;
  const VrmlMotions& motions_;
  World world_;
  std::vector<Part> parts_;
  bool moving_ = false;  ///< inside the last of parts_
  std::string problem_;
  std::map<std::string, std::int32_t> by_url_;
  std::int32_t texture_ = 0;
};

void note_error(const SoError* error, void*) {
  if (read_errors.empty()) read_errors = error->getDebugString().getString();
  for (char& c : read_errors)
    if (c == '\n' || c == '\t') c = ' ';
}

/// Coin's root of the file, referenced; the caller unrefs.
SoVRMLGroup* parse(const fs::path& file) {
  read_errors.clear();
  const std::string text = read_vrml_text(file);
  SoInput in;
  in.setBuffer(text.data(), text.size());
  if (!in.isFileVRML2()) throw std::runtime_error(file.string() + ":1: not VRML97 (\"#VRML V2.0 utf8\")");
  SoInput::addDirectoryFirst(file.parent_path().c_str());  // where the pictures are, which Coin looks for
  SoVRMLGroup* root = SoDB::readAllVRML(&in);
  SoInput::removeDirectory(file.parent_path().c_str());
  if (root == nullptr || !read_errors.empty())
    throw std::runtime_error(file.string() + ": " + (read_errors.empty() ? "not valid VRML97" : read_errors));
  root->ref();
  return root;
}

template <class Node>
const Node* first_of(SoVRMLGroup& root) {
  SoSearchAction search;
  search.setType(Node::getClassTypeId());
  search.setInterest(SoSearchAction::FIRST);
  search.apply(&root);
  return tail_of<Node>(search.getPath());
}

void read_head(SoVRMLGroup& root, Scene& scene, bool& baked) {
  if (const auto* info = first_of<SoVRMLWorldInfo>(root)) {
    scene.title = info->title.getValue().getString();
    baked = info->info.getNum() > 0 && info->info[0] == kVrmlBakedLight;
    scene.world.smooth = baked && info->info.getNum() > 1 && info->info[1] == kVrmlSmooth;
  }
  if (const auto* background = first_of<SoVRMLBackground>(root); background && background->skyColor.getNum() > 0) {
    const SbColor& sky = background->skyColor[0];
    scene.world.sky = 255.f * (0.299f * sky[0] + 0.587f * sky[1] + 0.114f * sky[2]);
  }
  if (const auto* view = first_of<SoVRMLViewpoint>(root)) {
    scene.start_ned_m = ned_of(view->position.getValue());
    SbVec3f ahead;
    view->orientation.getValue().multVec(SbVec3f(0, 0, -1), ahead);
    const Vec3 heading = ned_of(ahead);
    scene.start_yaw_rad = std::atan2(heading.y(), heading.x());
  }
}

/// Of a graph that is safe to walk; else it is let go.
VrmlMotions motions_of(SoVRMLGroup& root, const fs::path& file) {
  try {
    check_shapes(root);
    return take_motions(root);
  } catch (const std::exception& e) {
    root.unref();
    throw std::runtime_error(file.string() + ": " + e.what());
  }
}

}  // namespace

Scene read_vrml_with_coin(const fs::path& file) {
  SoDB::init();
  SoReadError::setHandlerCallback(note_error, nullptr);
  SoDebugError::setHandlerCallback([](const SoError*, void*) {}, nullptr);
  SoVRMLImageTexture::setDelayFetchURL(TRUE);  // pictures are read here, not by Coin
  SoVRMLGroup* root = parse(file);
  const VrmlMotions motions = motions_of(*root, file);
  Scene scene;
  bool baked = false;
  read_head(*root, scene, baked);
  Builder builder(file, baked, motions);
  SoCallbackAction action;
  action.addPreCallback(SoVRMLAppearance::getClassTypeId(), &Builder::on_appearance, &builder);
  action.addPostCallback(SoVRMLShape::getClassTypeId(), &Builder::after_shape, &builder);
  action.addPreCallback(SoVRMLTransform::getClassTypeId(), &Builder::before_transform, &builder);
  action.addPostCallback(SoVRMLTransform::getClassTypeId(), &Builder::after_transform, &builder);
  action.addTriangleCallback(SoShape::getClassTypeId(), &Builder::on_triangle, &builder);
  action.apply(root);
  root->unref();
  const float sky = scene.world.sky;
  const bool smooth = scene.world.smooth;
  scene.world = builder.take();
  scene.world.sky = sky;
  if (smooth) scene.world.make_smooth();
  return scene;
}

}  // namespace wasp::sim
