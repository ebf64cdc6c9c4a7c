// A behaviour that makes flow fields and one that reads them, live and in a replay: the replay gives the same cues to
// the bit although the reader is slower than the camera, because the camera waits for readers of flow too.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <thread>

#include "drivers/image_file.h"
#include "scheduling/behaviour_loop.h"
#include "scheduling/flight_regions.h"
#include "scheduling/replay_camera.h"

namespace wasp::scheduling {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth = 32, kHeight = 16, kFrames = 40;
constexpr DurationNs kPeriod = 20 * kMillisecond;  // of the recording: apart enough not to pair a frame's neighbours

std::atomic<DurationNs> reader_takes_ns{0};

/// A made-up field: how the mean of each quarter changes, with depth where there is some and the attitude it was given.
struct Field {
  static constexpr std::string_view kName = "field";
  static constexpr DurationNs kBudgetNs = kSecond;
  static constexpr Stream kStream = Stream::kGrayDepth;
  static constexpr Stream kPublishes = Stream::kFlow;
  struct Params {
    CameraGeometry camera;
  };
  struct State {
    explicit State(const Params& p) : last(static_cast<std::size_t>(p.camera.intrinsics.width_px)) {}
    std::vector<float> last;
    FlowMessage message;
    int steps = 0;
  };
  static CueBody step(const Params&, const BehaviourInput& in, State& s) noexcept {
    FlowMessage& m = s.message;
    m.first_exposed_at_ns = m.exposed_at_ns;
    m.exposed_at_ns = in.exposed_at_ns;
    m.frame_sequence = in.frame_sequence;
    m.q_ned_body = in.attitude.q_ned_body;
    m.seen.columns = 4;
    m.seen.rows = 1;
    for (int i = 0; i < 4; ++i) {
      const float now = std::sqrt(static_cast<float>(in.gray.row(i)[8 * i]) + 0.1f);
      m.seen.at(i, 0).u_px = now - s.last[static_cast<std::size_t>(i)];
      s.last[static_cast<std::size_t>(i)] = now;
      m.depth_m[static_cast<std::size_t>(i)] =
          in.depth.valid() ? static_cast<float>(in.depth.row(i)[8 * i]) * 1e-3f : 0.f;
    }
    m.still = m.seen;
    ++s.steps;
    CueBody body;
    body.validity = Validity::kValid;
    body.detail[0] = in.depth.valid() ? m.depth_m[0] : -1.f;
    return body;
  }
  static const FlowMessage* flow(const State& s) noexcept { return s.steps > 1 ? &s.message : nullptr; }
};
static_assert(FlowSource<Field>);

/// Remembers everything it was ever given: a step missed, doubled or changed shows in every later cue.
struct Reader {
  static constexpr std::string_view kName = "reader";
  static constexpr DurationNs kBudgetNs = kSecond;
  static constexpr Stream kStream = Stream::kFlow;
  struct Params {
    CameraGeometry camera;
  };
  struct State {
    float memory = 0;
  };
  static CueBody step(const Params&, const BehaviourInput& in, State& s) noexcept {
    const FlowMessage& m = *in.flow;
    s.memory = 0.9f * s.memory + m.seen.at(1, 0).u_px + m.depth_m[2] + m.interval_s() + m.q_ned_body[1];
    CueBody body;
    body.validity = Validity::kValid;
    body.has_heading_rate = 1;
    body.heading_rate_radps = s.memory;
    body.detail[0] = in.attitude_valid ? in.attitude.q_ned_body[2] : -1.f;
    body.detail[1] = in.accel_valid ? in.accel_body_mps2[2] : -1.f;
    for (const TimeNs until = rt::now() + reader_takes_ns.load(); rt::now() < until;) {
    }
    return body;
  }
};

std::uint8_t gray_value(int frame) { return static_cast<std::uint8_t>(frame * 37 + frame * frame); }
bool has_depth(int frame) { return frame % 7 != 3; }

struct Steps {
  std::map<std::uint32_t, Cue> field, reader;  // by frame
  std::uint64_t frames_lost = 0, held_back = 0;
};

/// One process' worth of regions, adaptors and threads.
class Bench {
 public:
  explicit Bench(const std::vector<shm::TopicSpec>& camera_topics)
      : instance_("test-flow-" + std::to_string(getpid()) + "-" + std::to_string(count_++)),
        camera(shm::Region::create(shm::camera_region(instance_), camera_topics)),
        flight(create_flight_region(instance_, {.names = {"field", "reader"}, .flows = {shm::kFlow}}, false)),
        field_cues_(flight, shm::cue_topic("field"), "Cue"),
        reader_cues_(flight, shm::cue_topic("reader"), "Cue") {
    control.status = &run_status(flight);
    control.flying = true;
  }
  ~Bench() {
    control.stop = true;
    threads.clear();
    shm::Region::remove(shm::camera_region(instance_));
    shm::Region::remove(shm::flight_region(instance_));
  }
  Bench(const Bench&) = delete;
  Bench& operator=(const Bench&) = delete;

