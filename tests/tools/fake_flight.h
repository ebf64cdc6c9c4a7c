// A flight that never flew: regions of an instance with rings of every type and plausible messages in them.
#pragma once

#include <unistd.h>

#include <cmath>
#include <cstring>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include "rt/clock.h"
#include "scheduling/stage_table.h"
#include "shm/broadcast_ring.h"
#include "shm/region.h"
#include "shm/topics.h"
#include "types/frames.h"
#include "types/messages.h"

namespace wasp::test {

inline std::string unique_instance(const std::string& what) {
  static int count = 0;
  return "test_" + what + "_" + std::to_string(getpid()) + "_" + std::to_string(++count);
}

class FakeFlight {
 public:
  static constexpr std::uint32_t kWidth = 64, kHeight = 48;
  static constexpr std::uint32_t kDepthStride = kWidth * 2 + 16;  ///< padded on purpose

  explicit FakeFlight(std::string name, const std::string& note = "NOT REAL TIME") : instance(std::move(name)) {
    using shm::TopicKind;
    const std::vector<shm::TopicSpec> flight_topics = {
        {shm::kImu, "Imu", TopicKind::kRing, shm::kImuSlots, sizeof(ImuSample)},
        {shm::kAttitude, "Attitude", TopicKind::kRing, shm::kAttitudeSlots, sizeof(AttitudeSample)},
        {shm::kCommand, "Command", TopicKind::kRing, shm::kCommandSlots, sizeof(Command)},
        {shm::cue_topic("ground_altitude"), "Cue", TopicKind::kRing, shm::kCueSlots, sizeof(Cue)},
        {shm::cue_topic("edge_altitude"), "Cue", TopicKind::kRing, shm::kCueSlots, sizeof(Cue)},
        {shm::kStages, "StageTable", TopicKind::kBlock, 1, sizeof(scheduling::StageTable)},
        {"run", "RunStatus", TopicKind::kBlock, 1, sizeof(scheduling::RunStatus)}};
    const std::uint64_t frame_bytes = kFramePixelOffset + kHeight * kDepthStride;
    const std::vector<shm::TopicSpec> camera_topics = {
        {shm::kGray, "Frame", TopicKind::kRing, shm::kFrameSlots, frame_bytes},
        {shm::kDepth, "Frame", TopicKind::kRing, shm::kFrameSlots, frame_bytes}};
    const std::vector<shm::TopicSpec> truth_topics = {
        {shm::kTruth, "Truth", TopicKind::kRing, shm::kTruthSlots, sizeof(Truth)}};
    flight = std::make_unique<shm::Region>(shm::Region::create(shm::flight_region(instance), flight_topics, note));
    camera = std::make_unique<shm::Region>(shm::Region::create(shm::camera_region(instance), camera_topics));
    truth_region = std::make_unique<shm::Region>(shm::Region::create(shm::truth_region(instance), truth_topics));
    imu = std::make_unique<shm::RingWriter>(*flight, shm::kImu);
    attitude = std::make_unique<shm::RingWriter>(*flight, shm::kAttitude);
    command = std::make_unique<shm::RingWriter>(*flight, shm::kCommand);
    ground = std::make_unique<shm::RingWriter>(*flight, "cue.ground_altitude");
    edge = std::make_unique<shm::RingWriter>(*flight, "cue.edge_altitude");
    gray = std::make_unique<shm::RingWriter>(*camera, shm::kGray);
    depth = std::make_unique<shm::RingWriter>(*camera, shm::kDepth);
    truth = std::make_unique<shm::RingWriter>(*truth_region, shm::kTruth);
    stages = new (flight->at(flight->topic(shm::kStages).offset)) scheduling::StageTable;
    run = new (flight->at(flight->topic("run").offset)) scheduling::RunStatus;
    name_behaviour(0, "ground_altitude");
    name_behaviour(1, "edge_altitude");
    run->behaviour_count = 2;
  }
  ~FakeFlight() {
    for (const auto& name : {shm::flight_region(instance), shm::camera_region(instance), shm::truth_region(instance)})
      shm::Region::remove(name);
  }
  FakeFlight(const FakeFlight&) = delete;
  FakeFlight& operator=(const FakeFlight&) = delete;

