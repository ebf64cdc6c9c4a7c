#include "drivers/jpeg_gray.h"

#include <csetjmp>
#include <cstdio>

#include <jpeglib.h>

#include <jerror.h>

#include <array>

namespace wasp::drivers {
namespace {

constexpr int kAnnounceRows = 16;  // from here to the end is less than what a woken reader spins

}  // namespace

struct JpegGray::Decoder {
  jpeg_error_mgr errors{};  // first: libjpeg hands back its address
  jpeg_decompress_struct image{};
  std::jmp_buf on_error;
  bool damaged = false;

  static Decoder& of(j_common_ptr common) { return *reinterpret_cast<Decoder*>(common->err); }

  [[noreturn]] static void fail(j_common_ptr common) { std::longjmp(of(common).on_error, 1); }

  /// Warnings that mean lost picture data; the others (bytes between markers, odd Adobe marks) are harmless.
  static void warn(j_common_ptr common, int level) {
    if (level >= 0) return;  // a trace message
    const int code = common->err->msg_code;
    if (code != JWRN_EXTRANEOUS_DATA && code != JWRN_ADOBE_XFORM) of(common).damaged = true;
  }

  [[nodiscard]] std::string message() {
    std::array<char, JMSG_LENGTH_MAX> text{};
    (*errors.format_message)(reinterpret_cast<j_common_ptr>(&image), text.data());
    return text.data();
  }
};

JpegGray::JpegGray() : decoder_(std::make_unique<Decoder>()) {
  Decoder& d = *decoder_;
  d.image.err = jpeg_std_error(&d.errors);
  d.errors.error_exit = Decoder::fail;
  d.errors.emit_message = Decoder::warn;
  jpeg_create_decompress(&d.image);
}

JpegGray::~JpegGray() { jpeg_destroy_decompress(&decoder_->image); }

bool JpegGray::decode(std::span<const std::uint8_t> jpeg, int width_px, int height_px, std::uint8_t* gray,
                      const std::function<void()>& nearly_done) {
  Decoder& d = *decoder_;
  d.damaged = false;
  if (setjmp(d.on_error) != 0) {  // NOLINT: the way libjpeg reports errors; no object with a destructor is passed over
    why_ = d.message();
    jpeg_abort_decompress(&d.image);
    return false;
  }
  jpeg_mem_src(&d.image, jpeg.data(), jpeg.size());
  jpeg_read_header(&d.image, TRUE);
  const bool fits =
      static_cast<int>(d.image.image_width) == width_px && static_cast<int>(d.image.image_height) == height_px;
  if (!fits) {
    why_ = "a picture of " + std::to_string(d.image.image_width) + " x " + std::to_string(d.image.image_height);
    jpeg_abort_decompress(&d.image);
    return false;
  }
  d.image.out_color_space = JCS_GRAYSCALE;
  d.image.dct_method = JDCT_ISLOW;
  jpeg_start_decompress(&d.image);
  while (static_cast<int>(d.image.output_scanline) < height_px && !d.damaged) {
    if (nearly_done && static_cast<int>(d.image.output_scanline) == height_px - kAnnounceRows) nearly_done();
    JSAMPROW row = gray + static_cast<std::size_t>(d.image.output_scanline) * static_cast<std::size_t>(width_px);
    jpeg_read_scanlines(&d.image, &row, 1);
  }
  if (!d.damaged) jpeg_finish_decompress(&d.image);
  if (d.damaged) {
    why_ = d.message();
    jpeg_abort_decompress(&d.image);
  }
  return !d.damaged;
}

}  // namespace wasp::drivers
