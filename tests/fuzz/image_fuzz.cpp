// Still images: PNG (chunk checksums made right, or as they are) and PGM. Promises: an image is read whole or refused
// with an error that names the file; what a header asks for is not allocated before the file can hold it.
#include <stdexcept>
#include <vector>

#include "drivers/image_file.h"
#include "tests/fuzz/fuzz_input.h"
#include "tests/fuzz/png_repair.h"
#include "tests/fuzz/scratch_file.h"

namespace {

using namespace wasp;

template <class Load>
void try_load(const std::filesystem::path& file, Load&& load) {
  try {
    const auto image = load(file);
    fuzz::require(
        image.width_px >= 1 && image.height_px >= 1 &&
            image.pixels.size() == static_cast<std::size_t>(image.width_px) * static_cast<std::size_t>(image.height_px),
        "an image has its pixels");
  } catch (const std::runtime_error& error) {
    fuzz::require_clear(error.what(), file.string());
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static fuzz::ScratchFile png(".png"), pgm(".pgm");
  fuzz::FuzzInput in(data, size);
  const auto how = in.take<std::uint8_t>();
  const auto bytes = in.rest();
  std::vector<std::uint8_t> file(bytes.begin(), bytes.end());
  if ((how & 2) != 0) fuzz::repair_png(file);
  fuzz::ScratchFile& scratch = (how & 1) != 0 ? pgm : png;
  scratch.write(file);
  try {
    const drivers::ImageInfo info = drivers::probe_image(scratch.path());
    fuzz::require(info.width_px >= 1 && info.width_px <= drivers::kMaxImageSide, "sizes are within their range");
  } catch (const std::runtime_error& error) {
    fuzz::require_clear(error.what(), scratch.path().string());
  }
  try_load(scratch.path(), drivers::load_gray8);
  try_load(scratch.path(), drivers::load_gray16);
  return 0;
}
