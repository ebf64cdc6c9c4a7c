#include "tools/top_snapshot.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "rt/clock.h"
#include "shm/broadcast_ring.h"
#include "shm/topics.h"
#include "tools/csv_rows.h"

namespace wasp::tools {
namespace {

constexpr DurationNs kRateWindow = 2 * kSecond;
constexpr std::size_t kShownEvents = 5;

RegionState region_state(const Attachment& attachment) {
  RegionState s;
  s.name = attachment.name();
  const shm::Region* region = attachment.region();
  if (region == nullptr) return s;
  const auto& note = region->header().note;
  s.attached = true;
  s.note.assign(note.begin(), std::find(note.begin(), note.end(), '\0'));
  s.writer_alive = region->writer_alive();
  s.writer_pid = region->header().writer_pid.load();
  s.writer_restarts = region->header().writer_restarts.load();
  return s;
}

std::optional<Command> newest_command(const shm::Region& region) {
  for (const auto& e : region.topics()) {
    if (e.kind != shm::TopicKind::kRing || e.type_view() != "Command") continue;
    Command command;
    if (shm::RingReader(region, e.name_view()).copy_newest(command)) return command;
  }
  return std::nullopt;
}

nlohmann::json command_json(const Command& c) {
  return {{"tick", c.tick},
          {"mode", mode_name(c.mode)},
          {"reason", reason_name(c.reason)},
          {"phase", c.mission_phase},
          {"height_m", c.height_m},
          {"height_setpoint_m", c.height_setpoint_m},
          {"thrust", c.thrust},
          {"climb_rate_mps", c.climb_rate_mps},
          {"cue_source", c.cue_source},
          {"sent", c.sent != 0}};
}

}  // namespace

TopicState topic_state(const shm::Region& region, const shm::TopicEntry& entry, TimeNs now_ns) {
  TopicState s{region.name(), std::string(entry.name_view()), std::string(entry.type_view()), entry.slots, 0, 0, {}};
  const shm::RingReader reader(region, entry.name_view());
  s.published = reader.newest();
  TimeNs newest_ns = 0, oldest_ns = 0;
  std::uint64_t seen = 0;
  for (std::uint64_t back = 0; back < std::min<std::uint64_t>(s.published, entry.slots); ++back) {
    const shm::Sample sample = reader.look(s.published - back);
    if (!sample || !reader.intact(sample)) break;
    if (back == 0) {
      newest_ns = sample.published_at_ns;
      s.age_ms = static_cast<double>(now_ns - newest_ns) * 1e-6;
    }
    if (now_ns - sample.published_at_ns > kRateWindow) break;
    oldest_ns = sample.published_at_ns;
    ++seen;
  }
  if (seen >= 2 && newest_ns > oldest_ns) s.rate_hz = static_cast<double>(seen - 1) / to_seconds(newest_ns - oldest_ns);
  return s;
}

TopObserver::TopObserver(std::string instance) : instance_(std::move(instance)) {
  const auto sink = [this](const std::string& region, const std::string& what) {
    events_.push_back(region + ": " + what);
    if (events_.size() > kShownEvents) events_.erase(events_.begin());
  };
  for (auto& name : {shm::flight_region(instance_), shm::camera_region(instance_), shm::truth_region(instance_)})
    attachments_.emplace_back(name, sink);
}

TopSnapshot TopObserver::look() {
  TopSnapshot s;
  s.instance = instance_;
  for (auto& attachment : attachments_) {
    if (attachment.stale()) attachment.detach();
    attachment.try_attach();
    s.regions.push_back(region_state(attachment));
    const shm::Region* region = attachment.region();
    if (region == nullptr) continue;
    for (const auto& entry : region->topics())
      if (entry.kind == shm::TopicKind::kRing) s.topics.push_back(topic_state(*region, entry, rt::now()));
    for (auto& camera : read_cameras(*region)) s.cameras.push_back(std::move(camera));
    if (&attachment != &attachments_.front()) continue;
    s.stages = read_stages(*region);
    s.run = read_run(*region);
    s.command = newest_command(*region);
  }
  s.events = events_;
  return s;
}

nlohmann::json top_json(const TopSnapshot& s) {
  nlohmann::json document = latency_json(s.stages, s.run, false);
  document["instance"] = s.instance;
  document["real_time"] = s.run.present ? nlohmann::json(s.run.real_time) : nlohmann::json(nullptr);
  document["topics"] = document["regions"] = nlohmann::json::array();
  for (const auto& r : s.regions)
    document["regions"].push_back({{"name", r.name},
                                   {"attached", r.attached},
                                   {"writer_alive", r.writer_alive},
                                   {"writer_pid", r.writer_pid},
                                   {"writer_restarts", r.writer_restarts},
                                   {"note", r.note}});
  for (const auto& t : s.topics)
    document["topics"].push_back({{"region", t.region},
                                  {"name", t.name},
                                  {"type", t.type},
                                  {"slots", t.slots},
                                  {"rate_hz", std::round(t.rate_hz * 1000) / 1000},
                                  {"age_ms", t.age_ms ? nlohmann::json(*t.age_ms) : nlohmann::json(nullptr)},
                                  {"published", t.published}});
  document["cameras"] = nlohmann::json::array();
  for (const auto& camera : s.cameras) document["cameras"].push_back(to_json(camera));
  document["command"] = s.command ? command_json(*s.command) : nlohmann::json(nullptr);
  document["events"] = s.events;
  return document;
}

}  // namespace wasp::tools
