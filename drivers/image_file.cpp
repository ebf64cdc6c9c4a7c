// PNG through libpng, PGM by hand (twenty lines; no Debian library reads 16-bit PGM without the weight of OpenCV).
// libpng reports errors by longjmp: each call into it sits in one function without C++ objects to unwind, which
// returns false; the caller then throws.
#include "drivers/image_file.h"

#include <png.h>

#include <algorithm>
#include <array>
#include <bit>
#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>

namespace wasp::drivers {
namespace {

[[noreturn]] void fail(const std::filesystem::path& file, const std::string& what) {
  throw std::runtime_error(file.string() + ": " + what);
}

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

/// A pipe or a terminal would keep whoever reads it waiting.
void check_regular(const std::filesystem::path& file) {
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) fail(file, "not a regular file");
}

File open_file(const std::filesystem::path& file, const char* mode) {
  check_regular(file);
  File handle(std::fopen(file.c_str(), mode), &std::fclose);
  if (handle == nullptr) fail(file, std::string("cannot open: ") + std::strerror(errno));
  return handle;
}

struct PngMessage {
  char text[128] = "damaged PNG";
};

[[noreturn]] void on_png_error(png_structp png, png_const_charp message) {
  auto* out = static_cast<PngMessage*>(png_get_error_ptr(png));
  std::snprintf(out->text, sizeof out->text, "%s", message);
  png_longjmp(png, 1);
}
void on_png_warning(png_structp, png_const_charp) {}

struct PngReader {
  PngMessage message;
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &message, on_png_error, on_png_warning);
  png_infop info = png != nullptr ? png_create_info_struct(png) : nullptr;
  PngReader() = default;
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;
  ~PngReader() { png_destroy_read_struct(&png, &info, nullptr); }
};

struct PngWriter {
  PngMessage message;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &message, on_png_error, on_png_warning);
  png_infop info = png != nullptr ? png_create_info_struct(png) : nullptr;
  PngWriter() = default;
  PngWriter(const PngWriter&) = delete;
  PngWriter& operator=(const PngWriter&) = delete;
  ~PngWriter() { png_destroy_write_struct(&png, &info); }
};

bool read_header(PngReader& reader, std::FILE* file) {
  if (setjmp(png_jmpbuf(reader.png)) != 0) return false;
  png_init_io(reader.png, file);
  png_read_info(reader.png, reader.info);
  return true;
}

/// Asks libpng for grey samples of 8 (or, for a 16-bit file and `want16`, 16) bits in native byte order.
bool set_conversions(PngReader& reader, bool want16) {
  if (setjmp(png_jmpbuf(reader.png)) != 0) return false;
  const png_byte type = png_get_color_type(reader.png, reader.info);
  png_set_expand(reader.png);
  png_set_strip_alpha(reader.png);
  if (want16) {
    if constexpr (std::endian::native == std::endian::little) png_set_swap(reader.png);
  } else {
    png_set_scale_16(reader.png);
  }
  if ((type & PNG_COLOR_MASK_COLOR) != 0) png_set_rgb_to_gray(reader.png, PNG_ERROR_ACTION_NONE, -1.0, -1.0);
  png_set_interlace_handling(reader.png);
  png_read_update_info(reader.png, reader.info);
  return true;
}

bool read_rows(PngReader& reader, png_bytepp rows) {
  if (setjmp(png_jmpbuf(reader.png)) != 0) return false;
  png_read_image(reader.png, rows);
  png_read_end(reader.png, nullptr);
  return true;
}

ImageInfo png_info(const PngReader& reader, const std::filesystem::path& file) {
  const png_uint_32 width = png_get_image_width(reader.png, reader.info);
  const png_uint_32 height = png_get_image_height(reader.png, reader.info);
  if (width < 1 || height < 1 || width > kMaxImageSide || height > kMaxImageSide)
    fail(file, "image of " + std::to_string(width) + "x" + std::to_string(height) + " pixels is out of range");
  return {static_cast<int>(width), static_cast<int>(height), png_get_bit_depth(reader.png, reader.info) == 16 ? 16 : 8,
          (png_get_color_type(reader.png, reader.info) & PNG_COLOR_MASK_COLOR) != 0};
}

constexpr std::size_t kMostDeflated = 1032;  ///< deflate makes at most this many bytes of one

