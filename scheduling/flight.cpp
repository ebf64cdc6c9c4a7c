#include "scheduling/flight.h"

#include <signal.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>

#include "drivers/recording.h"
#include "rt/clock.h"
#include "rt/process.h"
#include "rt/thread.h"
#include "scheduling/arming.h"
#include "scheduling/camera_relay.h"
#include "scheduling/computer_status.h"
#include "scheduling/control_faults.h"
#include "scheduling/control_loop.h"
#include "scheduling/event_severity.h"
#include "scheduling/fault_control.h"
#include "scheduling/flight_end.h"
#include "scheduling/flight_options.h"
#include "scheduling/flight_regions.h"
#include "scheduling/guard_page.h"
#include "scheduling/link_loop.h"
#include "scheduling/recorded_motion.h"
#include "scheduling/replay_camera.h"
#include "scheduling/supervisor.h"
#include "shm/bus_guard.h"
#include "shm/topics.h"

namespace wasp::scheduling {
namespace {

constexpr double kBitsPerByte = 10, kSocket_Bps = 20'000;
constexpr DurationNs kSigningSavePeriod = 60 * kSecond;
constexpr double kReplayTail_s = 0.3;  // the last frames' cues reach a command before the replay ends

void log_at(TimeNs at_ns, const char* text) { std::fprintf(stderr, "%10.3f  %s\n", to_seconds(at_ns), text); }
void log(const std::string& text) { log_at(rt::now(), text.c_str()); }

/// Blocks the signals that end a flight, for every thread made from here on; the main thread takes them in turn.
sigset_t block_signals() {
  sigset_t set;
  sigemptyset(&set);
  for (const int s : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&set, s);
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  signal(SIGPIPE, SIG_IGN);
  signal(SIGXFSZ, SIG_IGN);  // a full quota for files is an error of write, not the end
  return set;
}

BehaviourRings rings_of(const BehaviourTable& table, const Config& config) {
  BehaviourRings rings{names_of(table), {}, flow_topics(table, config)};
  for (const auto& row : config.behaviours)
    if (!row.enabled) rings.silent.push_back(row.name);
  return rings;
}

/// Takes a region's files away again unless told that its readers still need them.
struct RegionFiles {
  std::string name;
  bool keep = false;
  ~RegionFiles() {
    if (!keep && !name.empty()) shm::Region::remove(name);
  }
};

/// What the thread of an enabled behaviour runs.
struct ThreadBody {
  std::size_t behaviour = 0;  ///< Cue::behaviour
  std::function<void(LoopControl&)> run;
};

std::optional<GuardPage> adopt_guard(const FlightOptions& options) {
  return options.guarded ? std::optional(GuardPage::adopt(kPageDescriptor)) : std::nullopt;
}

/// The serial line: the guardian's, or opened here.
drivers::LinePort open_line(const FlightOptions& options, const Config& config) {
  const auto endpoint = drivers::Endpoint::parse(config.autopilot.endpoint);
  return options.guarded ? drivers::LinePort(endpoint, {kLineDescriptor, kLineSocketDescriptor})
                         : drivers::LinePort(endpoint);
}

/// Everything one flight owns, in order of construction; destroyed in reverse, threads first.
class Flight {
 public:
  Flight(const BehaviourTable& table, const FlightOptions& options, Config config)
      : table_(table),
        options_(options),
        config_(std::move(config)),
        real_time_(!options.no_rt),
        guard_(adopt_guard(options)),
        flight_(create_flight_region(options.instance, rings_of(table, config_), real_time_, incarnation() > 0)),
        flight_files_{flight_.name()},
        stages_(stage_table(flight_)),
        port_(open_line(options, config_)),
        signing_(drivers::open_signing(config_.autopilot.signing, drivers::LinkSigning::kFlightLink)),
        autopilot_(config_.autopilot.identity()) {
    if (signing_) sign_line();
    control_.status = &run_status(flight_);
    control_.status->preempt_rt = rt::kernel_is_preempt_rt() ? 1 : 0;
    control_.status->incarnation = incarnation();
    control_.strict_syscalls = config_.strict_syscalls;
    config_.control.mission.never_command = incarnation() > 0;
    frame_period_ns_ = from_seconds(1.0 / config_.camera_rate_hz);
  }

  ~Flight() { control_.stop = true; }  // threads that stand already end before they are joined
  Flight(const Flight&) = delete;
  Flight& operator=(const Flight&) = delete;