  BehaviourWiring wiring(const char* name) {
    BehaviourWiring w;
    w.camera = &camera;
    w.flight = &flight;
    w.budget_ns = kSecond;
    w.stages = &stage_table(flight);
    w.watch = &board.add({name, -1, 0, kSecond});
    return w;
  }
  template <class B>
  void start(const BehaviourWiring& w) {
    typename B::Params params;
    params.camera.intrinsics.width_px = kWidth;
    auto loop = std::make_shared<BehaviourLoop<B>>(params, w);
    threads.emplace_back([loop, this] { loop->run(control); });
  }
  void collect(Steps& steps) {
    Cue cue;
    while (field_cues_.read(cue)) steps.field[cue.frame_sequence] = cue;
    while (reader_cues_.read(cue)) steps.reader[cue.frame_sequence] = cue;
  }
  /// Until nothing has come for a second.
  void collect_all(Steps& steps) {
    for (TimeNs last = rt::now(); rt::now() - last < kSecond;) {
      const std::size_t before = steps.field.size() + steps.reader.size();
      collect(steps);
      if (steps.field.size() + steps.reader.size() != before) last = rt::now();
      rt::sleep_until(rt::now() + kMillisecond);
    }
    steps.frames_lost = control.status->frames_lost;
  }

 private:
  static inline int count_ = 0;
  std::string instance_;

 public:
  shm::Region camera, flight;
  LoopControl control;
  WatchBoard board;
  std::vector<std::jthread> threads;

 private:
  shm::RingReader field_cues_, reader_cues_;
};

class FlowReplay : public ::testing::Test {
 protected:
  FlowReplay() : folder_(fs::temp_directory_path() / ("wasp_flow_replay_" + std::to_string(getpid()))) {
    fs::create_directories(folder_ / "rgb");
    fs::create_directories(folder_ / "depth");
    std::ofstream(folder_ / "camera.toml") << "depth_units_per_m = 1000\n";
    std::ofstream rgb(folder_ / "rgb.txt"), depth(folder_ / "depth.txt");
    for (int i = 0; i < kFrames; ++i) {
      const std::string name = "frame-" + std::to_string(i) + ".png", time = std::to_string(to_seconds(i * kPeriod));
      drivers::Image<std::uint8_t> gray{kWidth, kHeight, std::vector<std::uint8_t>(kWidth * kHeight, gray_value(i))};
      drivers::save_png(folder_ / "rgb" / name, gray.view());
      rgb << time << " rgb/" << name << "\n";
      if (!has_depth(i)) continue;
      drivers::Image<std::uint16_t> mm{
          kWidth, kHeight, std::vector<std::uint16_t>(kWidth * kHeight, static_cast<std::uint16_t>(900 + i))};
      drivers::save_png(folder_ / "depth" / name, mm.view());
      depth << time << " depth/" << name << "\n";
    }
  }
  ~FlowReplay() override { fs::remove_all(folder_); }

