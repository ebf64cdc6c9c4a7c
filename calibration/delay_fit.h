// The delay between a camera's stamps and a gyro's, from how both saw the vehicle turn. An image stamped s was exposed
// at s - delay. For every delay the image's rates are regressed on the gyro's mean rates over the same, shifted, frame
// intervals, axis by axis with a free scale and bias; each axis counts by what is left of it, so that an axis the
// camera cannot see (or sees travel in) takes no part. The profile is the log likelihood over "no relation", with the
// number of frames reduced by how much neighbouring residuals agree.
//
// Several recordings of one camera are fitted together: one delay and one scale an axis for all, a bias for each.
//
// The answer is refused where the profile has no clear peak, a second one as good, or one too flat, and where
// recordings do not agree on it.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibration/image_turns.h"
#include "calibration/turn_source.h"

namespace wasp::calibration {

struct DelayParams {
  double search_s = 0.25;        ///< delays from -search_s to search_s
  double max_sigma_s = 0.0025;   ///< one standard deviation, above which the answer is refused
  double least_likelihood = 10;  ///< of the peak, over no relation (natural logarithm)
  double least_lead = 4;         ///< of the peak over any other delay more than four sigmas (at least 15 ms) away
  int least_frames = 24;
  double most_discord = 4;  ///< likelihood that delays of their own gain for recordings, and one more for each of them
};

/// One recording: what its images and its sensor saw.
struct DelayRun {
  std::vector<ImageTurn> turns;
  TurnSource source;
};

/// What a recording says alone.
struct RunDelay {
  std::size_t frames = 0;
  double delay_s = 0;
  double gain = 0;  ///< likelihood over that of the common delay
};

/// What can be compared: turns about the camera's axes (right, down, forward), and, over a level floor whose place is
/// known, what the image's centre does (shift right, shift down, growth).
inline constexpr std::array<const char*, 6> kChannelNames = {"turn_right",  "turn_down",  "turn_forward",
                                                             "shift_right", "shift_down", "growth"};
using ChannelChoice = std::array<bool, 6>;
inline constexpr ChannelChoice kAllChannels = {true, true, true, true, true, true};

/// How one of them follows the sensor.
struct AxisFit {
  bool compared = false;
  bool used = false;       ///< the relation is credible
  bool epipolar = false;   ///< which of the two estimates of the image's turn
  double scale = 0;        ///< image over gyro; NaN where the axes of the sensor are not known and three were fitted
  double bias_radps = 0;   ///< mean over the recordings
  double correlation = 0;  ///< between the image's rates and what the gyro says they are
  double residual_radps = 0;
  double gyro_rms_radps = 0;   ///< of the variation about its mean
  double effective_share = 1;  ///< of the frames, by the correlation of neighbouring residuals
};

struct DelayFit {
  double delay_s = 0, sigma_s = 0;
  double curvature_sigma_s = 0, jackknife_sigma_s = 0;  ///< sigma_s is the larger
  double likelihood = 0;                                ///< of the peak over no relation
  double lead = 0;                                      ///< over the best delay elsewhere
  std::size_t frames = 0;                               ///< pairs of frames used
  std::vector<RunDelay> runs;                           ///< by recording; of one alone there is nothing to say
  double discord = 0;                                   ///< sum of their gains
  std::array<AxisFit, 6> axes;
  std::vector<double> profile_delay_s, profile;  ///< the whole search
  std::vector<double> time_s;                    ///< of the pairs, middle, since the first; recordings end to end
  std::array<std::vector<double>, 6> image_radps,
      gyro_radps;  ///< at the found delay; gyro scaled and biased to the image

  std::string refusal;  ///< why the answer may not be used; empty: it may
  [[nodiscard]] bool ok() const { return refusal.empty(); }
};

/// `choice` says what may take part; those of the floor do only where the source knows of one.
DelayFit fit_delay(std::span<const DelayRun> runs, const DelayParams& params = {},
                   const ChannelChoice& choice = kAllChannels);

}  // namespace wasp::calibration