  int run(const sigset_t& signals) {
    open_camera();
    arm_faults();
    wire();
    const bool camera_thread = replay_ || relay_ || is_device(config_.camera_driver);
    admit(make_plan(config_, frame_period_ns_, camera_thread, measured_costs()), config_.admission, real_time_, log);
    latency_hold_ = prepare_real_time(config_, real_time_, log);
    start_threads();
    control_.realtime_started = true;
    control_.marks.reach(Milestone::kStart, rt::now());
    if (faults_) faults_->start(control_.marks);
    flight_files_.keep = camera_files_.keep = true;  // the recorder drains them; the launcher removes them
    log(real_time_ ? "armed for real time" : "running, NOT REAL TIME");
    if (incarnation() > 0) log("started again by the guardian: watching, never commanding");
    supervise(signals);
    control_.status->finished = 1;
    return conclude_flight({*control_.status, control_.overrun_stop, recording_problems_ > 0, replay_.get()}, log);
  }

 private:
  /// Flying processes before this one on the same line.
  [[nodiscard]] std::uint32_t incarnation() const { return guard_ ? guard_->block().incarnation.load() : 0; }

  /// A flight that was started again goes on from the time the one before it had reached.
  void sign_line() {
    if (guard_) signing_->clock().advance_to(guard_->block().signing_time.load());
    autopilot_.use_signing(*signing_);
    save_signing_time();
    log(config_.autopilot.signing.mode == "require" ? "the autopilot's line is signed, unsigned frames are refused"
                                                    : "what goes to the autopilot is signed");
  }
  void save_signing_time() {
    signing_saved_at_ns_ = rt::now();
    if (!signing_->save()) log("cannot store the signing time in " + signing_->time_file());
  }
  /// Now and then, from the supervising thread.
  void keep_signing_time() {
    if (guard_) guard_->block().signing_time.store(signing_->clock().now());
    if (rt::now() - signing_saved_at_ns_ >= kSigningSavePeriod) save_signing_time();
  }
  void end_signing() {
    save_signing_time();
    const mavlink::SignatureCounts& n = signing_->check().counts();
    if (n.refused() > 0)
      log("frames refused: " + std::to_string(n.unsigned_refused) + " unsigned, " + std::to_string(n.wrong) +
          " wrongly signed, " + std::to_string(n.old) + " replayed, " + std::to_string(n.too_late) + " too late, " +
          std::to_string(n.no_room) + " of too many streams");
  }

  void open_camera() {
    if (options_.replay.empty()) {
      if (config_.camera_driver == "replay")
        throw std::runtime_error("[camera] driver = \"replay\" needs --replay DIR");
      camera_ = std::make_unique<shm::Region>(attach_camera(options_.instance, 30.0, [] { return false; }));
      check_camera();
      return;
    }
    auto recording = drivers::Recording::open(options_.replay);
    for (const auto& problem : recording.problems()) log("recording: " + problem);
    recording_problems_ = recording.problem_counts().total();
    config_.camera = recording.geometry();
    frame_period_ns_ = from_seconds(1.0 / recording.nominal_rate_hz());
    scripts_ = load_replay_script(options_.replay);
    if (scripts_.empty()) recorded_motion_ = script_of(recording);
    if (!recorded_motion_.empty()) log("recording: attitude from " + recording.motion().poses.source);
    second_lap_ = ReplayCamera::lap_sequence(recording);
    allow_for_a_slow_recording();
    const double seconds = options_.seconds > 0 ? options_.seconds : to_seconds(ReplayCamera::lap_ns(recording));
    config_.control.mission.follow_recording = true;
    config_.control.mission.recording_seconds = static_cast<float>(seconds + kReplayTail_s);
    const auto topics = ReplayCamera::topics(recording);
    std::vector<std::string> offered;
    for (const auto& topic : topics) offered.push_back(topic.name);
    for (const auto& line : disable_without_stream(table_, offered, config_)) log(line);
    check_streams(table_, config_);
    if (recording.depth_size().width_px == 0) fly_on_grey_images();
    camera_ = std::make_unique<shm::Region>(shm::Region::create(shm::camera_region(options_.instance), topics));
    camera_files_.name = camera_->name();
    replay_ = std::make_unique<ReplayCamera>(std::move(recording), *camera_, from_seconds(seconds), stages_,
                                             add_watch(config_.camera_thread), config_.camera_thread.overrun);
    if (options_.preload && incarnation() == 0) replay_->preload();  // who only watches need not be early
  }