  template <class T>
  static void show(shm::RingWriter& ring, int frame, TimeNs at_ns, PixelFormat format, T value) {
    std::byte* slot = ring.loan();
    FrameHeader h;
    h.exposed_at_ns = at_ns;
    h.sequence = static_cast<std::uint32_t>(frame);
    h.format = format;
    h.width_px = kWidth;
    h.height_px = kHeight;
    h.stride_bytes = kWidth * sizeof(T);
    std::memcpy(slot, &h, sizeof h);
    std::fill_n(reinterpret_cast<T*>(slot + kFramePixelOffset), kWidth * kHeight, value);
    ring.publish(rt::now());
  }

  /// A camera every 5 ms, a link every 2 ms, a reader that takes 12 ms: it must pass over fields.
  static Steps fly() {
    Bench bench(
        {{shm::kGray, "Frame", shm::TopicKind::kRing, shm::kFrameSlots, kFramePixelOffset + kWidth * kHeight},
         {shm::kDepth, "Frame", shm::TopicKind::kRing, shm::kFrameSlots, kFramePixelOffset + 2 * kWidth * kHeight}});
    shm::RingWriter gray(bench.camera, shm::kGray), depth(bench.camera, shm::kDepth);
    shm::RingWriter attitudes(bench.flight, shm::kAttitude), imu(bench.flight, shm::kImu);
    reader_takes_ns = 12 * kMillisecond;
    bench.start<Field>(bench.wiring("field"));
    bench.start<Reader>(bench.wiring("reader"));
    bench.threads.emplace_back([&](const std::stop_token& stop) {
      for (int i = 0; !stop.stop_requested(); ++i) {
        AttitudeSample a;
        ImuSample m;
        a.exposed_at_ns = m.exposed_at_ns = rt::now();
        a.q_ned_body = {1, 1e-3f * static_cast<float>(i), -2e-3f * static_cast<float>(i), 0};
        a.rate_body_radps = {0.3f, 0.7f, 0};
        m.accel_body_mps2 = {0, 0, -9.f - 0.01f * static_cast<float>(i)};
        attitudes.write(a, rt::now());
        imu.write(m, rt::now());
        rt::sleep_until(rt::now() + 2 * kMillisecond);
      }
    });
    Steps steps;
    for (int i = 0; i < kFrames; ++i) {
      const TimeNs exposed = rt::now();
      if (has_depth(i))
        show<std::uint16_t>(depth, i, exposed, PixelFormat::kDepth16Mm, static_cast<std::uint16_t>(900 + i));
      show<std::uint8_t>(gray, i, exposed, PixelFormat::kMono8, gray_value(i));
      rt::sleep_until(rt::now() + 5 * kMillisecond);
      bench.collect(steps);
    }
    bench.collect_all(steps);
    bench.threads.back().request_stop();
    return steps;
  }

  static BehaviourScript script_of(const std::map<std::uint32_t, Cue>& cues) {
    BehaviourScript script;
    for (const auto& [sequence, c] : cues) {
      ScriptedStep step;
      step.frame_sequence = sequence;
      step.exposed_at_ns = c.exposed_at_ns;
      step.attitude_valid = c.attitude_valid != 0;
      step.attitude.q_ned_body = c.q_ned_body;
      step.attitude.rate_body_radps = c.rate_body_radps;
      step.accel_valid = c.accel_valid != 0;
      step.accel_body_mps2 = c.accel_body_mps2;
      script.push_back(step);
    }
    return script;
  }

