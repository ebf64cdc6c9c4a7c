// A signed line to the autopilot: what goes out is signed, what comes in is judged ([autopilot] signing). One key; the
// flying process and its guardian are streams of their own.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "messages/signature_check.h"
#include "messages/signing_key.h"

namespace wasp::drivers {

struct SigningSettings {
  std::string mode = "off";  ///< off | sign: what comes in may be unsigned | require: it may not, but for RADIO_STATUS
  std::string key_file;
};

class LinkSigning {
 public:
  /// Link ids of the threads of each process; a receiver keeps about sixteen streams.
  static constexpr std::uint8_t kFlightLink = 1, kGuardianLink = 64, kAutopilotLink = 128;

  /// Reads the key and the stored time. Throws std::runtime_error naming the file.
  LinkSigning(const SigningSettings& settings, std::uint8_t first_link);

  /// Keeps up with wall time; from the thread that reads or writes. Realtime-safe: yes.
  void follow(TimeNs now_ns) WASP_REALTIME { clock_.advance_to(mavlink::signing_time_of(now_ns + wall_ns_)); }
  /// Stores the time reached; false if the file cannot be written. Not realtime-safe.
  bool save() const noexcept { return mavlink::save_signing_time(time_file_, clock_.now()); }
  [[nodiscard]] const std::string& time_file() const noexcept { return time_file_; }

  [[nodiscard]] mavlink::SigningClock& clock() noexcept { return clock_; }
  [[nodiscard]] mavlink::FrameSigner& signer() noexcept { return signer_; }
  [[nodiscard]] mavlink::SignatureCheck& check() noexcept { return check_; }

 private:
  std::string time_file_;
  TimeNs wall_ns_;  ///< wall time minus CLOCK_MONOTONIC at the start: later steps of the wall clock are not followed
  mavlink::SigningKey key_;
  mavlink::SigningClock clock_;
  mavlink::FrameSigner signer_;
  mavlink::SignatureCheck check_;
};

/// Nullptr when signing is off.
std::unique_ptr<LinkSigning> open_signing(const SigningSettings& settings, std::uint8_t first_link);

/// Why frames were refused since `before`, "" if none was.
std::string_view refusal_since(const mavlink::SignatureCounts& before, const mavlink::SignatureCounts& now) WASP_REALTIME;

}  // namespace wasp::drivers
