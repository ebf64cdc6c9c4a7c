#include "sim/lockstep.h"

#include <algorithm>

#include "types/attitude_at.h"

namespace wasp::sim {
namespace {

constexpr DurationNs kQuestionPeriod = 20 * kMillisecond;
constexpr DurationNs kStep_ns = 5 * kMillisecond;
constexpr std::size_t kKeptAttitudes = 100, kKeptImu = 400;

template <class T>
void keep_last(std::deque<T>& queue, std::size_t n) {
  while (queue.size() > n) queue.pop_front();
}

drivers::SetupWish wish_of(const LockstepOptions& o) {
  drivers::SetupWish wish;
  wish.flavour = o.sim.flavour;
  wish.mode = drivers::facts_of(o.sim.flavour).own_mode;
  wish.max_tilt_rad = o.control.limits.max_tilt_rad;
  return wish;
}

std::size_t pixels_of(const SimCamera& camera) {
  return static_cast<std::size_t>(camera.width_px()) * static_cast<std::size_t>(camera.height_px());
}

}  // namespace

Lockstep::Lockstep(const LockstepOptions& options)
    : options_(options),
      simulator_(options.sim),
      scene_(make_world_scene(options.sim)),
      front_(scene_, options.sim.front(), options.sim.sensor, options.sim.seed),
      setup_(wish_of(options), drivers::LinkIdentity{}),
      gray_(pixels_of(front_)),
      depth_mm_(pixels_of(front_)),
      stepped_at_ns_(control::kMaxBehaviours, kNever) {
  if (!options.sim.down.enabled) return;
  down_.emplace(scene_, options.sim.down.setup, options.sim.sensor, down_seed(options.sim.seed));
  gray_down_.resize(pixels_of(*down_));
}

LockstepLog Lockstep::fly(double limit_s, const std::function<bool(const LockstepSample&)>& enough) {
  const auto front_ns = from_seconds(1.0 / options_.sim.camera_rate_hz);
  const auto down_ns = down_ ? from_seconds(1.0 / options_.sim.down.rate_hz) : kForever;
  TimeNs front_due_ns = front_ns, down_due_ns = down_ns, tick_due_ns = options_.control_period_ns;
  for (TimeNs now_ns = kStep_ns; now_ns < from_seconds(limit_s); now_ns += kStep_ns) {
    simulator_.advance_to(now_ns);
    exchange(now_ns);
    if (now_ns >= front_due_ns) {
      expose_front(now_ns);
      front_due_ns += front_ns;
    }
    if (now_ns >= down_due_ns) {
      expose_down(now_ns);
      down_due_ns += down_ns;
    }
    deliver_cues(now_ns);
    if (now_ns < tick_due_ns) continue;
    tick(now_ns);
    tick_due_ns += options_.control_period_ns;
    const auto phase = state_.mission.phase;
    if (phase == control::MissionPhase::kDone || phase == control::MissionPhase::kBroken) break;
    if (enough && enough(log_.samples.back())) break;
  }
  return std::move(log_);
}

void Lockstep::exchange(TimeNs now_ns) {
  bytes_.clear();
  simulator_.drain(bytes_);
  link_.receive(bytes_, now_ns, *this);
  keep_last(attitudes_, kKeptAttitudes);
  keep_last(imu_, kKeptImu);
  if (now_ns % kQuestionPeriod == 0) ask(now_ns);
  if (now_ns < timesync_due_ns_) return;
  timesync_due_ns_ = now_ns + 200 * kMillisecond;
  std::array<std::uint8_t, mavlink::kMaxFrame> out;
  reply(std::span<const std::uint8_t>(out.data(), link_.encode_timesync_request(now_ns, out)));
}

/// What the link thread does about an autopilot of another flavour.
void Lockstep::ask(TimeNs now_ns) {
  std::array<std::uint8_t, mavlink::kMaxFrame> out;
  if (const std::size_t n = setup_.next_question(now_ns, link_, out); n != 0)
    reply(std::span<const std::uint8_t>(out.data(), n));
  input_.autopilot.semantics = setup_.semantics();
  input_.may_arm = setup_.bar() == drivers::SetupBar::kNone;
}

void Lockstep::on_imu(const ImuSample& sample) noexcept {
  for (std::size_t k = 0; k < 3; ++k) accel_sum_[k] += static_cast<double>(sample.accel_body_mps2[k]);
  pressure_.add(sample);
  ++accel_count_;
  imu_.push_back(sample);
  log_.imu.push_back(sample);
  input_.autopilot.heard_at_ns = simulator_.now_ns();
}

void Lockstep::on_heartbeat(const drivers::AutopilotStatus& status) noexcept {
  input_.autopilot.armed = status.armed;
  const Flavour flavour = options_.sim.flavour;
  input_.autopilot.follows = drivers::main_mode_of(flavour, status.custom_mode) == drivers::facts_of(flavour).own_mode;
  setup_.on_heartbeat(status);
}

void Lockstep::expose_front(TimeNs now_ns) {
  front_.render(simulator_.pose(), frame_, gray_.data(), depth_mm_.data());
  BehaviourInput input;
  input.exposed_at_ns = now_ns;
  input.frame_sequence = frame_++;
  input.gray = {gray_.data(), front_.width_px(), front_.height_px(), front_.width_px()};
  input.depth = {depth_mm_.data(), front_.width_px(), front_.height_px(), front_.width_px()};
  ++log_.frames;
  step_all(false, input);
}

void Lockstep::expose_down(TimeNs now_ns) {
  down_->render(simulator_.pose(), down_frame_, gray_down_.data(), nullptr);
  BehaviourInput input;
  input.exposed_at_ns = now_ns;
  input.frame_sequence = down_frame_++;
  input.gray = {gray_down_.data(), down_->width_px(), down_->height_px(), down_->width_px()};
  step_all(true, input);
}

/// Those that see the frame itself first; then those that read the flow these made.
void Lockstep::step_all(bool down, BehaviourInput input) {
  const auto after = std::find_if(attitudes_.rbegin(), attitudes_.rend(),
                                  [&](const auto& a) { return a.exposed_at_ns <= input.exposed_at_ns; });
  input.attitude_valid = after != attitudes_.rend();
  if (input.attitude_valid) input.attitude = attitude_at(*after, nullptr, input.exposed_at_ns);
  const FlowMessage* flow = nullptr;
  for (const bool reads_flow : {false, true})
    for (const LockstepBehaviour& b : options_.behaviours) {
      if (looks_down(b.stream) != down || is_flow(b.stream) != reads_flow) continue;
      if (reads_flow && flow == nullptr) continue;
      BehaviourInput given = input;
      if (b.stream != Stream::kDepth && b.stream != Stream::kGrayDepth) given.depth = {};
      if (b.stream == Stream::kDepth || reads_flow) given.gray = {};
      given.flow = reads_flow ? flow : nullptr;
      if (const FlowMessage* made = step_one(b, given); made != nullptr) flow = made;
    }
}

/// Steps one behaviour; its cue arrives a camera latency later. Returns the flow it made, if any.
const FlowMessage* Lockstep::step_one(const LockstepBehaviour& behaviour, BehaviourInput& input) {
  match_inertial(stepped_at_ns_[behaviour.index], input);
  stepped_at_ns_[behaviour.index] = input.exposed_at_ns;
  const LockstepCue made = behaviour.step(input);
  Cue cue;
  cue.behaviour = behaviour.index;
  cue.exposed_at_ns = input.exposed_at_ns;
  cue.frame_sequence = input.frame_sequence;
  cue.attitude_valid = input.attitude_valid ? 1 : 0;
  cue.q_ned_body = input.attitude.q_ned_body;
  cue.rate_body_radps = input.attitude.rate_body_radps;
  cue.accel_valid = input.accel_valid ? 1 : 0;
  cue.accel_body_mps2 = input.accel_body_mps2;
  cue.body = made.body;
  pending_.push_back(cue);
  return made.flow;
}

/// Mean specific force between the exposure of the behaviour's last step and this one.
void Lockstep::match_inertial(TimeNs since_ns, BehaviourInput& input) const {
  std::array<double, 3> sum{};
  int n = 0;
  for (const ImuSample& s : imu_) {
    if (s.exposed_at_ns <= since_ns || s.exposed_at_ns > input.exposed_at_ns) continue;
    for (std::size_t k = 0; k < 3; ++k) sum[k] += static_cast<double>(s.accel_body_mps2[k]);
    ++n;
  }
  input.accel_valid = n > 0 && since_ns != kNever;
  for (std::size_t k = 0; n > 0 && k < 3; ++k) input.accel_body_mps2[k] = static_cast<float>(sum[k] / n);
}

void Lockstep::deliver_cues(TimeNs now_ns) {
  while (!pending_.empty() && pending_.front().exposed_at_ns + options_.camera_latency_ns <= now_ns) {
    const Cue& cue = pending_.front();
    input_.cues.cues[cue.behaviour] = cue;
    input_.cues.present[cue.behaviour] = true;
    log_.cues.push_back(cue);
    pending_.pop_front();
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
  input_.pressure_hpa = pressure_.take();
  accel_sum_ = {};
  accel_count_ = 0;
  control::ControlOutput output = control::control_step(options_.control, input_, state_);
  output.command.due_at_ns = output.command.released_at_ns = output.command.computed_at_ns = now_ns;
  if (output.command.sent != 0) output.command.written_at_ns = now_ns;
  send(output, now_ns);
  log_.samples.push_back({now_ns, simulator_.truth(), output.command});
}

void Lockstep::send(const control::ControlOutput& output, TimeNs now_ns) {
  std::array<std::uint8_t, mavlink::kMaxFrame> out;
  const auto give = [&](std::size_t n) { simulator_.from_companion(std::span<const std::uint8_t>(out.data(), n)); };
  const Command& c = output.command;
  const drivers::FlavourFacts& facts = drivers::facts_of(options_.sim.flavour);
  const bool by_rate = input_.autopilot.semantics.heading_rate_used;
  if (c.sent != 0) give(link_.encode_attitude_target({c.q_ned_body, by_rate, c.yaw_rate_radps, c.thrust}, now_ns, out));
  if (c.sent == 0) streaming_since_ns_ = kNever;
  if (c.sent != 0 && streaming_since_ns_ == kNever) streaming_since_ns_ = now_ns;
  const bool streamed = streaming_since_ns_ != kNever && now_ns - streaming_since_ns_ >= facts.stream_first_ns;
  const bool ask_mode = (output.ask_follow || (!facts.asks_in_turn && output.ask_arm)) && streamed;
  const bool ask_arm = output.ask_arm && (!facts.asks_in_turn || input_.autopilot.follows);
  if ((!ask_mode && !ask_arm && !output.ask_disarm) || now_ns < request_due_ns_) return;
  if (ask_mode) give(link_.encode_set_mode(facts.own_mode, 0, 0, out));
  if (ask_arm || output.ask_disarm) give(link_.encode_arm(ask_arm, 0, out));
  request_due_ns_ = now_ns + 500 * kMillisecond;
}

}  // namespace wasp::sim
