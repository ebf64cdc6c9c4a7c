#include "drivers/autopilot_setup.h"

namespace wasp::drivers {
namespace {

constexpr DurationNs kWindow = kSecond;              ///< over which the rate of attitudes is counted
constexpr std::uint16_t kRequestCapabilities = 520;  ///< MAV_CMD_REQUEST_MESSAGE in releases before 2021

/// A message to be sent by itself, and how often.
struct StreamRow {
  std::uint32_t message;
  double hz;  ///< 0: as the wish says
};
/// PX4 sends HEARTBEAT once a second, whatever it is asked.
constexpr std::array kPx4Streams{StreamRow{mavlink::AttitudeQuaternion::kId, 0}, StreamRow{mavlink::HighresImu::kId, 0},
                                 StreamRow{mavlink::LocalPositionNed::kId, 0}};
constexpr std::array kCopterStreams{StreamRow{mavlink::Attitude::kId, 0}, StreamRow{mavlink::RawImu::kId, 0},
                                    StreamRow{mavlink::LocalPositionNed::kId, 0},
                                    StreamRow{mavlink::Heartbeat::kId, 5}};
constexpr double kGapInAttitudes = 5;  ///< of so many intervals: somebody else has set the rate

/// MAV_DATA_STREAM, the way before SET_MESSAGE_INTERVAL: raw sensors, position, attitude.
struct OldStreamRow {
  std::uint8_t stream;
  std::uint16_t hz;
};
constexpr std::array kOldStreams{OldStreamRow{10, 50}, OldStreamRow{1, 50}, OldStreamRow{6, 10}};

std::span<const StreamRow> streams_of(Flavour flavour) noexcept {
  if (flavour == Flavour::kPx4) return kPx4Streams;
  return kCopterStreams;
}

void name_version(std::uint32_t version, TextLine& line) noexcept {
  line << " " << static_cast<double>(version >> 24) << "." << static_cast<double>(version >> 16 & 0xff) << "."
       << static_cast<double>(version >> 8 & 0xff) << ((version & 0xff) < 64 ? " (development)" : "");
}

}  // namespace

const char* name_of(SetupBar bar) WASP_REALTIME {
  constexpr std::array kNames = {"nothing",
                                 "the autopilot is not heard",
                                 "the autopilot is not the one that autopilot.flavour says",
                                 "the autopilot's parameters are being read",
                                 "the autopilot's parameters are not as they must be",
                                 "attitudes come too rarely from the autopilot"};
  const auto i = static_cast<std::size_t>(bar);
  return i < kNames.size() ? kNames[i] : "unknown";
}

AutopilotSetup::AutopilotSetup(const SetupWish& wish, const LinkIdentity& identity)
    : context_{wish, identity.system_id},
      identity_(identity),
      names_(parameters_of(wish.flavour)),
      semantics_(semantics_of(wish)),
      encoding_(facts_of(wish.flavour).encoding) {}

void AutopilotSetup::restart() WASP_REALTIME {
  readings_ = {};
  questions_ = {};
  version_question_ = write_question_ = {};
  version_known_ = concluded_ = heard_told_ = streams_fall_back_ = false;
  conclusion_told_ = true;
  streams_due_ns_ = streams_asked_ns_ = 0;
  attitude_at_ns_ = kNever;
  streams_lost_ = false;
  stream_ = 0;
  stream_rounds_ = attitudes_ = 0;
  window_from_ns_ = kNever;
  attitude_hz_ = 0;
}

void AutopilotSetup::on_heartbeat(const AutopilotStatus& status) WASP_REALTIME {
  const bool came_back = status_.received_at_ns != kNever && status.received_at_ns - status_.received_at_ns > kSilence;
  if (active() && came_back) restart();
  status_ = status;
}

bool AutopilotSetup::on_frame(const mavlink::Frame& frame) WASP_REALTIME {
  if (!active() || frame.system_id != identity_.autopilot_system_id ||
      frame.component_id != identity_.autopilot_component_id)
    return false;
  if (frame.is<mavlink::ParamValue>()) {
    take_parameter(frame.as<mavlink::ParamValue>());
    return true;
  }
  if (!frame.is<mavlink::AutopilotVersion>()) return false;
  const auto m = frame.as<mavlink::AutopilotVersion>();
  context_.version = m.flight_sw_version;
  encoding_ = encoding_of(m.capabilities, facts_of(context_.wish.flavour).encoding);
  version_known_ = true;
  return true;
}

void AutopilotSetup::take_parameter(const mavlink::ParamValue& m) WASP_REALTIME {
  const std::string_view name = name_of(m.param_id);
  for (std::size_t i = 0; i < names_.size(); ++i) {
    if (names_[i] != name) continue;
    const auto value = decode_parameter(encoding_, m.param_type, m.param_value);
    if (!value) return;
    Reading& reading = readings_[i];
    const bool news = reading.state != ReadingState::kKnown || reading.value != *value;
    reading = {ReadingState::kKnown, *value};
    if (!news) return;
    questions_[i].told = false;
    if (concluded_) conclude();
    return;
  }
}

void AutopilotSetup::on_attitude(TimeNs now_ns) WASP_REALTIME {
  if (window_from_ns_ == kNever) window_from_ns_ = now_ns;
  attitude_at_ns_ = now_ns;
  ++attitudes_;
}

/// A ground station on the same channel may set the rates of all streams again and again (MAVProxy does): they are
/// asked for at once, before an attitude is too old.
void AutopilotSetup::watch_attitude(TimeNs now_ns) WASP_REALTIME {
  if (attitude_at_ns_ == kNever || stream_ != 0 || stream_rounds_ == 0 || now_ns - streams_asked_ns_ < kStreamsLost)
    return;
  if (now_ns - attitude_at_ns_ < from_seconds(kGapInAttitudes / context_.wish.stream_hz)) return;
  streams_lost_ = true;
  streams_fall_back_ = false;
  streams_due_ns_ = now_ns;
}

void AutopilotSetup::measure_attitude(TimeNs now_ns) WASP_REALTIME {
  if (window_from_ns_ == kNever || now_ns - window_from_ns_ < kWindow) return;
  attitude_hz_ = attitudes_ / to_seconds(now_ns - window_from_ns_);
  attitudes_ = 0;
  window_from_ns_ = now_ns;
}

bool AutopilotSetup::all_read() const WASP_REALTIME {
  for (std::size_t i = 0; i < names_.size(); ++i)
    if (readings_[i].state == ReadingState::kUnknown) return false;
  return true;
}

void AutopilotSetup::conclude() WASP_REALTIME {
  verdict_ = judge(context_, readings_);
  semantics_ = verdict_.semantics;
  concluded_ = true;
  conclusion_told_ = false;
}

SetupBar AutopilotSetup::bar() const WASP_REALTIME {
  if (!active()) return SetupBar::kNone;
  if (status_.received_at_ns == kNever) return SetupBar::kNotHeard;
  if (!fits(context_.wish.flavour, status_.autopilot)) return SetupBar::kOtherAutopilot;
  if (!concluded_) return SetupBar::kAsking;
  if (!verdict_.refusal.empty() && context_.wish.enforce) return SetupBar::kRefused;
  if (attitude_hz_ < kLeastAttitude_hz) return SetupBar::kNoAttitude;
  return SetupBar::kNone;
}

bool AutopilotSetup::due(Question& question, TimeNs now_ns) const WASP_REALTIME {
  if (question.asked_at_ns != kNever && now_ns - question.asked_at_ns < kAskAgain) return false;
  question.asked_at_ns = now_ns;
  ++question.tries;
  return true;
}

std::size_t AutopilotSetup::next_question(TimeNs now_ns, AutopilotLink& link,
                                          std::span<std::uint8_t> out) WASP_REALTIME {
  if (!active()) return 0;
  measure_attitude(now_ns);
  watch_attitude(now_ns);
  if (status_.received_at_ns == kNever || !fits(context_.wish.flavour, status_.autopilot)) return 0;
  if (const std::size_t n = ask_version(now_ns, link, out); n != 0) return n;
  if (const std::size_t n = ask_streams(now_ns, link, out); n != 0) return n;
  return ask_parameter(now_ns, link, out);
}

/// By the new command and the old one in turn; whoever knows neither is taken for what the flavour says.
std::size_t AutopilotSetup::ask_version(TimeNs now_ns, AutopilotLink& link, std::span<std::uint8_t> out) WASP_REALTIME {
  if (version_known_ || version_question_.tries >= kTries || !due(version_question_, now_ns)) return 0;
  const bool newer = version_question_.tries % 2 == 1;
  const std::uint16_t command = newer ? mavlink::mav_cmd::kRequestMessage : kRequestCapabilities;
  return link.encode_command(command, {newer ? float{mavlink::AutopilotVersion::kId} : 1.f}, 0, out);
}

std::size_t AutopilotSetup::read_parameter(std::size_t i, AutopilotLink& link,
                                           std::span<std::uint8_t> out) WASP_REALTIME {
  mavlink::ParamRequestRead m;
  m.param_index = -1;
  m.target_system = identity_.autopilot_system_id;
  m.target_component = identity_.autopilot_component_id;
  m.param_id = parameter_name(names_[i]);
  return link.encode(m, out);
}

/// Its PARAM_VALUE, which answers, is judged as any other.
std::size_t AutopilotSetup::write_parameter(TimeNs now_ns, AutopilotLink& link,
                                            std::span<std::uint8_t> out) WASP_REALTIME {
  if (verdict_.to_write < 0 || write_question_.tries >= kTries || !due(write_question_, now_ns)) return 0;
  mavlink::ParamSet m;
  m.target_system = identity_.autopilot_system_id;
  m.target_component = identity_.autopilot_component_id;
  m.param_id = parameter_name(names_[static_cast<std::size_t>(verdict_.to_write)]);
  m.param_type = mavlink::mav_param_type::kInt32;
  const auto value = encode_parameter(encoding_, m.param_type, verdict_.value_to_write);
  if (!value) return 0;
  m.param_value = *value;
  return link.encode(m, out);
}

/// Values mean nothing before the encoding is known, so the version comes first.
std::size_t AutopilotSetup::ask_parameter(TimeNs now_ns, AutopilotLink& link,
                                          std::span<std::uint8_t> out) WASP_REALTIME {
  if (!version_known_ && version_question_.tries < kTries) return 0;
  for (std::size_t i = 0; i < names_.size(); ++i) {
    if (readings_[i].state != ReadingState::kUnknown) continue;
    if (questions_[i].tries >= kTries)
      readings_[i].state = ReadingState::kAbsent;
    else if (due(questions_[i], now_ns))
      return read_parameter(i, link, out);
  }
  if (!concluded_ && all_read()) conclude();
  if (!concluded_ || status_.armed || names_.empty()) return 0;
  if (const std::size_t n = write_parameter(now_ns, link, out); n != 0) return n;
  if (now_ns < refresh_due_ns_) return 0;
  refresh_due_ns_ = now_ns + kRefreshEvery;
  refreshed_ = (refreshed_ + 1) % names_.size();
  return read_parameter(refreshed_, link, out);
}

/// All of them once; then again, by the old way in turn with the new, while the attitude comes too rarely.
std::size_t AutopilotSetup::ask_streams(TimeNs now_ns, AutopilotLink& link, std::span<std::uint8_t> out) WASP_REALTIME {
  if (now_ns < streams_due_ns_) return 0;
  const auto rows = streams_of(context_.wish.flavour);
  const double wanted_hz = context_.wish.stream_hz;
  if (stream_ == 0 && stream_rounds_ > 0 && !streams_lost_ && attitude_hz_ >= 0.5 * wanted_hz) {
    streams_due_ns_ = now_ns + kStreamsAgain;
    return 0;
  }
  std::size_t n = 0;
  if (streams_fall_back_) {
    const OldStreamRow& row = kOldStreams[stream_];
    n = link.encode(mavlink::RequestDataStream{row.hz, identity_.autopilot_system_id, identity_.autopilot_component_id,
                                               row.stream, 1},
                    out);
  } else {
    const bool position = rows[stream_].message == mavlink::LocalPositionNed::kId;
    const double own_hz = position ? context_.wish.position_hz : rows[stream_].hz;
    const double hz = own_hz > 0 ? std::min(own_hz, wanted_hz) : wanted_hz;
    n = link.encode_message_interval(rows[stream_].message, from_seconds(1 / hz), 0, out);
  }
  stream_ = (stream_ + 1) % (streams_fall_back_ ? kOldStreams.size() : rows.size());
  if (stream_ != 0) return n;
  ++stream_rounds_;
  streams_lost_ = false;
  streams_asked_ns_ = now_ns;
  streams_fall_back_ = stream_rounds_ % 2 == 0 && context_.wish.flavour == Flavour::kArduPilot;
  streams_due_ns_ = now_ns + kStreamsAgain;
  return n;
}

bool AutopilotSetup::take_news(TextLine& line, bool& verdict) WASP_REALTIME {
  verdict = false;
  if (!active() || status_.received_at_ns == kNever) return false;
  if (!heard_told_) {
    heard_told_ = true;
    if (fits(context_.wish.flavour, status_.autopilot)) {
      line << "autopilot heard: " << facts_of(context_.wish.flavour).name;
    } else {
      line << "the autopilot says MAV_AUTOPILOT " << static_cast<double>(status_.autopilot)
           << ", autopilot.flavour says " << facts_of(context_.wish.flavour).name << ": set it to "
           << (fits(Flavour::kPx4, status_.autopilot)         ? "px4"
               : fits(Flavour::kArduPilot, status_.autopilot) ? "ardupilot"
                                                              : "what it is");
    }
    return true;
  }
  for (std::size_t i = 0; i < names_.size(); ++i) {
    if (questions_[i].told || readings_[i].state == ReadingState::kUnknown) continue;
    questions_[i].told = true;
    line << "autopilot parameter " << names_[i];
    if (readings_[i].state == ReadingState::kAbsent) {
      line << " is absent";
      return true;
    }
    const std::string_view meaning = meaning_of(context_.wish.flavour, i, readings_[i].value);
    line << " = " << readings_[i].value << (meaning.empty() ? "" : ": ") << meaning;
    return true;
  }
  if (conclusion_told_) return false;
  verdict = conclusion_told_ = true;
  if (!verdict_.refusal.empty()) {
    line << (context_.wish.enforce ? "not arming: " : "check only warns: ") << verdict_.refusal.view();
    return true;
  }
  line << "autopilot";
  if (version_known_) name_version(context_.version, line);
  line << " ready; its failsafe: " << verdict_.failsafe.view();
  return true;
}

}  // namespace wasp::drivers