  /// Makes the fault points, if asked for: without an option there is no board, and no point can be thrown.
  void arm_faults() {
    if (options_.faults.empty() && options_.fault_socket.empty()) return;
    FaultSetup setup{options_.faults, options_.fault_socket, {{}, replay_ == nullptr}};
    for (const auto& row : config_.behaviours) setup.scope.behaviours.push_back(row.enabled ? row.name : "");
    setup.timeline_over = incarnation() > 0;
    faults_ = std::make_unique<FaultControl>(setup, log);
    control_.faults = &faults_->board();
    control_.status->faults_armed = 1;
    if (!replay_) insert_relay();
  }

  /// Between the camera and the behaviours, for the faults of the camera.
  void insert_relay() {
    relay_region_ = std::make_unique<shm::Region>(
        shm::Region::create(shm::relay_region(options_.instance), CameraRelay::topics(*camera_)));
    relay_files_.name = relay_region_->name();
    relay_ = std::make_unique<CameraRelay>(*camera_, *relay_region_, stages_, relay_events_,
                                           add_watch(config_.camera_thread));
  }

  /// Refuses a camera that does not offer what an enabled behaviour looks at, or shows it at another size than the
  /// configuration says.
  void check_camera() const {
    for (std::size_t i = 0; i < table_.size(); ++i) {
      const BehaviourRow& row = table_[i];
      if (!config_.behaviours[i].enabled || is_flow(row.stream)) continue;
      if (!camera_->has(ring_of(row.stream)))
        throw std::runtime_error("behaviour '" + row.name + "' is enabled, but the camera offers no '" +
                                 ring_of(row.stream) + "': set [behaviour." + row.name + "] enabled = false");
      check_frame_size(*camera_, ring_of(row.stream),
                       (looks_down(row.stream) ? config_.camera_down.geometry : config_.camera).intrinsics,
                       looks_down(row.stream) ? "camera_down" : "camera");
    }
  }

  ThreadWatch& add_watch(const ThreadRow& row, bool behaviour = false) {
    return board_.add({row.name, rt::nearest_usable_core(row.core), row.priority, row.budget_ns, behaviour});
  }

  MeasuredCosts measured_costs() const {
    return options_.measured.empty() ? MeasuredCosts{} : read_measured_costs(options_.measured);
  }

  /// Age limits are made for cameras of 30 Hz; where a recording's frames are further apart, its cues live until the
  /// frame after next.
  void allow_for_a_slow_recording() {
    const DurationNs two_and_a_half = frame_period_ns_ * 5 / 2;
    for (auto& row : config_.control.arbiter.rows) row.age_limit_ns = std::max(row.age_limit_ns, two_and_a_half);
  }

  /// A recording without depth: behaviours that see grey images may supply the height, in their order in the table.
  void fly_on_grey_images() {
    log("the recording has no depth: height comes from grey images");
    for (std::size_t i = 0; i < table_.size(); ++i) {
      auto& rank = config_.control.arbiter.rows[i].height_rank;
      if (config_.behaviours[i].enabled && table_[i].stream == Stream::kGray && rank < 0) rank = static_cast<int>(i);
    }
  }

  void wire() {
    ControlWiring control{&flight_, &stages_, &report_, &port_, &autopilot_, &control_events_};
    for (std::size_t i = 0; i < table_.size(); ++i)
      control.behaviour_watches.push_back(config_.behaviours[i].enabled ? wire_behaviour(i) : nullptr);
    telemetry_ = std::make_unique<Telemetry>(config_, flight_, autopilot_);
    drivers::SetupWish wish = config_.autopilot.wish(config_.control.limits.max_tilt_rad);
    wish.position_hz = std::max(wish.position_hz, config_.telemetry.position_hz);
    link_ = std::make_unique<LinkLoop>(flight_, port_, autopilot_, stages_, report_, link_events_,
                                       add_watch(config_.link_thread), wish, link_services());
    link_->correct(config_.imu);
    control.watch = &add_watch(config_.control_thread);
    control.guard = guard_ ? &guard_->block() : nullptr;
    if (faults_) control.hook = control_fault_hook(control_);
    control_loop_ = std::make_unique<ControlLoop>(config_, control);
    supervisor_ = std::make_unique<Supervisor>(board_, *control_.status, supervisor_options(),
                                               [this](const std::string& text) { log_and_tell(text); });
  }

