#include "sim/lockstep.h"

#include <algorithm>

namespace wasp::sim {
namespace {

constexpr std::uint32_t kFollowMode = 1;
constexpr DurationNs kStep_ns = 5 * kMillisecond;
constexpr std::size_t kKeptAttitudes = 100;

}  // namespace

Lockstep::Lockstep(const LockstepOptions& options) : options_(options), simulator_(options.sim), camera_(options.sim) {
  const auto pixels = static_cast<std::size_t>(camera_.width_px()) * static_cast<std::size_t>(camera_.height_px());
  gray_.resize(pixels);
  depth_mm_.resize(pixels);
  ground_params_.camera = edge_params_.camera = options.sim.camera;
}

std::vector<LockstepSample> Lockstep::fly(double limit_s) {
  const auto frame_ns = from_seconds(1.0 / options_.sim.camera_rate_hz);
  TimeNs frame_due_ns = frame_ns, tick_due_ns = options_.control_period_ns;
  for (TimeNs now_ns = kStep_ns; now_ns < from_seconds(limit_s); now_ns += kStep_ns) {
    simulator_.advance_to(now_ns);
    exchange(now_ns);
    if (now_ns >= frame_due_ns) {
      expose(now_ns);
      frame_due_ns += frame_ns;
    }
    deliver_cues(now_ns);
    if (now_ns < tick_due_ns) continue;
    tick(now_ns);
    tick_due_ns += options_.control_period_ns;
    const auto phase = state_.mission.phase;
    if (phase == control::MissionPhase::kDone || phase == control::MissionPhase::kBroken) break;
  }
  return std::move(samples_);
}

void Lockstep::exchange(TimeNs now_ns) {
  bytes_.clear();
  simulator_.drain(bytes_);
  link_.receive(bytes_, now_ns, *this);
  if (attitudes_.size() > kKeptAttitudes) attitudes_.erase(attitudes_.begin(), attitudes_.end() - kKeptAttitudes / 2);
  if (now_ns < timesync_due_ns_) return;
  timesync_due_ns_ = now_ns + 200 * kMillisecond;
  std::array<std::uint8_t, mavlink::kMaxFrame> out;
  reply(std::span<const std::uint8_t>(out.data(), link_.encode_timesync_request(now_ns, out)));
}

void Lockstep::on_imu(const ImuSample& sample) noexcept {
  for (std::size_t k = 0; k < 3; ++k) accel_sum_[k] += static_cast<double>(sample.accel_body_mps2[k]);
  ++accel_count_;
  input_.autopilot.heard_at_ns = simulator_.now_ns();
}

void Lockstep::on_heartbeat(const drivers::AutopilotStatus& status) noexcept {
  input_.autopilot.armed = status.armed;
  input_.autopilot.follows = status.custom_mode == kFollowMode;
}

template <class B>
Cue Lockstep::step(const typename B::Params& params, typename B::State& state, const BehaviourInput& input,
                   std::uint32_t index) {
  Cue cue;
  cue.behaviour = index;
  cue.exposed_at_ns = input.exposed_at_ns;
  cue.frame_sequence = input.frame_sequence;
  cue.body = B::step(params, input, state);
  return cue;
}

void Lockstep::expose(TimeNs now_ns) {
  camera_.render(simulator_.pose(), frame_, gray_.data(), depth_mm_.data());
  BehaviourInput input;
  input.exposed_at_ns = now_ns;
  input.frame_sequence = frame_++;
  input.gray = {gray_.data(), camera_.width_px(), camera_.height_px(), camera_.width_px()};
  input.depth = {depth_mm_.data(), camera_.width_px(), camera_.height_px(), camera_.width_px()};
  const auto after =
      std::find_if(attitudes_.rbegin(), attitudes_.rend(), [&](const auto& a) { return a.exposed_at_ns <= now_ns; });
  input.attitude_valid = after != attitudes_.rend();
  if (input.attitude_valid) input.attitude = *after;
  pending_.push_back(step<vision::GroundAltitude>(ground_params_, ground_state_, input, 0));
  pending_.push_back(step<vision::EdgeAltitude>(edge_params_, edge_state_, input, 1));
}

void Lockstep::deliver_cues(TimeNs now_ns) {
  while (!pending_.empty() && pending_.front().exposed_at_ns + options_.camera_latency_ns <= now_ns) {
    const Cue& cue = pending_.front();
    input_.cues.cues[cue.behaviour] = cue;
    input_.cues.present[cue.behaviour] = true;
    pending_.erase(pending_.begin());
  }
}

void Lockstep::tick(TimeNs now_ns) {
  input_.now_ns = now_ns;
  input_.dt_s = static_cast<float>(to_seconds(options_.control_period_ns));
  input_.attitude_present = !attitudes_.empty();
  if (!attitudes_.empty()) input_.attitude = attitudes_.back();
  input_.accel_present = accel_count_ > 0;
  for (std::size_t k = 0; k < 3 && accel_count_ > 0; ++k)
    input_.accel_body_mps2[k] = static_cast<float>(accel_sum_[k] / accel_count_);
  accel_sum_ = {};
  accel_count_ = 0;
  const control::ControlOutput output = control::control_step(options_.control, input_, state_);
  send(output, now_ns);
  samples_.push_back({now_ns, simulator_.truth(), output.command, input_.cues.cues[0].body, input_.cues.cues[1].body});
}

void Lockstep::send(const control::ControlOutput& output, TimeNs now_ns) {
  std::array<std::uint8_t, mavlink::kMaxFrame> out;
  const auto give = [&](std::size_t n) { simulator_.from_companion(std::span<const std::uint8_t>(out.data(), n)); };
  const Command& c = output.command;
  if (c.sent != 0) give(link_.encode_attitude_target({c.q_ned_body, true, c.yaw_rate_radps, c.thrust}, now_ns, out));
  if ((output.ask_arm || output.ask_disarm) && now_ns >= request_due_ns_) {
    if (output.ask_arm) give(link_.encode_set_mode(kFollowMode, 0, 0, out));
    give(link_.encode_arm(output.ask_arm, 0, out));
    request_due_ns_ = now_ns + 500 * kMillisecond;
  }
}

}  // namespace wasp::sim