/// Before memory is asked for: refuses a file too small for the pixels its header claims.
void check_room(const std::filesystem::path& file, std::size_t pixel_bytes, std::size_t most_of_one_byte) {
  if (std::filesystem::file_size(file) < pixel_bytes / most_of_one_byte)
    fail(file, "truncated: smaller than its image");
}

/// Bits of one pixel in the file; asked before the conversions.
std::size_t bits_stored(const PngReader& reader) {
  return std::size_t{png_get_bit_depth(reader.png, reader.info)} * png_get_channels(reader.png, reader.info);
}

template <class T>
Image<T> load_png(const std::filesystem::path& file) {
  const File handle = open_file(file, "rb");
  PngReader reader;
  if (reader.info == nullptr) fail(file, "libpng could not start");
  if (!read_header(reader, handle.get())) fail(file, reader.message.text);
  const ImageInfo info = png_info(reader, file);
  const auto width = static_cast<std::size_t>(info.width_px), height = static_cast<std::size_t>(info.height_px);
  check_room(file, width * height * bits_stored(reader) / 8, kMostDeflated);
  constexpr bool kWant16 = sizeof(T) == 2;
  if (kWant16 && (info.bits != 16 || info.colour)) fail(file, "expected a 16-bit grey PNG (depth)");
  if (!set_conversions(reader, kWant16)) fail(file, reader.message.text);
  if (png_get_rowbytes(reader.png, reader.info) != width * sizeof(T)) fail(file, "unsupported PNG pixel format");
  Image<T> image{info.width_px, info.height_px, std::vector<T>(width * height)};
  std::vector<png_bytep> rows(height);
  for (std::size_t v = 0; v < height; ++v) rows[v] = reinterpret_cast<png_bytep>(image.pixels.data() + v * width);
  if (!read_rows(reader, rows.data())) fail(file, reader.message.text);
  return image;
}

/// The last chunk of a whole PNG is always these twelve bytes.
void check_png_end(const std::filesystem::path& file) {
  constexpr std::array<unsigned char, 12> kEnd = {0, 0, 0, 0, 'I', 'E', 'N', 'D', 0xAE, 0x42, 0x60, 0x82};
  std::array<unsigned char, 12> tail{};
  const File handle = open_file(file, "rb");
  if (std::fseek(handle.get(), -12, SEEK_END) != 0 || std::fread(tail.data(), 1, 12, handle.get()) != 12 ||
      tail != kEnd)
    fail(file, "truncated PNG (no end chunk)");
}

struct PgmHeader {
  int width_px = 0, height_px = 0, maxval = 0;
  std::size_t payload_at = 0;
};

/// One decimal number of a PGM header; skips white space and '#' comments. -1 when there is none below 65536.
int pgm_number(std::istream& in) {
  int c = in.get();
  while (c == '#' || c == ' ' || c == '\t' || c == '\n' || c == '\r') {
    if (c == '#')
      while (c != '\n' && c != EOF) c = in.get();
    c = in.get();
  }
  if (c < '0' || c > '9') return -1;
  int value = 0;
  for (; c >= '0' && c <= '9' && value < 65536; c = in.get()) value = value * 10 + (c - '0');
  return value < 65536 ? value : -1;  // the single white space after the number is consumed, as the format wants
}

PgmHeader pgm_header(std::istream& in, const std::filesystem::path& file) {
  char magic[2] = {};
  in.read(magic, 2);
  if (magic[0] != 'P' || magic[1] != '5') fail(file, "not a binary PGM (P5)");
  PgmHeader header{pgm_number(in), pgm_number(in), pgm_number(in), 0};
  if (header.width_px < 1 || header.height_px < 1 || header.width_px > kMaxImageSide ||
      header.height_px > kMaxImageSide || header.maxval < 1)
    fail(file, "damaged PGM header");
  header.payload_at = static_cast<std::size_t>(in.tellg());
  return header;
}

std::size_t pgm_sample_bytes(const PgmHeader& header) { return header.maxval > 255 ? 2 : 1; }

std::size_t pgm_bytes(const PgmHeader& header) {
  return static_cast<std::size_t>(header.width_px) * static_cast<std::size_t>(header.height_px) *
         pgm_sample_bytes(header);
}

std::vector<unsigned char> pgm_payload(std::istream& in, const PgmHeader& header, const std::filesystem::path& file) {
  std::vector<unsigned char> bytes(pgm_bytes(header));
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (in.gcount() != static_cast<std::streamsize>(bytes.size())) fail(file, "truncated PGM");
  return bytes;
}