  LinkServices link_services() {
    const drivers::Endpoint& endpoint = port_.endpoint();
    const bool serial = endpoint.kind == drivers::EndpointKind::kSerial;
    LinkServices services;
    services.telemetry = telemetry_.get();
    services.gate.bytes_per_s = serial ? endpoint.baud / kBitsPerByte : 0;
    services.gate.budget_Bps = config_.telemetry.budget_Bps;
    if (services.gate.budget_Bps <= 0) services.gate.budget_Bps = serial ? services.gate.bytes_per_s / 4 : kSocket_Bps;
    services.control_period_ns = config_.control_period_ns;
    if (config_.telemetry.position_hz > 0)
      services.position_period_ns = from_seconds(1 / config_.telemetry.position_hz);
    return services;
  }

  /// What the supervisor finds is a fault: the ground station hears of it.
  void log_and_tell(const std::string& text) {
    log(text);
    telemetry_->inbox().tell(mavlink::mav_severity::kWarning, text);
  }

  /// Builds the adaptor of an enabled behaviour.
  const ThreadWatch* wire_behaviour(std::size_t i) {
    const BehaviourRow& row = table_[i];
    BehaviourWiring w;
    w.camera = relay_ ? relay_region_.get() : camera_.get();
    w.flight = &flight_;
    w.index = static_cast<std::uint32_t>(i);
    w.budget_ns = config_.behaviours[i].budget_ns;
    w.frames_in_order = config_.behaviours[i].frames_in_order;
    w.rules = rules_of(i);
    w.stages = &stages_;
    w.watch = &add_watch(config_.behaviours[i], true);
    if (replay_) {
      w.vehicle_from_link = false;
      w.frames_done = replay_->add_reader(
          shm::RingReader(is_flow(row.stream) ? flight_ : *camera_, ring_of(row.stream), type_of(row.stream)));
      if (const auto script = scripts_.find(row.name); script != scripts_.end()) {
        w.script = &script->second;
        w.script_ends_at = second_lap_;
      } else if (!recorded_motion_.empty()) {
        w.script = &recorded_motion_;
        w.script_ends_at = second_lap_;
      }
    }
    const CameraGeometry& camera = looks_down(row.stream) ? config_.camera_down.geometry : config_.camera;
    bodies_.push_back({i, row.make(camera, config_.behaviour_params[i], w)});
    return w.watch;
  }

  /// What a live camera promised. A replay is given as it was recorded.
  FrameRules rules_of(std::size_t i) const {
    if (replay_) return {};
    const bool down = looks_down(table_[i].stream);
    const Intrinsics& size = (down ? config_.camera_down.geometry : config_.camera).intrinsics;
    return {.live = true,
            .width_px = static_cast<std::uint32_t>(size.width_px),
            .height_px = static_cast<std::uint32_t>(size.height_px),
            .age_limit_ns = config_.control.arbiter.rows[i].age_limit_ns,
            .stuck_frames = config_.stuck_frames};
  }

  SupervisorOptions supervisor_options() const {
    return {options_.instance,      real_time_,     config_.demote_after, config_.incidents, config_.incident_dir,
            config_.trace_switches, config_.tracefs};
  }

  rt::ThreadSpec spec(const ThreadRow& row) const {
    rt::ThreadSpec s;
    s.name = row.name;
    s.policy = real_time_ ? rt::Policy::kFifo : rt::Policy::kOther;
    s.priority = row.priority;
    s.core = rt::nearest_usable_core(row.core);
    return s;
  }

  void start_threads() {
    for (const auto& body : bodies_)
      threads_.emplace_back(spec(config_.behaviours[body.behaviour]), [this, &body] { body.run(control_); });
    threads_.emplace_back(spec(config_.link_thread), [this] { link_->run(control_); });
    if (relay_) threads_.emplace_back(spec(config_.camera_thread), [this] { relay_->run(control_); });
    if (replay_) {
      threads_.emplace_back(spec(config_.camera_thread), [this] { replay_->run(control_); });
      rt::ThreadSpec decoder;
      decoder.name = "decoder";
      threads_.emplace_back(decoder, [this] { replay_->decode(control_); });
    }
    threads_.emplace_back(spec(config_.control_thread), [this] { control_loop_->run(control_); });
  }

