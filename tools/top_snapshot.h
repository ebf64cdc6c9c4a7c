// What wasp-top shows, as plain values: one look at the regions of an instance. Rates come from the publishing times of
// the messages still in each ring, so that one look suffices.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tools/camera_figures.h"
#include "tools/latency_summary.h"
#include "tools/record_attachment.h"
#include "types/messages.h"

namespace wasp::tools {

struct TopicState {
  std::string region, name, type;
  std::uint32_t slots = 0;
  std::uint64_t published = 0;
  double rate_hz = 0;            ///< over the last two seconds; 0 when nothing came
  std::optional<double> age_ms;  ///< of the newest message; absent before the first
};

struct RegionState {
  std::string name, note;
  bool attached = false, writer_alive = false;
  int writer_pid = 0;
  std::uint32_t writer_restarts = 0;
};

struct TopSnapshot {
  std::string instance;
  std::vector<RegionState> regions;
  std::vector<TopicState> topics;
  std::vector<StageSummary> stages;
  RunSummary run;
  std::vector<CameraFigures> cameras;  ///< real ones
  std::optional<Command> command;      ///< newest
  std::vector<std::string> events;     ///< newest last
};

/// Follows the three regions of an instance; each may come and go between looks.
class TopObserver {
 public:
  explicit TopObserver(std::string instance);
  TopSnapshot look();

 private:
  std::string instance_;
  std::vector<std::string> events_;
  std::vector<Attachment> attachments_;
};

/// Rate and age of one ring as of `now_ns`.
TopicState topic_state(const shm::Region& region, const shm::TopicEntry& entry, TimeNs now_ns);

nlohmann::json top_json(const TopSnapshot& snapshot);

}  // namespace wasp::tools