  /// The recording again, with a reader that takes 120 ms of each field it steps on. `wait`: the camera waits for it.
  Steps replay(const Steps& live, bool wait) {
    const auto recording = drivers::Recording::open(folder_);
    const std::uint32_t end = ReplayCamera::lap_sequence(recording);
    Bench bench(ReplayCamera::topics(recording));
    ThreadWatch& watch = bench.board.add({"camera", -1, 0, kSecond});
    ReplayCamera replay_camera(recording, bench.camera, ReplayCamera::lap_ns(recording), stage_table(bench.flight),
                               watch, rt::OverrunPolicy::kCatchUp);
    const BehaviourScript field_script = script_of(live.field), reader_script = script_of(live.reader);
    std::atomic<std::uint64_t> unread{0};
    BehaviourWiring field = bench.wiring("field"), reader = bench.wiring("reader");
    field.script = &field_script;
    reader.script = &reader_script;
    field.script_ends_at = reader.script_ends_at = end;
    field.frames_done = replay_camera.add_reader(shm::RingReader(bench.camera, shm::kGray, "Frame"));
    reader.frames_done = wait ? replay_camera.add_reader(shm::RingReader(bench.flight, shm::kFlow, "Flow")) : &unread;
    reader_takes_ns = 120 * kMillisecond;
    bench.start<Field>(field);
    bench.start<Reader>(reader);
    bench.threads.emplace_back([&] { replay_camera.run(bench.control); });
    bench.threads.emplace_back([&] { replay_camera.decode(bench.control); });
    Steps steps;
    while (!replay_camera.finished()) {
      bench.collect(steps);
      rt::sleep_until(rt::now() + kMillisecond);
    }
    bench.collect_all(steps);
    steps.held_back = replay_camera.held_back();
    return steps;
  }

  /// Cue bodies of `live` that did not come back to the bit.
  static int differences(const std::map<std::uint32_t, Cue>& live, const std::map<std::uint32_t, Cue>& again) {
    int n = 0;
    for (const auto& [sequence, cue] : live) {
      const auto it = again.find(sequence);
      if (it == again.end() || std::memcmp(&it->second.body, &cue.body, sizeof cue.body) != 0) ++n;
    }
    return n;
  }

  fs::path folder_;
};

TEST_F(FlowReplay, GivesTheSameCuesToTheBitThoughTheReaderIsSlowerThanTheCamera) {
  Steps live = fly();
  for (int i = 0; i < 5 && live.frames_lost > 0; ++i)
    live = fly();  // a frame torn by a stalled host is in no recording
  ASSERT_GT(live.field.size(), 10u);
  ASSERT_GT(live.reader.size(), 4u);
  int with_depth = 0, without_depth = 0, with_vehicle = 0;
  for (const auto& [sequence, cue] : live.field) {
    EXPECT_EQ(cue.body.detail[0] < 0, !has_depth(static_cast<int>(sequence)));
    ++(cue.body.detail[0] < 0 ? without_depth : with_depth);
  }
  for (const auto& [sequence, cue] : live.reader) {
    EXPECT_TRUE(live.field.contains(sequence)) << sequence;
    if (cue.attitude_valid != 0 && cue.accel_valid != 0) ++with_vehicle;
  }
  EXPECT_GT(with_depth, 0);
  EXPECT_GT(without_depth, 0);
  EXPECT_GT(with_vehicle, 2);

  const Steps again = replay(live, true);
  EXPECT_EQ(again.field.size(), live.field.size());
  EXPECT_EQ(again.reader.size(), live.reader.size());
  EXPECT_EQ(differences(live.field, again.field), 0);
  EXPECT_EQ(differences(live.reader, again.reader), 0);
  EXPECT_EQ(again.frames_lost, 0u);
  EXPECT_GT(again.held_back, 0u);
  // What control sees of the reader's cues is of this flight's time, not of the recording's.
  for (const auto& [sequence, cue] : again.reader)
    EXPECT_GT(cue.exposed_at_ns, live.reader.rbegin()->second.exposed_at_ns);
}

TEST_F(FlowReplay, ACameraThatDoesNotWaitForTheReaderLosesFields) {
  Steps live;  // every frame was stepped on
  for (int i = 0; i < kFrames; ++i) {
    live.field[static_cast<std::uint32_t>(i)].exposed_at_ns = i * kPeriod;
    if (i > 0) live.reader[static_cast<std::uint32_t>(i)].exposed_at_ns = i * kPeriod;
  }
  const Steps again = replay(live, false);
  EXPECT_LT(again.reader.size(), live.reader.size());
  EXPECT_GT(again.frames_lost, 0u);
}

}  // namespace
}  // namespace wasp::scheduling
