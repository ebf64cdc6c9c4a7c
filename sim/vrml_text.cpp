#include "sim/vrml_text.h"

#include <algorithm>
#include <charconv>
#include <fstream>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <vector>

namespace wasp::sim {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kHead = "#VRML V2.0 utf8";

/// Nodes of the standard but Inline and Script.
const std::set<std::string, std::less<>> kNodes = {"Anchor",
                                                   "Appearance",
                                                   "AudioClip",
                                                   "Background",
                                                   "Billboard",
                                                   "Box",
                                                   "Collision",
                                                   "Color",
                                                   "ColorInterpolator",
                                                   "Cone",
                                                   "Coordinate",
                                                   "CoordinateInterpolator",
                                                   "Cylinder",
                                                   "CylinderSensor",
                                                   "DirectionalLight",
                                                   "ElevationGrid",
                                                   "Extrusion",
                                                   "Fog",
                                                   "FontStyle",
                                                   "Group",
                                                   "ImageTexture",
                                                   "IndexedFaceSet",
                                                   "IndexedLineSet",
                                                   "LOD",
                                                   "Material",
                                                   "MovieTexture",
                                                   "NavigationInfo",
                                                   "Normal",
                                                   "NormalInterpolator",
                                                   "OrientationInterpolator",
                                                   "PixelTexture",
                                                   "PlaneSensor",
                                                   "PointLight",
                                                   "PointSet",
                                                   "PositionInterpolator",
                                                   "ProximitySensor",
                                                   "ScalarInterpolator",
                                                   "Shape",
                                                   "Sound",
                                                   "Sphere",
                                                   "SphereSensor",
                                                   "SpotLight",
                                                   "Switch",
                                                   "Text",
                                                   "TextureCoordinate",
                                                   "TextureTransform",
                                                   "TimeSensor",
                                                   "TouchSensor",
                                                   "Transform",
                                                   "Viewpoint",
                                                   "VisibilitySensor",
                                                   "WorldInfo"};

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == ','; }
bool ends_word(char c) { return is_space(c) || std::string_view("{}[]\"#").find(c) != std::string_view::npos; }

/// Goes through the tokens once; `line` is where it stands.
class Reader {
 public:
  Reader(std::string_view text, fs::path folder) : text_(text), folder_(std::move(folder)) {}

  void check() {
    for (std::string_view token = next(); !token.empty(); token = next()) {
      if (token == "{")
        enter_braces();
      else if (token == "[")
        enter();
      else if (token == "}" || token == "]")
        leave(token);
      else if (token == "PROTO")
        protos_under_way_.push_back({std::string(next()), depth_});
      else if (token == "EXTERNPROTO")
        refuse("EXTERNPROTO, which would read another file");
      else if (token == "image")
        check_picture();
      else if (token.starts_with('"') && is_url_)
        check_url(token);
      if (!token.starts_with('"') && token != "[") is_url_ = token == "url";
      before_ = token;
    }
  }
  [[nodiscard]] int line() const { return line_; }

 private:
  /// A PROTO whose body has not ended; it cannot be used in itself.
  struct Proto {
    std::string name;
    int depth;
  };

  [[noreturn]] static void refuse(const std::string& why) { throw std::runtime_error(why); }

  void skip_to_token() {
    for (; at_ < text_.size(); ++at_) {
      if (text_[at_] == '#') at_ = std::min(text_.find('\n', at_), text_.size() - 1);
      if (text_[at_] == '\n') ++line_;
      if (!is_space(text_[at_]) && text_[at_] != '#') return;
    }
  }
  std::string_view string_token() {
    const std::size_t first = at_++;
    for (; at_ < text_.size() && text_[at_] != '"'; ++at_) {
      if (text_[at_] == '\\') ++at_;
      if (at_ < text_.size() && text_[at_] == '\n') ++line_;
    }
    at_ = std::min(at_ + 1, text_.size());
    return text_.substr(first, at_ - first);
  }
  /// A bracket, a whole string, or a word; empty at the end.
  std::string_view next() {
    skip_to_token();
    if (at_ >= text_.size()) return {};
    if (text_[at_] == '"') return string_token();
    const std::size_t first = at_++;
    if (!ends_word(text_[first]))
      while (at_ < text_.size() && !ends_word(text_[at_])) ++at_;
    return text_.substr(first, at_ - first);
  }

