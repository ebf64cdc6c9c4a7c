#include "messages/frame_signature.h"

#include <nettle/sha2.h>

#include <algorithm>
#include <cerrno>

namespace wasp::mavlink {
std::array<std::uint8_t, 6> signature_of(const SigningKey& key, std::span<const std::uint8_t> covered) WASP_REALTIME {
  sha256_ctx context;
  nettle_sha256_init(&context);
  nettle_sha256_update(&context, key.bytes.size(), key.bytes.data());
  nettle_sha256_update(&context, covered.size(), covered.data());
  std::array<std::uint8_t, 6> six{};
  nettle_sha256_digest(&context, six.size(), six.data());
  return six;
}

std::uint8_t FrameSigner::link_of_this_thread() WASP_REALTIME {
  const int* self = &errno;  // its address is the thread's own
  std::size_t row = 0;
  for (; row + 1 < threads_.size(); ++row) {
    const int* holder = threads_[row].load(std::memory_order_relaxed);
    if (holder == self) break;
    if (holder == nullptr && threads_[row].compare_exchange_strong(holder, self, std::memory_order_relaxed))
      break;
  }
  return static_cast<std::uint8_t>(first_link_ + row);
}

void FrameSigner::append(std::span<std::uint8_t> out, std::size_t n) WASP_REALTIME {
  const std::uint64_t time = clock_.take();
  out[n] = link_of_this_thread();
  for (std::size_t i = 0; i < 6; ++i) out[n + 1 + i] = static_cast<std::uint8_t>(time >> (8 * i));
  const auto six = signature_of(key_, out.first(n + 7));
  std::copy(six.begin(), six.end(), out.begin() + static_cast<std::ptrdiff_t>(n + 7));
}

}  // namespace wasp::mavlink
