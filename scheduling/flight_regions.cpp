#include "scheduling/flight_regions.h"

#include <algorithm>
#include <cstring>
#include <new>
#include <stdexcept>

#include "rt/clock.h"
#include "scheduling/flow_ring.h"
#include "shm/broadcast_ring.h"
#include "shm/topics.h"
#include "types/messages.h"
#include "types/position_sample.h"

namespace wasp::scheduling {
namespace {

using shm::TopicKind;

std::byte* block(const shm::Region& region, const char* topic, const char* type) {
  return region.at(region.topic(topic, type).offset);
}

}  // namespace

shm::Region create_flight_region(const std::string& instance, const BehaviourRings& behaviours, bool real_time,
                                 bool keep_history) {
  std::vector<shm::TopicSpec> specs{
      {shm::kImu, "Imu", TopicKind::kRing, shm::kImuSlots, sizeof(ImuSample)},
      {shm::kAttitude, "Attitude", TopicKind::kRing, shm::kAttitudeSlots, sizeof(AttitudeSample)},
      {shm::kPosition, "Position", TopicKind::kRing, shm::kPositionSlots, sizeof(PositionSample)},
      {shm::kCommand, "Command", TopicKind::kRing, shm::kCommandSlots, sizeof(Command)},
      {shm::kStages, "StageTable", TopicKind::kBlock, 1, sizeof(StageTable)},
      {"run", "RunStatus", TopicKind::kBlock, 1, sizeof(RunStatus)},
  };
  const auto silent = [&](const std::string& name) { return std::ranges::count(behaviours.silent, name) > 0; };
  for (const auto& topic : behaviours.flows)
    specs.push_back({topic, "Flow", TopicKind::kRing, shm::kFlowSlots, sizeof(FlowSlot)});
  for (const auto& name : behaviours.names)
    if (!silent(name)) specs.push_back({shm::cue_topic(name), "Cue", TopicKind::kRing, shm::kCueSlots, sizeof(Cue)});
  shm::Region region =
      shm::Region::create(shm::flight_region(instance), specs, real_time ? "real time" : "NOT REAL TIME");
  if (keep_history) {  // the flight goes on: what was counted stays
    run_status(region).finished = run_status(region).mission_result = 0;
    return region;
  }
  new (block(region, shm::kStages, "StageTable")) StageTable;
  auto* status = new (block(region, "run", "RunStatus")) RunStatus;
  status->real_time = real_time ? 1 : 0;
  const auto& names = behaviours.names;
  for (std::size_t i = 0; i < names.size() && i < status->behaviours.size(); ++i) {
    std::copy_n(names[i].begin(), std::min<std::size_t>(names[i].size(), 31), status->behaviours[i].begin());
    status->behaviour_state[i] =
        static_cast<std::uint32_t>(silent(names[i]) ? BehaviourState::kOff : BehaviourState::kPunctual);
  }
  status->behaviour_count = static_cast<std::uint32_t>(names.size());
  return region;
}

StageTable& stage_table(const shm::Region& flight) {
  return *std::launder(reinterpret_cast<StageTable*>(block(flight, shm::kStages, "StageTable")));
}

RunStatus& run_status(const shm::Region& flight) {
  return *std::launder(reinterpret_cast<RunStatus*>(block(flight, "run", "RunStatus")));
}

shm::Region attach_camera(const std::string& instance, double patience_s, const std::function<bool()>& cancelled) {
  const TimeNs deadline = rt::now() + from_seconds(patience_s);
  for (;;) {
    try {
      return shm::Region::attach_with_bells(shm::camera_region(instance));
    } catch (const std::exception& e) {
      if (cancelled() || rt::now() >= deadline) throw std::runtime_error(std::string("no camera: ") + e.what());
    }
    rt::sleep_until(rt::now() + 20 * kMillisecond);
  }
}

void check_frame_size(const shm::Region& camera, const char* topic, const Intrinsics& promised, const char* section) {
  const shm::RingReader ring(camera, topic, "Frame");
  const shm::Sample newest = ring.look(ring.newest());
  if (!newest) return;
  FrameHeader header;
  std::memcpy(&header, newest.data, sizeof header);
  if (!ring.intact(newest)) return;
  const auto size = [](auto width, auto height) { return std::to_string(width) + " x " + std::to_string(height); };
  if (static_cast<int>(header.width_px) == promised.width_px &&
      static_cast<int>(header.height_px) == promised.height_px)
    return;
  throw std::runtime_error(std::string("the camera's '") + topic + "' is " + size(header.width_px, header.height_px) +
                           " pixels, but [" + section + "] says " + size(promised.width_px, promised.height_px));
}

}  // namespace wasp::scheduling
