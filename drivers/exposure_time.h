// From a device's time stamp to the middle of the exposure. Pure.
//
// A stamp is taken either when the exposure starts (UVC cameras: V4L2_BUF_FLAG_TSTAMP_SRC_SOE) or when the last byte of
// the frame has arrived (nearly everything else). Of a global shutter the pixels are read out after the exposure, so
//   start of exposure: middle = stamp + exposure / 2
//   end of frame:      middle = stamp - readout - exposure / 2
// With a rolling shutter the middle row's exposure ends half a readout before the last row's: say half the readout.
#pragma once

#include <cstdint>

#include "types/time.h"

namespace wasp::drivers {

enum class StampSource : std::uint8_t { kStartOfExposure, kEndOfFrame };

/// Durations are >= 0; unknown ones 0.
constexpr TimeNs mid_exposure(TimeNs stamp_ns, StampSource source, DurationNs exposure_ns, DurationNs readout_ns) {
  return source == StampSource::kStartOfExposure ? stamp_ns + exposure_ns / 2 : stamp_ns - readout_ns - exposure_ns / 2;
}

/// Not ahead of its arrival and at most a second old: what a working clock of the same kind gives.
constexpr bool believable_stamp(TimeNs stamp_ns, TimeNs arrived_ns) {
  return stamp_ns <= arrived_ns && stamp_ns > arrived_ns - kSecond;
}

}  // namespace wasp::drivers
