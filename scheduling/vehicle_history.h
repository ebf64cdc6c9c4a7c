// What the vehicle did around an exposure, from the link's rings: its attitude at that instant, and the mean specific
// force since the exposure before.
#pragma once

#include "shm/broadcast_ring.h"
#include "shm/topics.h"
#include "types/attitude_at.h"

namespace wasp::scheduling {

class VehicleHistory {
 public:
  explicit VehicleHistory(const shm::Region& flight)
      : attitude_(flight, shm::kAttitude, "Attitude"), imu_(flight, shm::kImu, "Imu"), used_(imu_.newest()) {}

  /// Attitude at `at_ns` (types/attitude_at.h); false if the ring holds no sample that is not after it. Bounded by the
  /// ring's length. Realtime-safe: yes.
  bool attitude(TimeNs at_ns, AttitudeSample& out) const WASP_REALTIME {
    AttitudeSample sample, after;
    bool has_after = false;
    const std::uint64_t newest = attitude_.newest();
    for (std::uint64_t n = newest; n > 0 && newest - n < attitude_.slots() - 1u; --n) {
      if (!attitude_.copy(n, sample)) continue;
      if (sample.exposed_at_ns <= at_ns) {
        out = attitude_at(sample, has_after ? &after : nullptr, at_ns);
        return true;
      }
      after = sample;
      has_after = true;
    }
    return false;
  }

  /// Mean of the samples that are not after `at_ns` and were in no mean before: successive exposures leave no gap.
  /// False if there is none, and at the first call, which only sets the beginning. Bounded by the ring's length.
  /// Realtime-safe: yes.
  bool mean_specific_force(TimeNs at_ns, std::array<float, 3>& out_mps2) WASP_REALTIME {
    const std::uint64_t newest = imu_.newest(), kept = imu_.slots() - 1u;
    std::array<float, 3> sum{};
    int count = 0;
    for (std::uint64_t n = std::max(used_, newest > kept ? newest - kept : 0) + 1; n <= newest; ++n) {
      ImuSample sample;
      if (!imu_.copy(n, sample)) continue;
      if (sample.exposed_at_ns > at_ns) break;
      for (std::size_t k = 0; k < 3; ++k) sum[k] += sample.accel_body_mps2[k];
      ++count;
      used_ = n;
    }
    const bool valid = begun_ && count > 0;
    begun_ = true;
    for (std::size_t k = 0; valid && k < 3; ++k) out_mps2[k] = sum[k] / static_cast<float>(count);
    return valid;
  }

 private:
  shm::RingReader attitude_, imu_;
  std::uint64_t used_;  ///< number of the newest inertial sample in a mean
  bool begun_ = false;
};

}  // namespace wasp::scheduling
