// A recording: three regions that come and go, the followers of their topics, and the files. One poll every few
// milliseconds reads everything new; nothing is ever written to the regions.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tools/camera_figures.h"
#include "tools/latency_summary.h"
#include "tools/record_attachment.h"
#include "tools/record_frames.h"
#include "tools/record_topic.h"

namespace wasp::tools {

struct RecordOptions {
  std::string instance;
  std::filesystem::path directory;
  bool frames = false;
  bool overwrite = false;
  std::filesystem::path camera_toml;  ///< empty: a file is made from the first frame
  DurationNs poll_period_ns = 2 * kMillisecond;
};

class RecordSession {
 public:
  /// Makes the folders and files. Throws std::runtime_error if one cannot be made or a recording is already there.
  explicit RecordSession(RecordOptions options);
  ~RecordSession();

  /// Records until `stop` is set or the flight has finished and everything is read. Returns why it ended.
  std::string run(const std::atomic<bool>& stop);
  /// One look at everything; true if frames are left waiting in their rings.
  bool poll();
  /// Reads what is left, waits for the image writers and writes stages.json and record.json.
  void finish(const std::string& reason);

  [[nodiscard]] const std::map<std::string, TopicCount>& counts() const { return counts_; }
  /// Lines that the disk refused.
  [[nodiscard]] std::uint64_t refused_lines() const;

 private:
  struct Event {
    TimeNs at_ns;
    std::string region, what;
  };
  struct Tables;
  /// A region and the followers of its topics while it is attached.
  struct Source {
    Attachment attachment;
    std::vector<std::function<bool()>> drains;  ///< each true if something is left waiting
    bool from_earlier_flight = false;
  };

  void attach(Source& source);
  void follow(Source& source, TopicCount& count, Start start);
  [[nodiscard]] bool keeps(const TopicCount& count) const;
  void follow_frames(Source& source, TopicCount& count, Start start);
  bool drain(Source& source);
  void let_go(Source& source);
  void take_snapshot(const Source& source);
  void look_at_cameras();
  void note(const std::string& region, const std::string& what);
  void flush();
  void open_recording();
  void reserve_account() const;
  void write_camera_toml() const;
  void write_stages() const;
  void write_account(const std::string& reason) const;
  void watch_for_end(const Source& source);
  [[nodiscard]] std::filesystem::path log(const char* file) const { return options_.directory / "log" / file; }

  RecordOptions options_;
  TimeNs started_at_ns_ = 0, flushed_at_ns_ = 0, snapshot_at_ns_ = 0;
  std::vector<Event> events_;
  std::uint64_t events_dropped_ = 0;
  std::map<std::string, TopicCount> counts_;  ///< by "region/topic"; the references in followers stay good
  std::unique_ptr<Tables> tables_;            ///< DIR/log; also seen as DIR/recording/*.csv when frames are kept
  std::unique_ptr<ImageStream> rgb_, depth_;
  std::unique_ptr<ImagePool> pool_;
  std::optional<FrameSize> frame_size_;
  std::list<Source> sources_;
  std::vector<StageSummary> stages_;
  RunSummary run_;
  std::vector<CameraFigures> cameras_;  ///< real ones
  TimeNs finished_since_ns_ = kNever;
};

}  // namespace wasp::tools
