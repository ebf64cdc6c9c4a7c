// A shared memory region that vanishes with its process.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "shm/region.h"

namespace wasp::sim {

struct OwnedRegion {
  shm::Region region;
  /// Throws std::runtime_error as Region::create does.
  OwnedRegion(const std::string& name, std::span<const shm::TopicSpec> topics, std::string_view note = "simulated")
      : region(shm::Region::create(name, topics, note)) {}
  ~OwnedRegion() { shm::Region::remove(region.name()); }
  OwnedRegion(const OwnedRegion&) = delete;
  OwnedRegion& operator=(const OwnedRegion&) = delete;
};

}  // namespace wasp::sim
