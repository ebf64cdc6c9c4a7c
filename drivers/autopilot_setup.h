// Before arming: who is at the other end, what its parameters say, and that the streams a flight needs come. Asks one
// thing at a time, again until it is answered or known to be absent, and everything anew after a reboot; while nobody
// flies it reads the parameters again and again, so that what is changed on a ground station counts. Protocol state
// only: no thread, no clock, no device; one thread.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "drivers/autopilot_checks.h"
#include "drivers/autopilot_link.h"

namespace wasp::drivers {

/// Why a vehicle cannot be armed yet, for want of its autopilot.
enum class SetupBar : std::uint8_t {
  kNone = 0,
  kNotHeard,        ///< no heartbeat yet
  kOtherAutopilot,  ///< another one than configured
  kAsking,          ///< parameters
  kRefused,         ///< parameters are not as they must be
  kNoAttitude,      ///< the attitude comes too rarely, or not
};
/// "its parameters are being read" etc.
const char* name_of(SetupBar bar) WASP_REALTIME;

class AutopilotSetup {
 public:
  static constexpr int kTries = 10;  ///< of a question before its answer counts as absent
  static constexpr DurationNs kAskAgain = 250 * kMillisecond;
  static constexpr DurationNs kStreamsAgain = 2 * kSecond;  ///< before a stream that is missing is asked for again
  static constexpr DurationNs kStreamsLost = 500 * kMillisecond;   ///< likewise, one that somebody else has slowed down
  static constexpr DurationNs kRefreshEvery = 500 * kMillisecond;  ///< on the ground: one parameter, absent ones too
  static constexpr DurationNs kSilence = 3 * kSecond;              ///< of heartbeats; after it everything is asked anew
  static constexpr double kLeastAttitude_hz = 12;                  ///< below it attitudes are too old between two

  AutopilotSetup(const SetupWish& wish, const LinkIdentity& identity);

  void on_heartbeat(const AutopilotStatus& status) WASP_REALTIME;
  /// Takes PARAM_VALUE and AUTOPILOT_VERSION of the autopilot; false if the frame is none of them.
  bool on_frame(const mavlink::Frame& frame) WASP_REALTIME;
  void on_attitude(TimeNs now_ns) WASP_REALTIME;
  /// The autopilot began anew.
  void restart() WASP_REALTIME;

  /// The next question, encoded; 0 when none is due. Call it every 20 ms or so.
  std::size_t next_question(TimeNs now_ns, AutopilotLink& link, std::span<std::uint8_t> out) WASP_REALTIME;
  /// A line for the log; false when there is no news. `verdict`: it says whether the vehicle may be armed.
  bool take_news(TextLine& line, bool& verdict) WASP_REALTIME;

  [[nodiscard]] SetupBar bar() const WASP_REALTIME;
  /// There is something to be asked: not of wasp's own dialect.
  [[nodiscard]] bool active() const WASP_REALTIME { return context_.wish.flavour != Flavour::kWasp; }
  [[nodiscard]] const AutopilotSemantics& semantics() const WASP_REALTIME { return semantics_; }
  [[nodiscard]] const Verdict& verdict() const noexcept { return verdict_; }
  [[nodiscard]] const Readings& readings() const noexcept { return readings_; }
  [[nodiscard]] std::span<const std::string_view> names() const noexcept { return names_; }
  [[nodiscard]] const AutopilotStatus& status() const noexcept { return status_; }
  [[nodiscard]] std::uint32_t version() const noexcept { return context_.version; }
  [[nodiscard]] double attitude_hz() const noexcept { return attitude_hz_; }

 private:
  struct Question {
    TimeNs asked_at_ns = kNever;
    int tries = 0;
    bool told = false;  ///< its answer is in the log
  };
  std::size_t ask_version(TimeNs now_ns, AutopilotLink& link, std::span<std::uint8_t> out) WASP_REALTIME;
  std::size_t ask_parameter(TimeNs now_ns, AutopilotLink& link, std::span<std::uint8_t> out) WASP_REALTIME;
  std::size_t ask_streams(TimeNs now_ns, AutopilotLink& link, std::span<std::uint8_t> out) WASP_REALTIME;
  std::size_t read_parameter(std::size_t i, AutopilotLink& link, std::span<std::uint8_t> out) WASP_REALTIME;
  std::size_t write_parameter(TimeNs now_ns, AutopilotLink& link, std::span<std::uint8_t> out) WASP_REALTIME;
  void take_parameter(const mavlink::ParamValue& value) WASP_REALTIME;
  void measure_attitude(TimeNs now_ns) WASP_REALTIME;
  void watch_attitude(TimeNs now_ns) WASP_REALTIME;
  void conclude() WASP_REALTIME;
  bool due(Question& question, TimeNs now_ns) const WASP_REALTIME;
  [[nodiscard]] bool all_read() const WASP_REALTIME;

  CheckContext context_;
  LinkIdentity identity_;
  std::span<const std::string_view> names_;
  AutopilotStatus status_;
  AutopilotSemantics semantics_;
  Verdict verdict_;
  Readings readings_{};
  std::array<Question, kMostParameters> questions_{};
  Question version_question_, write_question_;
  ParameterEncoding encoding_;
  bool version_known_ = false, concluded_ = false, conclusion_told_ = true, heard_told_ = false;
  TimeNs streams_due_ns_ = 0, refresh_due_ns_ = 0, window_from_ns_ = kNever;
  TimeNs attitude_at_ns_ = kNever, streams_asked_ns_ = 0;
  std::size_t stream_ = 0, refreshed_ = 0;  ///< next of the table; next parameter to read again
  int stream_rounds_ = 0;
  bool streams_fall_back_ = false, streams_lost_ = false;
  int attitudes_ = 0;
  double attitude_hz_ = 0;
};

}  // namespace wasp::drivers
