#include "drivers/sensor_yaml.h"

#include <Eigen/LU>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "drivers/text_rows.h"

namespace wasp::drivers {
namespace {

struct Value {
  std::string text;
  int line = 0;
};

[[noreturn]] void refuse(const std::filesystem::path& file, int line, const std::string& what) {
  throw std::runtime_error(file.string() + ":" + std::to_string(line) + ": " + what);
}

std::string stripped(std::string text) {
  text = text.substr(0, text.find('#'));
  const auto first = text.find_first_not_of(" \t\r\""), last = text.find_last_not_of(" \t\r\"");
  return first == std::string::npos ? "" : text.substr(first, last - first + 1);
}

/// Every "key: value"; a list may go over several lines. "data" is that of T_BS, the only matrix.
std::map<std::string, Value> values_of(const std::filesystem::path& file) {
  if (!std::filesystem::is_regular_file(file)) throw std::runtime_error(file.string() + ": not a regular file");
  std::ifstream in(file);
  if (!in) throw std::runtime_error(file.string() + ": cannot be read");
  std::map<std::string, Value> values;
  std::string line, key;
  for (int number = 1; std::getline(in, line); ++number) {
    line = stripped(line);
    const auto colon = line.find(':');
    const bool open = !key.empty() && values[key].text.starts_with('[') && !values[key].text.ends_with(']');
    if (open) {
      values[key].text += " " + line;
    } else if (colon != std::string::npos && colon > 0 && !line.starts_with('%')) {
      key = stripped(line.substr(0, colon));
      values[key] = {stripped(line.substr(colon + 1)), number};
    }
  }
  return values;
}

std::vector<double> list_of(const std::filesystem::path& file, const std::string& key, const Value& value) {
  if (!value.text.starts_with('[') || !value.text.ends_with(']'))
    refuse(file, value.line, key + " is no list of numbers");
  std::vector<double> numbers;
  std::string text = value.text.substr(1, value.text.size() - 2), field;
  for (char& c : text)
    if (c == ',') c = ' ';
  for (std::size_t at = text.find_first_not_of(' '); at != std::string::npos; at = text.find_first_not_of(' ', at)) {
    const auto end = text.find(' ', at);
    double number = 0;
    if (!parse_number(std::string_view(text).substr(at, end - at), number))
      refuse(file, value.line, key + " is no list of numbers");
    numbers.push_back(number);
    if (end == std::string::npos) break;
    at = end;
  }
  return numbers;
}

std::vector<double> list_of(const std::filesystem::path& file, const std::map<std::string, Value>& values,
                            const std::string& key, std::size_t least, std::size_t most) {
  const auto found = values.find(key);
  if (found == values.end()) throw std::runtime_error(file.string() + ": no " + key);
  std::vector<double> numbers = list_of(file, key, found->second);
  if (numbers.size() < least || numbers.size() > most)
    refuse(file, found->second.line, key + " has " + std::to_string(numbers.size()) + " numbers");
  return numbers;
}

Eigen::Matrix4d pose_of(const std::filesystem::path& file, const std::map<std::string, Value>& values) {
  const auto numbers = list_of(file, values, "data", 16, 16);
  const Eigen::Matrix4d T = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(numbers.data());
  const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
  if (!((R * R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < 0.01 && R.determinant() > 0))
    refuse(file, values.at("data").line, "T_BS holds no rotation");
  return T;
}

std::string word(const std::map<std::string, Value>& values, const std::string& key) {
  const auto found = values.find(key);
  return found == values.end() ? "" : found->second.text;
}

Lens lens_of(const std::filesystem::path& file, const std::map<std::string, Value>& values) {
  if (word(values, "camera_model") != "pinhole")
    refuse(file, values.at("intrinsics").line, "camera model '" + word(values, "camera_model") + "' is not pinhole");
  const auto size = list_of(file, values, "resolution", 2, 2), f = list_of(file, values, "intrinsics", 4, 4);
  for (const double x : {size[0], size[1], f[0], f[1]})
    if (!(x >= 1 && x <= 16384)) refuse(file, values.at("intrinsics").line, "sizes or focal lengths out of range");
  const auto real = [](double x) { return static_cast<float>(x); };
  Lens lens;
  Intrinsics& k = lens.intrinsics;
  k.width_px = static_cast<int>(size[0]), k.height_px = static_cast<int>(size[1]);
  k.fx_px = real(f[0]), k.fy_px = real(f[1]), k.cx_px = real(f[2]), k.cy_px = real(f[3]);
  const std::string model = word(values, "distortion_model");
  const auto d = list_of(file, values, "distortion_coefficients", 4, 5);
  if (model == "radial-tangential" || model == "radtan" || model == "plumb_bob") {
    k.k1 = real(d[0]), k.k2 = real(d[1]), k.p1 = real(d[2]), k.p2 = real(d[3]);
    k.k3 = d.size() > 4 ? real(d[4]) : 0.f;
  } else if (model == "equidistant") {
    lens.kind = LensKind::kFisheye;
    for (std::size_t i = 0; i < 4; ++i) lens.fisheye_k[i] = real(d[i]);
  } else {
    refuse(file, values.at("distortion_coefficients").line, "distortion model '" + model + "' is not known here");
  }
  return lens;
}

}  // namespace

SensorYaml read_sensor_yaml(const std::filesystem::path& file) {
  const auto values = values_of(file);
  SensorYaml yaml;
  if (values.contains("data")) yaml.T_body_sensor = pose_of(file, values);
  if (values.contains("intrinsics")) yaml.lens = lens_of(file, values);
  if (const auto rate = values.find("rate_hz"); rate != values.end()) {
    double rate_hz = 0;
    if (!parse_number(rate->second.text, rate_hz) || !(rate_hz >= 0.01 && rate_hz <= 10000))
      refuse(file, rate->second.line, "rate_hz is no rate");
    yaml.rate_hz = rate_hz;
  }
  return yaml;
}

}  // namespace wasp::drivers