  void enter() {
    if (++depth_ > kDeepestVrml) refuse("nested too deep");
  }
  /// Behind a word it is a node; behind the interface of a PROTO, its body.
  void enter_braces() {
    const bool is_body = before_ == "]" && !protos_under_way_.empty() && protos_under_way_.back().depth == depth_;
    if (before_ == "Inline" || before_ == "Script")
      refuse("node " + std::string(before_) + ", which would read another file or run a program");
    if (!is_body && !kNodes.contains(before_) && !protos_.contains(before_))
      refuse("'" + std::string(before_.substr(0, 40)) + "' is not a node of VRML97");
    enter();
  }
  void leave(std::string_view token) {
    if (--depth_ < 0) refuse("a bracket that was never opened");
    if (token != "}" || protos_under_way_.empty() || protos_under_way_.back().depth != depth_) return;
    protos_.insert(protos_under_way_.back().name);
    protos_under_way_.pop_back();
  }
  /// Coin opens what a url names to see whether it is there; a pipe or a device would keep it waiting.
  void check_url(std::string_view quoted) const {
    if (quoted.find('\\') != std::string_view::npos) refuse("a url with a backslash");
    const fs::path named(quoted.substr(1, quoted.size() < 2 ? 0 : quoted.size() - 2));
    for (const fs::path& place : {named, folder_ / named}) {
      std::error_code error;
      const auto status = fs::status(place, error);
      if (fs::exists(status) && !fs::is_regular_file(status))
        refuse("url \"" + named.string() + "\" is not a regular file");
    }
  }
  /// PixelTexture: width, height, components, pixels. Coin reserves before it reads.
  void check_picture() {
    const std::size_t place = at_;
    const int line = line_;
    double bytes = 1;
    for (int i = 0; i < 3; ++i) {
      const std::string_view word = next();
      long number = 0;
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
      if (error != std::errc{} || end != word.data() + word.size() || number < 0 || number > 16384)
        number = i == 0 && (word == "IS" || word == "[") ? 0 : -1;  // an interface's name, or one given by it
      if (number < 0) refuse("a picture whose head is not three whole numbers within 0 ... 16384");
      bytes *= static_cast<double>(number);
      if (number == 0) break;
    }
    if (bytes > 4. * static_cast<double>(text_.size())) refuse("a picture without its pixels");
    at_ = place, line_ = line;
  }

  std::string_view text_, before_;
  fs::path folder_;
  bool is_url_ = false;  ///< the strings that come now are urls
  std::size_t at_ = 0;
  int line_ = 1, depth_ = 0;
  std::vector<Proto> protos_under_way_;
  std::set<std::string, std::less<>> protos_;
};

}  // namespace

std::string read_vrml_text(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!std::filesystem::is_regular_file(file) || !in) throw std::runtime_error(file.string() + ": cannot be read");
  if (std::filesystem::file_size(file) > kLongestVrml)
    throw std::runtime_error(file.string() + ": longer than 256 MiB");
  std::ostringstream content;
  content << in.rdbuf();
  std::string text = std::move(content).str();
  if (!text.starts_with(kHead)) throw std::runtime_error(file.string() + ":1: not VRML97 (\"#VRML V2.0 utf8\")");
  if (text.find('\0') != std::string::npos) throw std::runtime_error(file.string() + ": not text");
  Reader reader(text, file.parent_path());
  try {
    reader.check();
  } catch (const std::exception& error) {
    throw std::runtime_error(file.string() + ":" + std::to_string(reader.line()) + ": " + error.what());
  }
  return text;
}

}  // namespace wasp::sim