  /// Setpoint of the imagined mission at t seconds: up to 0.5 m, then 1 m, then down.
  static double setpoint_m(double t) { return t < 2 ? 0.0 : t < 12 ? 0.5 : t < 22 ? 1.0 : 0.0; }
  /// Height that lags the setpoint, with a small wobble.
  static double height_m(double t) {
    double h = 0;
    for (const auto& [start, step] : {std::pair{2.0, 0.5}, {12.0, 0.5}, {22.0, -1.0}})
      if (t > start) h += step * (1 - std::exp(-(t - start) / 0.7) * (1 + (t - start) / 1.4));
    return h + (h > 0.1 ? 0.012 * std::sin(3.1 * t) + 0.008 * std::sin(7.7 * t) : 0.0);
  }

  void write_imu(TimeNs t, std::uint32_t n) const {
    ImuSample s;
    s.exposed_at_ns = t;
    s.sequence = n;
    s.fields = 0x1fff;
    s.accel_body_mps2 = {0.1f * std::sin(0.37f * static_cast<float>(n)), -0.0f, -9.80665f};
    s.gyro_body_radps = {1e-7f / 3.f, -2.f / 7.f, 1e-38f / 7.f};
    s.mag_body_gauss = {0.21f, 0.01f, 0.43f};
    s.pressure_hpa = 1013.25f;
    s.temperature_degc = 31.7f;
    imu->write(s, t);
  }
  void write_attitude(TimeNs t, std::uint32_t n) const {
    AttitudeSample s;
    s.exposed_at_ns = t;
    s.sequence = n;
    s.q_ned_body = tilt(to_seconds(t));
    s.rate_body_radps = {0.01f, -0.02f, 0.003f};
    attitude->write(s, t);
  }
  void write_truth(TimeNs t, double flight_s) const {
    Truth s;
    s.exposed_at_ns = t;
    const auto h = static_cast<float>(height_m(flight_s));
    const auto a = static_cast<float>(flight_s);
    s.position_ned_m = {0.08f * std::sin(0.6f * a) + 0.004f * a, 0.06f * std::cos(0.43f * a), -h};
    s.velocity_ned_mps = {0.05f * std::cos(0.6f * a), 0, 0};
    s.q_ned_body = tilt(flight_s);
    s.height_m = h;
    s.armed = 1;
    truth->write(s, t);
  }
  static Cue make_cue(std::uint32_t behaviour, TimeNs t, std::uint32_t n, double flight_s) {
    Cue c;
    c.exposed_at_ns = t;
    c.released_at_ns = t + 1'200'000;
    c.started_at_ns = t + 1'260'123;
    c.finished_at_ns = t + 5'000'007;
    c.behaviour = behaviour;
    c.frame_sequence = n;
    c.step_index = n;
    c.attitude_valid = 1;
    c.q_ned_body = tilt(flight_s);
    c.rate_body_radps = {1.f / 3.f, -1e-20f, 7e10f};
    c.over_budget = n % 17 == 0;
    c.body.validity = n % 11 == 0 ? Validity::kBlind : Validity::kValid;
    c.body.has_height = 1;
    c.body.quality = 0.93f;
    c.body.height_m = static_cast<float>(height_m(flight_s) + 0.02 * std::sin(1.7 * n + behaviour));
    c.body.height_sigma_m = 0.0123456789f;
    for (std::size_t i = 0; i < 8; ++i) c.body.detail[i] = static_cast<float>(n) / static_cast<float>(i + 3);
    return c;
  }
  static Command make_command(TimeNs t, std::uint64_t tick, double flight_s) {
    Command c;
    c.exposed_at_ns = tick < 3 ? kNever : t - 20'000'000;
    c.due_at_ns = t;
    c.released_at_ns = t + 40'000;
    c.computed_at_ns = t + 90'000;
    c.written_at_ns = t + 210'000;
    c.tick = tick;
    c.q_ned_body = tilt(flight_s + 0.1);
    c.thrust = static_cast<float>(0.48 + 0.05 * std::sin(2 * flight_s));
    c.height_setpoint_m = static_cast<float>(setpoint_m(flight_s));
    c.height_m = static_cast<float>(height_m(flight_s) + 0.01 * std::sin(5 * flight_s));
    c.mode = flight_s < 1 ? FlightMode::kDisarmed : flight_s < 2 ? FlightMode::kHold : FlightMode::kBehaviour;
    c.reason = flight_s < 1 ? ModeReason::kNone : flight_s < 2 ? ModeReason::kStart : ModeReason::kMissionStep;
    c.mission_phase = static_cast<std::uint8_t>(flight_s < 2 ? 0 : flight_s < 12 ? 1 : flight_s < 22 ? 2 : 3);
    c.cue_source = 0;
    c.sent = 1;
    return c;
  }
  static std::uint16_t depth_pixel(std::uint32_t sequence, std::uint32_t u, std::uint32_t v) {
    return static_cast<std::uint16_t>(sequence * 977 + v * 131 + u * 7);
  }
  static std::uint8_t gray_pixel(std::uint32_t sequence, std::uint32_t u, std::uint32_t v) {
    return static_cast<std::uint8_t>(sequence * 13 + v * 5 + u * 3);
  }
  void write_depth(TimeNs t, std::uint32_t sequence) const {
    std::byte* slot = depth->loan();
    write_header(slot, t, sequence, PixelFormat::kDepth16Mm, kDepthStride);
    for (std::uint32_t v = 0; v < kHeight; ++v)
      for (std::uint32_t u = 0; u < kWidth; ++u) {
        const std::uint16_t pixel = depth_pixel(sequence, u, v);
        std::memcpy(slot + kFramePixelOffset + v * kDepthStride + u * 2, &pixel, 2);
      }
    depth->publish(t);
  }
  void write_gray(TimeNs t, std::uint32_t sequence) const {
    std::byte* slot = gray->loan();
    write_header(slot, t, sequence, PixelFormat::kMono8, kWidth);
    for (std::uint32_t v = 0; v < kHeight; ++v)
      for (std::uint32_t u = 0; u < kWidth; ++u)
        slot[kFramePixelOffset + v * kWidth + u] = std::byte{gray_pixel(sequence, u, v)};
    gray->publish(t);
  }
  static std::array<float, 4> tilt(double t) {
    const auto a = static_cast<float>(t);
    const Quat q = quat_from_euler({0.03f * std::sin(1.3f * a), 0.02f * std::cos(0.9f * a), 0.01f * a});
    return {q.w(), q.x(), q.y(), q.z()};
  }

  std::string instance;
  std::unique_ptr<shm::Region> flight, camera, truth_region;
  std::unique_ptr<shm::RingWriter> imu, attitude, command, ground, edge, gray, depth, truth;
  scheduling::StageTable* stages = nullptr;
  scheduling::RunStatus* run = nullptr;

 private:
  void name_behaviour(std::size_t index, std::string_view name) const {
    std::copy(name.begin(), name.end(), run->behaviours[index].begin());
  }
  static void write_header(std::byte* slot, TimeNs t, std::uint32_t sequence, PixelFormat format,
                           std::uint32_t stride) {
    FrameHeader h;
    h.exposed_at_ns = t;
    h.sequence = sequence;
    h.format = format;
    h.width_px = kWidth;
    h.height_px = kHeight;
    h.stride_bytes = stride;
    std::memcpy(slot, &h, sizeof h);
  }
};

}  // namespace wasp::test