  void drain_events() {
    Event e;
    for (EventQueue* queue : {&control_events_, &link_events_, &relay_events_})
      while (queue->take(e)) {
        log_at(e.at_ns, e.text.data());  // when it was said, not when it is printed
        if (const auto severity = severity_of(e.text.data())) telemetry_->inbox().tell(*severity, e.text.data());
      }
  }

  void supervise(const sigset_t& signals) {
    while (!control_loop_->mission_over()) {
      const timespec patience = rt::to_timespec(Supervisor::kPeriod);
      if (sigtimedwait(&signals, nullptr, &patience) > 0) {
        if (control_.stop_requested.exchange(true)) break;  // the second signal: stop at once
        log("stop requested: landing in order");
      }
      drain_events();
      supervisor_->look();
      look_at_computer();
      if (signing_) keep_signing_time();
    }
    control_.stop = true;
    if (faults_) faults_->stop();
    threads_.clear();
    supervisor_->look();
    drain_events();
    if (signing_) end_signing();
    if (const std::uint64_t lost = control_events_.dropped() + link_events_.dropped() + relay_events_.dropped();
        lost > 0)
      log(std::to_string(lost) + " events were lost: their queue was full");
  }

  void look_at_computer() {
    const TimeNs now_ns = rt::now();
    if (now_ns - computer_at_ns_ < kSecond) return;
    computer_at_ns_ = now_ns;
    telemetry_->inbox().computer.store(computer_.look(now_ns));
  }

  const BehaviourTable& table_;
  FlightOptions options_;
  Config config_;
  bool real_time_;
  std::optional<GuardPage> guard_;  ///< of a guarded flight
  shm::Region flight_;
  RegionFiles flight_files_, camera_files_, relay_files_;  // a flight that never began leaves nothing behind
  StageTable& stages_;
  WatchBoard board_;
  DurationNs frame_period_ns_ = 0;
  drivers::LinePort port_;
  std::unique_ptr<drivers::LinkSigning> signing_;  ///< of a signed line
  TimeNs signing_saved_at_ns_ = 0;
  drivers::AutopilotLink autopilot_;
  std::unique_ptr<shm::Region> camera_;
  std::map<std::string, BehaviourScript> scripts_;
  BehaviourScript recorded_motion_;  ///< for every behaviour, where the recording is not one of ours
  std::uint32_t second_lap_ = 0;
  std::size_t recording_problems_ = 0;
  std::unique_ptr<ReplayCamera> replay_;
  std::unique_ptr<rt::CpuLatencyHold> latency_hold_;
  rt::Seqlock<LinkReport> report_;
  EventQueue control_events_, link_events_, relay_events_;
  LoopControl control_;
  std::unique_ptr<Telemetry> telemetry_;
  ComputerWatch computer_;
  TimeNs computer_at_ns_ = 0;
  std::unique_ptr<LinkLoop> link_;
  std::unique_ptr<ControlLoop> control_loop_;
  std::unique_ptr<Supervisor> supervisor_;
  std::unique_ptr<FaultControl> faults_;  ///< null: no fault points exist
  std::unique_ptr<shm::Region> relay_region_;
  std::unique_ptr<CameraRelay> relay_;  ///< null: the behaviours read the camera's own frames
  std::vector<ThreadBody> bodies_;
  std::vector<rt::Thread> threads_;  // joined first
};

/// Prints what is missing, one line a right.
int check_rights(int priority) {
  const auto missing = rt::missing_rights(priority);
  for (const auto& m : missing)
    std::printf("missing right: %s; grant it with: %s\n", m.right.c_str(), m.remedy.c_str());
  return missing.empty() ? 0 : 3;
}

}  // namespace

int flight_main(const BehaviourTable& behaviours, int argc, char** argv) {
  FlightOptions options;
  if (const auto code = parse_flight_options(argc, argv, options)) return *code;
  if (options.check_rights) {
    const Config defaults;
    return check_rights(defaults.control_thread.priority);
  }
  const sigset_t signals = block_signals();
  shm::install_bus_guard();
  try {
    Config config = load_config(options.configs, names_of(behaviours));
    if (options.replay.empty()) check_streams(behaviours, config);
    if (options.guarded) {
      if (!options.no_rt) rt::lock_memory(static_cast<std::size_t>(config.heap_mib) << 20);  // judged when it arms
      if (!wait_for_go()) return 0;
    }
    Flight flight(behaviours, options, std::move(config));
    return flight.run(signals);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "wasp flight: %s\n", e.what());
    return 1;
  }
}

}  // namespace wasp::scheduling
