#include "scheduling/telemetry.h"

#include <algorithm>
#include <cmath>

#include "scheduling/flow_ring.h"
#include "scheduling/parameter_table.h"
#include "scheduling/version.h"
#include "shm/topics.h"
#include "vision/time_to_contact.h"

namespace wasp::scheduling {
namespace {

using namespace mavlink;  // NOLINT: message names
constexpr std::size_t kOverhead = kHeaderV2 + kChecksumBytes + kSignatureBytes;
constexpr DurationNs kComputerStale = 5 * kSecond, kFastest = 20 * kMillisecond, kSlowest = 3600 * kSecond;
constexpr std::uint8_t kFlowSensor = 0;

template <class M>
constexpr std::size_t kMost = M::kMaxLength + kOverhead;

DurationNs interval_of(double rate_hz) noexcept { return rate_hz > 0 ? from_seconds(1 / rate_hz) : 0; }

std::size_t size_of(std::uint32_t id) noexcept {
  const MessageInfo* info = find_message(id);
  return info == nullptr ? kMaxFrame : info->max_length + kOverhead;
}

vision::ObstacleBinsParams bins_of(const Config& c) {
  vision::ObstacleBinsParams p;
  p.camera = c.camera;
  p.map.above_m = static_cast<float>(c.telemetry.obstacle_above_m);
  p.map.below_m = static_cast<float>(c.telemetry.obstacle_below_m);
  p.least_m = static_cast<float>(c.telemetry.obstacle_least_m);
  p.greatest_m = static_cast<float>(c.telemetry.obstacle_greatest_m);
  return p;
}

}  // namespace

void TelemetryInbox::tell(std::uint8_t severity, std::string_view text) noexcept {
  Text order;
  order.severity = severity;
  order.size = std::min(text.size(), order.bytes.size());
  std::copy_n(text.begin(), order.size, order.bytes.begin());
  texts.push(order);
}

Telemetry::Telemetry(const Config& c, const shm::Region& flight, drivers::AutopilotLink& link)
    : link_(link),
      parameters_(parameter_table(c)),
      own_(c, flight, link),
      tell_texts_(c.telemetry.texts),
      bins_(bins_of(c)) {
  const TelemetryConfig& t = c.telemetry;
  const auto set = [&](Kind kind, std::uint32_t id, double rate_hz) {
    streams_[kind].id = id;
    streams_[kind].usual_ns = streams_[kind].interval_ns = interval_of(rate_hz);
  };
  set(kComputer, OnboardComputerStatus::kId, t.computer_status_hz);
  set(kObstacles, ObstacleDistance::kId, t.obstacle_distance_hz);
  set(kFlow, OpticalFlowRad::kId, t.optical_flow_hz);
  set(kHeight, NamedValueFloat::kId, t.named_values_hz);
  set(kContact, NamedValueFloat::kId, t.named_values_hz);
  set(kCues, WaspCue::kId, t.cues_hz);
  set(kLatencies, WaspLatency::kId, t.latencies_hz);
  set(kState, WaspState::kId, t.state_hz);
  set(kField, WaspFlow::kId, t.flow_field_hz);
  ground_flow_ = voice(c, flight, vision::GroundFlow::kName);
  ground_ = voice(c, flight, "ground_altitude");
  contact_ = voice(c, flight, vision::TimeToContactFront::kName);
  down_camera_below_m_ = c.camera_down.geometry.position_body_m.z() - c.camera.position_body_m.z();
  if (flight.has(shm::kFlow)) flow_ring_.emplace(flight, shm::kFlow, "Flow");
  for (std::size_t i = 0; i < c.behaviours.size(); ++i)
    if (c.behaviours[i].name == vision::TimeToContactFront::kName)
      TomlTable(c.behaviour_params[i]).number("frame_s", frame_s_, 0.005, 0.2);
  for (std::size_t i = 0; i < c.behaviours.size(); ++i)
    if (c.behaviours[i].name == "flow_field") flow_age_limit_ns_ = c.control.arbiter.rows[i].age_limit_ns;
}

Telemetry::Voice Telemetry::voice(const Config& c, const shm::Region& flight, std::string_view behaviour) const {
  Voice voice;
  for (std::size_t i = 0; i < c.behaviours.size(); ++i) {
    if (c.behaviours[i].name != behaviour || !c.behaviours[i].enabled) continue;
    voice.ring.emplace(flight, shm::cue_topic(c.behaviours[i].name), "Cue");
    voice.age_limit_ns = c.control.arbiter.rows[i].age_limit_ns;
  }
  return voice;
}

bool Telemetry::receive(const Frame& frame, TimeNs now_ns) WASP_REALTIME {
  const auto changed = [this](std::size_t row) noexcept { rate_changed(row); };
  if (parameters_.receive(frame, link_.identity(), changed)) return true;
  const auto command = drivers::command_for(link_.identity(), frame);
  if (!command) return false;
  const std::uint8_t result = obey(*command, now_ns);
  if (command->by_name || result == mav_result::kAccepted) acks_.add(*command, result);
  return true;
}

std::uint8_t Telemetry::obey(const drivers::ServiceCommand& command, TimeNs now_ns) WASP_REALTIME {
  const float wanted = command.param[0];
  const bool possible = wanted >= 0.f && wanted < 16'777'216.f;  // NaN fails
  const std::uint32_t id = possible ? static_cast<std::uint32_t>(wanted) : 0xffffffffu;
  switch (command.command) {
    case mav_cmd::kRequestMessage:
      return request(id);
    case mav_cmd::kSetMessageInterval:
      return set_interval(id, command.param[1], now_ns);
    case mav_cmd::kGetMessageInterval:
      if (!possible || id > 65535) return mav_result::kDenied;
      interval_asked_ = static_cast<std::int32_t>(id);
      return mav_result::kAccepted;
    default:
      return mav_result::kUnsupported;
  }
}

std::uint8_t Telemetry::request(std::uint32_t id) WASP_REALTIME {
  if (id == AutopilotVersion::kId) {
    version_asked_ = true;
    return mav_result::kAccepted;
  }
  std::uint8_t result = mav_result::kUnsupported;
  for (Stream& s : streams_)
    if (s.id == id) s.once = true, result = mav_result::kAccepted;
  return result;
}

std::uint8_t Telemetry::set_interval(std::uint32_t id, float interval_us, TimeNs now_ns) WASP_REALTIME {
  std::uint8_t result = mav_result::kUnsupported;
  for (Stream& s : streams_) {
    if (s.id != id) continue;
    if (interval_us == -1.f || interval_us == 0.f) {
      s.interval_ns = interval_us == 0.f ? s.usual_ns : 0;
    } else {
      if (!(interval_us > 0.f && interval_us <= 3.6e9f)) return mav_result::kDenied;
      const auto wanted_ns = static_cast<DurationNs>(static_cast<double>(interval_us) * kMicrosecond);
      if (wanted_ns < kFastest || wanted_ns > kSlowest) return mav_result::kDenied;
      s.interval_ns = wanted_ns;
    }
    s.due_ns = now_ns;
    result = mav_result::kAccepted;
  }
  return result;
}

/// PARAM_SET of a rate: what is usual from now on.
void Telemetry::rate_changed(std::size_t row) WASP_REALTIME {
  const drivers::ParameterRow& parameter = parameters_.row(row);
  const auto name = drivers::name_of(parameter.name);
  const auto set = [&](Kind kind) noexcept {
    streams_[kind].usual_ns = streams_[kind].interval_ns = interval_of(parameter.value);
    streams_[kind].due_ns = 0;
  };
  if (name == kObstacleRate) set(kObstacles);
  if (name == kFlowRate) set(kFlow);
  if (name == kComputerRate) set(kComputer);
  if (name == kNamedRate) set(kHeight), set(kContact);
}

void Telemetry::take_in(TimeNs now_ns) WASP_REALTIME {
  TelemetryInbox::Text text;
  for (int i = 0; i < 4 && inbox_.texts.pop(text); ++i)
    if (tell_texts_) texts_.offer(text.severity, {text.bytes.data(), text.size}, now_ns);
  if (!ground_flow_.ring) return;
  Cue cue;
  for (std::uint32_t i = 0; i < shm::kCueSlots && ground_flow_.ring->read(cue); ++i) flow_sum_.add(cue);
}

/// The next frame that is due and finds room; 0: none.
std::size_t Telemetry::next(TimeNs now_ns, LineGate& gate, std::span<std::uint8_t> out) WASP_REALTIME {
  if (const std::size_t n = answer(now_ns, gate, out); n > 0) return n;
  for (std::size_t i = 0; i < kKinds; ++i) {
    Stream& s = streams_[i];
    if (!s.due(now_ns) || !gate.affords(size_of(s.id), now_ns)) continue;
    const std::size_t n = stream(static_cast<Kind>(i), now_ns, out);
    if (n == 0) continue;                             // nothing to be said of it now
    if (i == kField && own_.field_begun()) return n;  // its other parts follow as soon as there is room
    s.once = false;
    s.due_ns = s.due_ns + s.interval_ns > now_ns ? s.due_ns + s.interval_ns : now_ns + s.interval_ns;
    return n;
  }
  return 0;
}

/// What somebody waits for, and texts; answers need room only, the rest its share as well.
std::size_t Telemetry::answer(TimeNs now_ns, LineGate& gate, std::span<std::uint8_t> out) WASP_REALTIME {
  if (acks_.waiting() && gate.fits(kMost<CommandAck>, now_ns)) return link_.encode(acks_.take(), out);
  if (version_asked_ && gate.fits(kMost<AutopilotVersion>, now_ns)) return version(out);
  if (interval_asked_ >= 0 && gate.fits(kMost<MessageInterval>, now_ns)) {
    MessageInterval m;
    m.message_id = static_cast<std::uint16_t>(interval_asked_);
    m.interval_us = 0;  // not available
    for (const Stream& s : streams_)
      if (s.id == m.message_id)
        m.interval_us = s.interval_ns > 0 ? static_cast<std::int32_t>(s.interval_ns / kMicrosecond) : -1;
    interval_asked_ = -1;
    return link_.encode(m, out);
  }
  if (texts_.due(now_ns) && gate.affords(kMost<Statustext>, now_ns)) return link_.encode(texts_.take(now_ns), out);
  ParamValue value;
  if (parameters_.waiting() && gate.affords(kMost<ParamValue>, now_ns) && parameters_.next(value))
    return link_.encode(value, out);
  return 0;
}

std::size_t Telemetry::version(std::span<std::uint8_t> out) WASP_REALTIME {
  version_asked_ = false;
  AutopilotVersion m;
  m.capabilities = mav_protocol_capability::kMavlink2 | drivers::capability_of(parameters_.encoding());
  m.flight_sw_version = kVersion;
  return link_.encode(m, out);
}

std::size_t Telemetry::stream(Kind kind, TimeNs now_ns, std::span<std::uint8_t> out) WASP_REALTIME {
  switch (kind) {
    case kComputer:
      return computer(now_ns, out);
    case kObstacles:
      return obstacles(now_ns, out);
    case kFlow:
      return flow(now_ns, out);
    case kHeight:
      return height(now_ns, out);
    case kContact:
      return contact(now_ns, out);
    case kCues:
      return own_.cue(out);
    case kLatencies:
      return own_.latency(now_ns, out);
    case kState:
      return own_.state(out);
    case kField:
      return own_.flow(now_ns, out);
    case kKinds:
      break;
  }
  return 0;
}

std::size_t Telemetry::computer(TimeNs now_ns, std::span<std::uint8_t> out) WASP_REALTIME {
  OnboardComputerStatus m;
  if (!inbox_.computer.load(m)) return 0;
  const TimeNs read_at_ns = static_cast<TimeNs>(m.uptime) * kMillisecond;
  if (now_ns - read_at_ns > kComputerStale) return 0;
  m.time_usec = told_us(link_, read_at_ns);
  return link_.encode(m, out);
}

/// Of the newest flow field with depth, once each.
std::size_t Telemetry::obstacles(TimeNs now_ns, std::span<std::uint8_t> out) WASP_REALTIME {
  if (!flow_ring_) return 0;
  const shm::Sample sample = flow_ring_->look(flow_ring_->newest());
  if (!sample || sample.number == obstacles_sent_) return 0;
  const auto* slot = reinterpret_cast<const FlowSlot*>(sample.data);
  const TimeNs shown_at_ns = slot->shown_at_ns;
  const FlowMessage& message = slot->message;
  if (now_ns - shown_at_ns > flow_age_limit_ns_ || !believable(message.seen)) return 0;
  const DurationNs interval_ns = message.exposed_at_ns - message.first_exposed_at_ns;
  const vision::ObstacleBins bins = vision::obstacle_bins(bins_, message);
  if (!flow_ring_->intact(sample)) return 0;
  obstacles_sent_ = sample.number;
  if (!bins.valid) return 0;
  ObstacleDistance m;
  m.time_usec = told_us(link_, shown_at_ns - interval_ns);
  m.distances = bins.distance_cm;
  m.min_distance = static_cast<std::uint16_t>(std::lround(100.f * bins_.least_m));
  m.max_distance = static_cast<std::uint16_t>(std::lround(100.f * bins_.greatest_m));
  m.sensor_type = mav_distance_sensor::kUnknown;
  m.increment = 360 / vision::kObstacleBins;
  m.increment_f = 360.f / static_cast<float>(vision::kObstacleBins);
  m.frame = mav_frame::kBodyFrd;
  return link_.encode(m, out);
}

std::size_t Telemetry::flow(TimeNs now_ns, std::span<std::uint8_t> out) WASP_REALTIME {
  if (flow_sum_.steps() == 0) return 0;
  if (now_ns - flow_sum_.until_ns() > ground_flow_.age_limit_ns) {  // nobody sees any more
    flow_sum_.taken();
    return 0;
  }
  const DurationNs integrated_ns = flow_sum_.until_ns() - flow_sum_.from_ns();
  if (integrated_ns < streams_[kFlow].interval_ns / 2 && !streams_[kFlow].once) return 0;
  OpticalFlowRad m;
  m.time_usec = told_us(link_, flow_sum_.until_ns());
  m.integration_time_us = static_cast<std::uint32_t>(integrated_ns / kMicrosecond);
  m.integrated_x = flow_sum_.flow_x_rad();
  m.integrated_y = flow_sum_.flow_y_rad();
  const auto gyro = gyro_.between(flow_sum_.from_ns(), flow_sum_.until_ns());
  const auto& turn = gyro ? *gyro : flow_sum_.turn_rad();
  m.integrated_xgyro = turn[0], m.integrated_ygyro = turn[1], m.integrated_zgyro = turn[2];
  m.quality = static_cast<std::uint8_t>(std::clamp(std::lround(255.f * flow_sum_.quality()), 1l, 255l));
  m.sensor_id = kFlowSensor;
  m.distance = -1.f;
  Cue ground;
  if (fresh(ground_, now_ns, ground) && ground.body.has_height != 0) {
    m.distance = std::max(0.f, ground.body.height_m - down_camera_below_m_) * flow_sum_.slant();
    m.time_delta_distance_us =
        static_cast<std::uint32_t>(std::max<DurationNs>(0, flow_sum_.until_ns() - ground.exposed_at_ns) / kMicrosecond);
  }
  flow_sum_.taken();
  return link_.encode(m, out);
}

/// The newest word of a behaviour, if it sees and is young enough.
bool Telemetry::fresh(const Voice& voice, TimeNs now_ns, Cue& cue) WASP_REALTIME {
  return voice.ring && voice.ring->copy_newest(cue) && cue.body.validity == Validity::kValid && cue.over_budget == 0 &&
         now_ns - cue.exposed_at_ns <= voice.age_limit_ns;
}

std::size_t Telemetry::named(const char* name, float value, TimeNs exposed_at_ns,
                             std::span<std::uint8_t> out) WASP_REALTIME {
  if (!std::isfinite(value)) return 0;
  NamedValueFloat m;
  m.time_boot_ms = static_cast<std::uint32_t>(std::max<TimeNs>(0, told_time(link_, exposed_at_ns)) / kMillisecond);
  m.value = value;
  for (std::size_t i = 0; i < m.name.size() && name[i] != '\0'; ++i) m.name[i] = name[i];
  return link_.encode(m, out);
}

std::size_t Telemetry::height(TimeNs now_ns, std::span<std::uint8_t> out) WASP_REALTIME {
  Cue cue;
  if (!fresh(ground_, now_ns, cue) || cue.body.has_height == 0) return 0;
  return named("height", cue.body.height_m, cue.exposed_at_ns, out);
}

/// Time to contact [s]; nothing where nothing comes nearer.
std::size_t Telemetry::contact(TimeNs now_ns, std::span<std::uint8_t> out) WASP_REALTIME {
  Cue cue;
  if (!fresh(contact_, now_ns, cue)) return 0;
  const float frames = cue.body.detail[vision::TimeToContactFront::kContact_frames];
  return frames > 0.f ? named("tau", frames * frame_s_, cue.exposed_at_ns, out) : 0;
}

}  // namespace wasp::scheduling
