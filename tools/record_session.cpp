#include "tools/record_session.h"

#include <algorithm>
#include <array>
#include <exception>
#include <stdexcept>
#include <string_view>

#include "rt/clock.h"
#include "shm/topics.h"

namespace wasp::tools {
namespace {

constexpr DurationNs kFlushPeriod = 200 * kMillisecond;
constexpr DurationNs kSnapshotPeriod = kSecond;
constexpr DurationNs kEndGrace =
    300 * kMillisecond;                           // what the simulator and the camera still publish after the flight
constexpr DurationNs kDrainLimit = 10 * kSecond;  // for frames that wait for the image writers
constexpr std::size_t kMaxEvents = 1000;

template <class T>
std::function<bool()> table_drain(const shm::Region& region, Start start, CsvFile& file, TopicCount& count,
                                  typename TopicFollower<T>::ToRow to_row) {
  auto follower = std::make_shared<TopicFollower<T>>(region, start, file, count, std::move(to_row));
  return [follower] {
    follower->drain();
    return false;
  };
}

template <class T>
std::string plain_row(const T& value, const RingStamp& stamp) {
  return csv_row(value, stamp);
}

std::filesystem::path prepared(const RecordOptions& options) {
  const auto log = options.directory / "log";
  if (!options.overwrite && std::filesystem::exists(log / "imu.csv"))
    throw std::runtime_error("'" + options.directory.string() +
                             "' already holds a recording; name another folder or pass --overwrite");
  std::filesystem::create_directories(log);
  return log;
}

}  // namespace

struct RecordSession::Tables {
  explicit Tables(const std::filesystem::path& directory)
      : imu(directory / "imu.csv", imu_columns()),
        attitude(directory / "attitude.csv", attitude_columns()),
        cues(directory / "cues.csv", cue_columns()),
        commands(directory / "commands.csv", command_columns()),
        truth(directory / "truth.csv", truth_columns()) {}
  std::array<CsvFile*, 5> all() { return {&imu, &attitude, &cues, &commands, &truth}; }
  CsvFile imu, attitude, cues, commands, truth;
};

RecordSession::RecordSession(RecordOptions options)
    : options_(std::move(options)), started_at_ns_(rt::now()), tables_(std::make_unique<Tables>(prepared(options_))) {
  reserve_account();
  if (options_.frames) open_recording();
  const auto sink = [this](const std::string& region, const std::string& what) { note(region, what); };
  for (const auto& name : {shm::flight_region(options_.instance), shm::camera_region(options_.instance),
                           shm::truth_region(options_.instance)})
    sources_.push_back({Attachment(name, sink), {}, false});
  // What is there now without a writer is of an earlier flight: its messages are not of this recording.
  for (auto& source : sources_) {
    attach(source);
    source.from_earlier_flight = source.attachment.left_over();
  }
}

RecordSession::~RecordSession() = default;

void RecordSession::attach(Source& source) {
  if (!source.attachment.try_attach()) return;
  source.drains.clear();
  const bool first_look = source.attachment.generation() == 1 && rt::now() - started_at_ns_ < kSecond;
  const Start start = source.attachment.left_over() && first_look ? Start::kNewest : Start::kHistory;
  const shm::Region& region = *source.attachment.region();
  for (const auto& entry : region.topics()) {
    if (entry.kind != shm::TopicKind::kRing) continue;
    const std::string topic(entry.name_view());
    TopicCount& count = counts_[region.name() + "/" + topic];
    count.region = region.name();
    count.topic = topic;
    count.type = entry.type_view();
    try {
      follow(source, count, start);
    } catch (const std::exception& error) {
      note(region.name(), std::string("not recorded: ") + error.what());
    }
  }
}

void RecordSession::follow(Source& source, TopicCount& count, Start start) {
  const shm::Region& region = *source.attachment.region();
  Tables& t = *tables_;
  auto& drains = source.drains;
  if (count.type == "Imu")
    drains.push_back(table_drain<ImuSample>(region, start, t.imu, count, plain_row<ImuSample>));
  else if (count.type == "Attitude")
    drains.push_back(table_drain<AttitudeSample>(region, start, t.attitude, count, plain_row<AttitudeSample>));
  else if (count.type == "Command")
    drains.push_back(table_drain<Command>(region, start, t.commands, count, plain_row<Command>));
  else if (count.type == "Truth")
    drains.push_back(table_drain<Truth>(region, start, t.truth, count, plain_row<Truth>));
  else if (count.type == "Cue")
    drains.push_back(
        table_drain<Cue>(region, start, t.cues, count,
                         [name = count.topic.substr(count.topic.find('.') + 1)](
                             const Cue& cue, const RingStamp& stamp) { return csv_row(cue, stamp, name); }));
  else if (count.type == "Frame")
    follow_frames(source, count, start);
  else if (count.type != "Flow")
    note(region.name(), "topic '" + count.topic + "' of unknown type '" + count.type + "' is not recorded");
}

/// Every table; frames when asked for, of the front camera: what a replay can show. Flow fields never: a replay makes
/// them anew, to the bit, from the frames. record.json says so of each topic.
bool RecordSession::keeps(const TopicCount& count) const {
  if (count.type == "Frame") return options_.frames && (count.topic == shm::kGray || count.topic == shm::kDepth);
  constexpr std::array<std::string_view, 5> kTableTypes{"Imu", "Attitude", "Command", "Truth", "Cue"};
  return std::ranges::find(kTableTypes, count.type) != kTableTypes.end();
}

void RecordSession::follow_frames(Source& source, TopicCount& count, Start start) {
  if (!keeps(count)) return;
  ImageStream& stream = count.topic == shm::kDepth ? *depth_ : *rgb_;
  auto follower = std::make_shared<FrameFollower>(*source.attachment.region(), start, *pool_, stream, count);
  source.drains.push_back([this, follower] {
    const bool waiting = follower->drain();
    if (!frame_size_ && follower->size()) {
      frame_size_ = follower->size();
      write_camera_toml();
    }
    return waiting;
  });
}

bool RecordSession::drain(Source& source) {
  bool waiting = false;
  for (auto& drain_topic : source.drains) waiting = drain_topic() || waiting;
  return waiting;
}

void RecordSession::take_snapshot(const Source& source) {
  if (source.attachment.region() == nullptr || source.from_earlier_flight) return;
  auto stages = read_stages(*source.attachment.region());
  const RunSummary run = read_run(*source.attachment.region());
  if (!stages.empty()) stages_ = std::move(stages);
  if (run.present) run_ = run;
}

void RecordSession::look_at_cameras() {
  for (const auto& source : sources_)
    if (source.attachment.region() != nullptr && !source.from_earlier_flight)
      if (auto cameras = read_cameras(*source.attachment.region()); !cameras.empty()) cameras_ = std::move(cameras);
}

void RecordSession::let_go(Source& source) {
  for (const TimeNs limit = rt::now() + kDrainLimit; drain(source) && rt::now() < limit;)
    rt::sleep_until(rt::now() + options_.poll_period_ns);
  if (&source == &sources_.front()) take_snapshot(source);
  source.drains.clear();
  source.attachment.detach();
  source.from_earlier_flight = false;
}

void RecordSession::watch_for_end(const Source& source) {
  const shm::Region* region = source.attachment.region();
  if (region == nullptr || source.from_earlier_flight) return;
  if (!read_run(*region).finished)
    finished_since_ns_ = kNever;
  else if (finished_since_ns_ == kNever)
    finished_since_ns_ = rt::now();
}

bool RecordSession::poll() {
  bool waiting = false;
  for (auto& source : sources_) {
    attach(source);
    // A flight that takes over what an earlier one left starts with its words cleared.
    if (source.from_earlier_flight && !source.attachment.left_over() &&
        (source.attachment.region() == nullptr || !read_run(*source.attachment.region()).finished))
      source.from_earlier_flight = false;
    waiting = drain(source) || waiting;
    if (&source == &sources_.front()) watch_for_end(source);
    if (source.attachment.stale()) let_go(source);
  }
  const TimeNs now = rt::now();
  if (now - flushed_at_ns_ >= kFlushPeriod) flush();
  if (now - snapshot_at_ns_ >= kSnapshotPeriod) {
    snapshot_at_ns_ = now;
    take_snapshot(sources_.front());
    look_at_cameras();
    write_stages();
  }
  return waiting;
}

std::string RecordSession::run(const std::atomic<bool>& stop) {
  for (;;) {
    const TimeNs next = rt::now() + options_.poll_period_ns;
    poll();
    if (stop.load()) return "stopped by signal";
    if (finished_since_ns_ != kNever && rt::now() - finished_since_ns_ >= kEndGrace) return "flight finished";
    rt::sleep_until(next);
  }
}

void RecordSession::finish(const std::string& reason) {
  for (const TimeNs limit = rt::now() + kDrainLimit; poll() && rt::now() < limit;)
    rt::sleep_until(rt::now() + options_.poll_period_ns);
  take_snapshot(sources_.front());
  look_at_cameras();
  if (pool_) pool_->finish();
  flush();
  write_stages();
  write_account(reason);
}

void RecordSession::note(const std::string& region, const std::string& what) {
  if (events_.size() < kMaxEvents)
    events_.push_back({rt::now(), region, what});
  else
    ++events_dropped_;
}

void RecordSession::flush() {
  flushed_at_ns_ = rt::now();
  for (CsvFile* file : tables_->all()) file->flush();
  if (!pool_) return;
  pool_->flush(*rgb_);
  pool_->flush(*depth_);
}

std::uint64_t RecordSession::refused_lines() const {
  std::uint64_t lines = 0;
  for (const CsvFile* file : tables_->all()) lines += file->failed_lines();
  return lines;
}

}  // namespace wasp::tools
