// Import: frames of iceoryx services into a camera region that a flight uses as its camera. Each message is checked
// before a byte of it is believed, then copied once, straight into the loaned ring slot.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "shm/broadcast_ring.h"
#include "tools/iceoryx_frame.h"
#include "tools/iceoryx_supervisor.h"

namespace wasp::iceoryx {

struct ImportOptions {
  std::string instance;
  std::string service, gray, depth;  ///< services "S/I/E"; `service`: the frames say themselves which stream they are
  std::uint32_t width_px = 0, height_px = 0;  ///< 0: as the first frame says
  bool raw = false;                           ///< messages are bare pixels, rows packed; needs the size
  double wait_s = 5;                          ///< for the daemon at the start
  bool json = false;
};

/// Account of one service.
struct ImportCount {
  std::uint64_t taken = 0;     ///< frames given to the flight
  std::uint64_t rejected = 0;  ///< messages that are no frame of this camera
  std::uint64_t missed = 0;    ///< gaps in the senders' numbering
};

/// The region, made when the size is known, and its two rings. Both exist always: a behaviour may wait on either.
class CameraRegion {
 public:
  /// Throws std::runtime_error, for instance if another camera writes the region.
  CameraRegion(const std::string& instance, std::uint32_t width_px, std::uint32_t height_px);
  /// Publishes a frame, its rows packed; false if it does not fit. The readers are woken before the copy.
  bool publish(const FrameView& frame);

 private:
  shm::Region region_;
  shm::RingWriter gray_, depth_;
};

/// Checks the options; throws std::runtime_error naming the one that cannot be.
void check_request(const ImportOptions& options);

/// The whole of `wasp iceoryx import`; exit code of the program. Takes the region away when it ends.
int run_import(const ImportOptions& options);

}  // namespace wasp::iceoryx
