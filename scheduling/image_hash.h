// A 64-bit hash over a thin, even sample of an image: up to 32 rows, eight pieces of 64 bytes in each, columns
// staggered from row to row. Two exposures of a real sensor differ in their noise nearly everywhere, so equal hashes
// mean the same image once more; it says nothing of how much two images differ.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "rt/contract.h"
#include "types/image_view.h"

namespace wasp::scheduling {

/// Both halves of a product: every bit of one factor reaches every bit of the result.
inline std::uint64_t fold_product(std::uint64_t a, std::uint64_t b) WASP_REALTIME {
  __extension__ using Product = unsigned __int128;
  const Product product = static_cast<Product>(a) * b;
  return static_cast<std::uint64_t>(product) ^ static_cast<std::uint64_t>(product >> 64);
}

/// 0 for no image. Realtime-safe: yes; at most 256 pieces, however large the image (`wasp bench micro`, image_hash).
template <class T>
std::uint64_t image_hash(const ImageView<T>& image) WASP_REALTIME {
  constexpr std::size_t kRows = 32, kPiecesInRow = 8, kPiece = 64;
  constexpr std::uint64_t kSalt[] = {0x9e3779b97f4a7c15, 0xe7037ed1a0b428db, 0x8ebc6af09c88c6e3, 0x589965cc75374cc3};
  if (!image.valid()) return 0;
  const std::size_t row_bytes = static_cast<std::size_t>(image.width_px) * sizeof(T);
  const auto rows = static_cast<std::size_t>(image.height_px);
  const std::size_t pieces = (row_bytes + kPiece - 1) / kPiece;
  const std::size_t row_step = (rows + kRows - 1) / kRows, column_step = (pieces + kPiecesInRow - 1) / kPiecesInRow;
  std::uint64_t hash = fold_product(row_bytes ^ kSalt[0], rows ^ kSalt[1]);
  for (std::size_t row = 0; row < rows; row += row_step) {
    const auto* const begin = reinterpret_cast<const std::byte*>(image.row(static_cast<int>(row)));
    const std::size_t next = (row / row_step + 1) % column_step;  // the next row's pieces are on their way meanwhile
    for (std::size_t piece = next; row + row_step < rows && piece < pieces; piece += column_step)
      __builtin_prefetch(begin + row_step * static_cast<std::size_t>(image.stride_px) * sizeof(T) + piece * kPiece);
    for (std::size_t piece = row / row_step % column_step; piece < pieces; piece += column_step) {
      const std::size_t at = piece * kPiece, left = row_bytes - at;
      std::uint64_t w[8] = {};
      std::memcpy(w, begin + at, left < kPiece ? left : kPiece);
      std::uint64_t mixed = 0;
      for (std::size_t k = 0; k < 4; ++k) mixed += fold_product(w[2 * k] ^ kSalt[k], w[2 * k + 1] ^ kSalt[(k + 1) % 4]);
      hash = fold_product(hash ^ mixed, kSalt[2]);
    }
  }
  return hash == 0 ? 1 : hash;
}

}  // namespace wasp::scheduling
