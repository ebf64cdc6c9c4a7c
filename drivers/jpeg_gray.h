// The brightness of a JPEG image, straight into a ring slot. A frame of a Motion-JPEG camera that was cut short or
// damaged on the way is found and refused; libjpeg would fill the rest with grey.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

namespace wasp::drivers {

class JpegGray {
 public:
  JpegGray();
  ~JpegGray();
  JpegGray(const JpegGray&) = delete;
  JpegGray& operator=(const JpegGray&) = delete;

  /// Decodes into `gray`, width_px * height_px bytes, rows close together. False, and what was written is of no use,
  /// for another size, missing or damaged data; `why` says. `nearly_done` is called before the last rows.
  /// Huffman tables may be missing, as they often are in a camera's frames. Realtime-safe: no (libjpeg allocates its
  /// working memory anew for every image, from the prefaulted heap).
  bool decode(std::span<const std::uint8_t> jpeg, int width_px, int height_px, std::uint8_t* gray,
              const std::function<void()>& nearly_done = {});
  [[nodiscard]] const std::string& why() const { return why_; }

 private:
  struct Decoder;
  std::unique_ptr<Decoder> decoder_;
  std::string why_;
};

}  // namespace wasp::drivers
