#include "drivers/flow_file.h"

#include <array>
#include <bit>
#include <cmath>
#include <fstream>
#include <stdexcept>

#include "drivers/image_file.h"

namespace wasp::drivers {
namespace {

static_assert(std::endian::native == std::endian::little, "values are read as they lie in the file");
constexpr std::size_t kHeaderBytes = 12;

FlowFileInfo read_header(std::ifstream& in, const std::filesystem::path& file) {
  float tag = 0;
  std::array<std::int32_t, 2> size{};
  in.read(reinterpret_cast<char*>(&tag), sizeof tag);
  in.read(reinterpret_cast<char*>(size.data()), sizeof size);
  const auto side = [](std::int32_t n) { return n > 0 && n <= kMaxImageSide; };
  if (!in || tag != 202021.25f || !side(size[0]) || !side(size[1]))
    throw std::runtime_error(file.string() + ": not a .flo file");
  const std::size_t bytes = kHeaderBytes + 8 * static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]);
  if (std::filesystem::file_size(file) != bytes)
    throw std::runtime_error(file.string() + ": cut short or too long: " +
                             std::to_string(std::filesystem::file_size(file)) + " bytes, its header asks for " +
                             std::to_string(bytes));
  return {size[0], size[1]};
}

std::ifstream open(const std::filesystem::path& file) {
  if (!std::filesystem::is_regular_file(file)) throw std::runtime_error(file.string() + ": not a regular file");
  std::ifstream in(file, std::ios::binary);
  if (!in) throw std::runtime_error(file.string() + ": cannot be read");
  return in;
}

}  // namespace

FlowFileInfo probe_flow(const std::filesystem::path& file) {
  std::ifstream in = open(file);
  return read_header(in, file);
}

FlowImage load_flow(const std::filesystem::path& file) {
  std::ifstream in = open(file);
  const FlowFileInfo info = read_header(in, file);
  const auto count = static_cast<std::size_t>(info.width_px) * static_cast<std::size_t>(info.height_px);
  std::vector<float> uv(2 * count);
  in.read(reinterpret_cast<char*>(uv.data()), static_cast<std::streamsize>(uv.size() * sizeof(float)));
  if (!in) throw std::runtime_error(file.string() + ": cut short");
  FlowImage flow{info.width_px, info.height_px, std::vector<float>(count), std::vector<float>(count),
                 std::vector<std::uint8_t>(count)};
  for (std::size_t i = 0; i < count; ++i) {
    flow.u_px[i] = uv[2 * i];
    flow.v_px[i] = uv[2 * i + 1];
    flow.known[i] = std::abs(flow.u_px[i]) < 1e9f && std::abs(flow.v_px[i]) < 1e9f ? 1 : 0;
  }
  return flow;
}

}  // namespace wasp::drivers
