#include <algorithm>
#include <cmath>
#include <fstream>
#include <stdexcept>
#include <utility>

#ifdef WASP_HAVE_OPENCV
#include <opencv2/imgcodecs.hpp>
#endif

#include "drivers/flow_file.h"
#include "tools/eval_flow_pairs.h"

namespace wasp::tools {
namespace {

namespace fs = std::filesystem;
using Gray = drivers::Image<std::uint8_t>;

/// Trailing number of a name without its extension, and what stands before it: "frame_0002" -> "frame_", 2.
std::optional<std::pair<std::string, long>> split_number(const std::string& stem) {
  const auto last = stem.find_last_not_of("0123456789");
  const std::string digits = last == std::string::npos ? stem : stem.substr(last + 1);
  if (digits.empty() || digits.size() > 9) return std::nullopt;
  return std::pair{stem.substr(0, stem.size() - digits.size()), std::stol(digits)};
}

bool is_mask(const std::string& prefix) {
  return prefix.starts_with("occluded") || prefix.starts_with("invalid") || prefix.starts_with("not_sky") ||
         prefix.starts_with("flow");
}

DenseFlow read_flo(const fs::path& file) {
  drivers::FlowImage flow = drivers::load_flow(file);
  return {flow.width_px, flow.height_px, std::move(flow.u_px), std::move(flow.v_px), std::move(flow.known)};
}

/// Clears `known` where the mask says so.
void apply_mask(const fs::path& file, bool keep_bright, DenseFlow& truth) {
  const Gray mask = drivers::load_gray8(file);
  if (mask.width_px != truth.width_px || mask.height_px != truth.height_px)
    throw std::runtime_error(file.string() + ": not of the flow's size");
  for (std::size_t i = 0; i < truth.known.size(); ++i)
    if ((mask.pixels[i] > 127) != keep_bright) truth.known[i] = 0;
}

std::vector<fs::path> files_of(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_regular_file()) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

FlowPair read_flo_pair(const fs::path& flo, long number, const std::vector<fs::path>& files) {
  FlowPair pair{flo.stem().string(), {}, {}, read_flo(flo)};
  std::string prefix;
  for (const fs::path& file : files) {
    const auto split = split_number(file.stem().string());
    if (!split || file.extension() != ".png") continue;
    if (split->second == number && !is_mask(split->first))
      pair.first = drivers::load_gray8(file), prefix = split->first;
    if (split->second == number && is_mask(split->first) && !split->first.starts_with("flow"))
      apply_mask(file, split->first.starts_with("not_sky"), pair.truth);
  }
  for (const fs::path& file : files) {
    const auto split = split_number(file.stem().string());
    if (split && file.extension() == ".png" && split->second == number + 1 && split->first == prefix)
      pair.second = drivers::load_gray8(file);
  }
  if (pair.first.pixels.empty() || pair.second.pixels.empty())
    throw std::runtime_error(flo.string() + ": no frames " + std::to_string(number) + " and the next beside it");
  return pair;
}

#ifdef WASP_HAVE_OPENCV
/// KITTI: 16-bit colour, u = (R - 32768) / 64, v = (G - 32768) / 64, known where B > 0; OpenCV delivers BGR.
DenseFlow read_kitti(const fs::path& file) {
  const cv::Mat image = cv::imread(file.string(), cv::IMREAD_UNCHANGED);
  if (image.type() != CV_16UC3) throw std::runtime_error(file.string() + ": not a 16-bit colour PNG");
  const auto count = static_cast<std::size_t>(image.total());
  DenseFlow truth{image.cols, image.rows, std::vector<float>(count), std::vector<float>(count),
                  std::vector<std::uint8_t>(count)};
  for (std::size_t i = 0; i < count; ++i) {
    const auto& bgr = image.at<cv::Vec3w>(static_cast<int>(i) / image.cols, static_cast<int>(i) % image.cols);
    truth.u[i] = static_cast<float>(bgr[2] - 32768) / 64.f;
    truth.v[i] = static_cast<float>(bgr[1] - 32768) / 64.f;
    truth.known[i] = bgr[0] > 0 ? 1 : 0;
  }
  return truth;
}
#endif

}  // namespace

std::vector<FlowPair> read_flow_pairs(const fs::path& folder) {
  std::vector<FlowPair> pairs;
  const auto files = files_of(folder);
  for (const fs::path& file : files) {
    const std::string stem = file.stem().string();
    const auto split = split_number(stem);
    if (file.extension() == ".flo" && split) pairs.push_back(read_flo_pair(file, split->second, files));
#ifdef WASP_HAVE_OPENCV
    if (stem.starts_with("flow_noc_") && stem.ends_with("_10") && file.extension() == ".png") {
      const std::string name = stem.substr(9, stem.size() - 12);
      pairs.push_back({name, drivers::load_gray8(folder / (name + "_10.png")),
                       drivers::load_gray8(folder / (name + "_11.png")), read_kitti(file)});
    }
#endif
  }
  return pairs;
}

std::vector<NamedImage> read_still_images(const fs::path& folder) {
  std::vector<NamedImage> images;
  std::string prefix;
  for (const fs::path& file : files_of(folder)) {
    const std::string stem = file.stem().string();
    const auto split = split_number(stem);
    const bool next_of_sequence = split && !images.empty() && split->first == prefix;
    if (file.extension() != ".png" || next_of_sequence || is_mask(stem) || drivers::probe_image(file).bits != 8)
      continue;
    prefix = split ? split->first : "";
    images.push_back({stem, drivers::load_gray8(file)});
  }
  if (images.empty()) throw std::runtime_error(folder.string() + ": no 8-bit PNG files");
  return images;
}

std::optional<std::size_t> nearest_known(const DenseFlow& flow, double u_px, double v_px) {
  constexpr long kMostPx = 3;
  const long u0 = std::lround(u_px), v0 = std::lround(v_px);
  long least = 2 * kMostPx * kMostPx + 1;
  std::optional<std::size_t> best;
  for (long v = std::max(v0 - kMostPx, 0L); v <= std::min<long>(v0 + kMostPx, flow.height_px - 1); ++v)
    for (long u = std::max(u0 - kMostPx, 0L); u <= std::min<long>(u0 + kMostPx, flow.width_px - 1); ++u) {
      const auto at = static_cast<std::size_t>(v * flow.width_px + u);
      const long far = (u - u0) * (u - u0) + (v - v0) * (v - v0);
      if (flow.known[at] != 0 && far < least) least = far, best = at;
    }
  return best;
}

}  // namespace wasp::tools