bool is_pgm(const std::filesystem::path& file) { return file.extension() == ".pgm"; }

std::ifstream open_pgm(const std::filesystem::path& file) {
  check_regular(file);
  std::ifstream in(file, std::ios::binary);
  if (!in) fail(file, "cannot open");
  return in;
}

template <class T>
Image<T> load_pgm(const std::filesystem::path& file) {
  std::ifstream in = open_pgm(file);
  const PgmHeader header = pgm_header(in, file);
  if (pgm_sample_bytes(header) != sizeof(T))
    fail(file, sizeof(T) == 2 ? "expected a 16-bit PGM (maxval > 255)" : "expected an 8-bit PGM (maxval <= 255)");
  check_room(file, pgm_bytes(header), 1);
  const std::vector<unsigned char> bytes = pgm_payload(in, header, file);
  Image<T> image{header.width_px, header.height_px, std::vector<T>(bytes.size() / sizeof(T))};
  for (std::size_t i = 0; i < image.pixels.size(); ++i)
    if constexpr (sizeof(T) == 2)
      image.pixels[i] = static_cast<T>((bytes[2 * i] << 8) | bytes[2 * i + 1]);
    else
      image.pixels[i] = bytes[i];
  return image;
}

bool write_rows(PngWriter& writer, std::FILE* file, int width_px, int height_px, int bits, int level, png_bytepp rows) {
  if (setjmp(png_jmpbuf(writer.png)) != 0) return false;
  png_init_io(writer.png, file);
  png_set_compression_level(writer.png, level);
  if (level <= 1) png_set_filter(writer.png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);  // the cheapest that still helps
  png_set_IHDR(writer.png, writer.info, static_cast<png_uint_32>(width_px), static_cast<png_uint_32>(height_px), bits,
               PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(writer.png, writer.info);
  if (bits == 16 && std::endian::native == std::endian::little) png_set_swap(writer.png);
  png_write_image(writer.png, rows);
  png_write_end(writer.png, nullptr);
  return true;
}

template <class T>
void save(const std::filesystem::path& file, const ImageView<T>& image, int level) {
  if (!image.valid() || image.width_px > kMaxImageSide || image.height_px > kMaxImageSide)
    fail(file, "no image to write");
  const File handle = open_file(file, "wb");
  PngWriter writer;
  if (writer.info == nullptr) fail(file, "libpng could not start");
  std::vector<png_bytep> rows(static_cast<std::size_t>(image.height_px));
  for (int v = 0; v < image.height_px; ++v)  // libpng's row type is not const, but writing does not change the rows
    rows[static_cast<std::size_t>(v)] = reinterpret_cast<png_bytep>(const_cast<T*>(image.row(v)));
  if (!write_rows(writer, handle.get(), image.width_px, image.height_px, 8 * static_cast<int>(sizeof(T)),
                  std::clamp(level, 0, 9), rows.data()))
    fail(file, writer.message.text);
  if (std::fflush(handle.get()) != 0) fail(file, std::string("cannot write: ") + std::strerror(errno));
}

}  // namespace

ImageInfo probe_image(const std::filesystem::path& file) {
  if (is_pgm(file)) {
    std::ifstream in = open_pgm(file);
    const PgmHeader header = pgm_header(in, file);
    if (std::filesystem::file_size(file) < header.payload_at + pgm_bytes(header)) fail(file, "truncated PGM");
    return {header.width_px, header.height_px, static_cast<int>(8 * pgm_sample_bytes(header)), false};
  }
  const File handle = open_file(file, "rb");
  PngReader reader;
  if (reader.info == nullptr) fail(file, "libpng could not start");
  if (!read_header(reader, handle.get())) fail(file, reader.message.text);
  const ImageInfo info = png_info(reader, file);
  check_png_end(file);
  return info;
}

Image<std::uint8_t> load_gray8(const std::filesystem::path& file) {
  return is_pgm(file) ? load_pgm<std::uint8_t>(file) : load_png<std::uint8_t>(file);
}

Image<std::uint16_t> load_gray16(const std::filesystem::path& file) {
  return is_pgm(file) ? load_pgm<std::uint16_t>(file) : load_png<std::uint16_t>(file);
}

void save_png(const std::filesystem::path& file, const GrayView& image, int compression_level) {
  save(file, image, compression_level);
}
void save_png(const std::filesystem::path& file, const DepthView& image, int compression_level) {
  save(file, image, compression_level);
}

}  // namespace wasp::drivers
