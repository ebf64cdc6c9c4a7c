#include "tools/eval_mavlink.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <optional>

#include "tools/mavlink_damage.h"
#include "tools/mavlink_description.h"
#include "tools/mavlink_fields.h"
#include "tools/mavlink_log.h"
#include "tools/mavlink_scan.h"

namespace wasp::tools {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

struct Options {
  std::string folder, dialect, fields, key;
  bool json = false;
  unsigned seeds = 20;
  std::size_t campaign_bytes = 1 << 20;
};

/// Regular files below `folder` (or itself), by name.
std::vector<fs::path> files_below(const fs::path& folder) {
  if (fs::is_regular_file(folder)) return {folder};
  if (!fs::is_directory(folder)) throw std::runtime_error(folder.string() + ": no such folder or file");
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

std::string relative_name(const fs::path& file, const fs::path& folder) {
  return file == folder ? file.filename().string() : file.lexically_relative(folder).string();
}

struct Report {
  std::string file;
  MavlinkLog log;
  LogScan scan;
  std::optional<mavlink::SignatureCounts> signatures;
  std::size_t campaign_bytes = 0;
  ChunkResult chunks;
  std::vector<DamageResult> damage;

  [[nodiscard]] bool ok() const {
    return chunks.different == 0 && std::all_of(damage.begin(), damage.end(), [](const DamageResult& d) {
             return d.lost == 0 && d.bad_checksum == 0;
           });
  }
};

/// The frames that end within `bytes`.
std::vector<FoundFrame> first_frames(const std::vector<FoundFrame>& frames, std::size_t bytes) {
  const auto end =
      std::find_if(frames.begin(), frames.end(), [bytes](const FoundFrame& frame) { return frame.end > bytes; });
  return {frames.begin(), end};
}

void run_campaigns(Report& r, const MavlinkDescription& description, const Options& options) {
  // The keyless parser finds what a parser with a key refuses as well.
  const LogScan all = r.signatures ? scan(r.log.stream, description.rows()) : LogScan{};
  const auto frames = first_frames(r.signatures ? all.frames : r.scan.frames, options.campaign_bytes);
  if (frames.empty()) return;
  r.campaign_bytes = frames.back().end;
  const auto stream = std::span(r.log.stream).first(r.campaign_bytes);
  r.chunks = chunk_campaign(stream, scan(stream, description.rows()).frames, description.rows());
  r.damage = damage_campaigns(stream, frames, description.rows(), options.seeds);
}

Report evaluate(const fs::path& path, const MavlinkDescription& description, const Options& options) {
  Report r;
  r.file = relative_name(path, options.folder);
  r.log = read_mavlink_log(path, description.rows());
  if (r.log.kind == LogKind::kNotMavlink) return r;
  if (options.key.empty()) {
    r.scan = scan(r.log.stream, description.rows());
  } else {
    mavlink::SigningClock clock(0);  // a recording is of its own time
    mavlink::SignatureCheck check(mavlink::load_signing_key(options.key), clock, false);
    r.scan = scan(r.log.stream, description.rows(), &check);
    r.signatures = check.counts();
  }
  return r;
}

ordered_json ids_json(const std::map<std::uint32_t, std::uint64_t>& ids, const MavlinkDescription& description) {
  ordered_json j = ordered_json::object();
  for (const auto& [id, count] : ids) {
    const MessageDescription* m = description.find(id);
    j[std::to_string(id)] = m == nullptr ? ordered_json{{"count", count}}
                                         : ordered_json{{"name", m->name}, {"count", count}, {"crc_extra", m->crc_extra}};
  }
  return j;
}

ordered_json sources_json(const LogScan& scan) {
  ordered_json j = ordered_json::array();
  for (const auto& [ids, s] : scan.sources)
    j.push_back({{"system", ids.first},
                 {"component", ids.second},
                 {"frames", s.frames},
                 {"unknown_frames", s.unknown_frames},
                 {"sequence_gaps", s.gaps},
                 {"frames_lost", s.lost},
                 {"repeated", s.repeated}});
  return j;
}

ordered_json damage_json(const std::vector<DamageResult>& results) {
  ordered_json j = ordered_json::object();
  for (const DamageResult& d : results)
    j[d.name] = {{"streams", d.streams},
                 {"damaged_bytes", d.damaged_bytes},
                 {"undamaged_frames", d.undamaged},
                 {"undamaged_lost", d.lost},
                 {"lost_to_checksum_collisions", d.lost_to_collisions},
                 {"accepted", d.accepted},
                 {"accepted_with_damaged_signature", d.other_signature},
                 {"checksum_collisions", d.collisions},
                 {"accepted_with_bad_checksum", d.bad_checksum}};
  return j;
}

ordered_json signatures_json(const mavlink::SignatureCounts& c) {
  return {{"verified", c.verified}, {"unsigned", c.unsigned_allowed}, {"wrong", c.wrong},
          {"old", c.old},           {"too_late", c.too_late},         {"no_room", c.no_room}};
}

ordered_json report_json(const Report& r, const MavlinkDescription& description) {
  const LogScan& s = r.scan;
  ordered_json j = {{"file", r.file}, {"kind", name_of(r.log.kind)}, {"bytes", r.log.file_bytes}};
  if (r.log.kind == LogKind::kNotMavlink) {
    j["why"] = r.log.why;
    return j;
  }
  j.update({{"stream_bytes", r.log.stream.size()},
            {"frames", s.frames.size()},
            {"version_1", s.versions[0]},
            {"version_2", s.versions[1]},
            {"signed", s.signed_frames}});
  if (!r.log.stamps.empty()) {
    j["first_time_us"] = r.log.stamps.front().time_us;
    j["last_time_us"] = r.log.stamps.back().time_us;
  }
  j["ids"] = ids_json(s.ids, description);
  j["unknown_ids"] = ids_json(s.unknown_ids, description);
  j["sources"] = sources_json(s);
  j.update({{"bad_checksums", s.bad_checksums},
            {"refused_frames", s.refused_frames},
            {"unsupported_flags", s.unsupported_flags},
            {"stray_bytes", s.stray_bytes},
            {"truncated_bytes", s.truncated_bytes}});
  if (r.signatures) j["signatures"] = signatures_json(*r.signatures);
  if (r.campaign_bytes > 0) {
    j["campaign_bytes"] = r.campaign_bytes;
    j["chunks"] = {{"passes", r.chunks.passes}, {"different", r.chunks.different}};
    j["damage"] = damage_json(r.damage);
    j["ok"] = r.ok();
  }
  return j;
}

void print_table(const Report& r, const MavlinkDescription& description) {
  const LogScan& s = r.scan;
  fmt::print("{}: {}", r.file, name_of(r.log.kind));
  if (r.log.kind == LogKind::kNotMavlink) return fmt::print(" ({})\n", r.log.why);
  fmt::print(", {} frames (version 1: {}, version 2: {}, signed: {})\n", s.frames.size(), s.versions[0], s.versions[1],
             s.signed_frames);
  for (const auto& [id, count] : s.ids) fmt::print("  {:>6} {:<40}{:>10}\n", id, description.find(id)->name, count);
  for (const auto& [id, count] : s.unknown_ids) fmt::print("  {:>6} {:<40}{:>10}\n", id, "unknown, not verified", count);
  for (const auto& [ids, source] : s.sources)
    fmt::print("  system {} component {}: {} frames, {} unknown, {} sequence gaps ({} frames lost), {} repeated\n",
               ids.first, ids.second, source.frames, source.unknown_frames, source.gaps, source.lost, source.repeated);
  fmt::print("  bad checksums {}, unsupported flags {}, stray bytes {}, truncated bytes {}\n", s.bad_checksums,
             s.unsupported_flags, s.stray_bytes, s.truncated_bytes);
  if (r.signatures)
    fmt::print("  signatures: {} verified, {} wrong, {} old, {} of too many streams\n", r.signatures->verified,
               r.signatures->wrong, r.signatures->old, r.signatures->no_room);
  if (r.campaign_bytes == 0) return;
  fmt::print("  pieces of 1 to 64 bytes: {} passes, {} with other frames\n", r.chunks.passes, r.chunks.different);
  for (const DamageResult& d : r.damage)
    fmt::print("  {:<10} {} streams: {} undamaged frames, {} lost ({} to checksum collisions); {} accepted, {} collide, {} "
               "with a bad checksum\n",
               d.name, d.streams, d.undamaged, d.lost, d.lost_to_collisions, d.accepted, d.collisions, d.bad_checksum);
  fmt::print("  {}\n", r.ok() ? "ok" : "NOT MET");
}

int run(const Options& options) {
  const auto description =
      MavlinkDescription::load(options.dialect.empty() ? default_description() : fs::path(options.dialect));
  std::size_t logs = 0, missed = 0, frames = 0;
  for (const fs::path& path : files_below(options.folder)) {
    Report r = evaluate(path, description, options);
    const bool is_log = r.log.kind != LogKind::kNotMavlink;
    logs += is_log ? 1 : 0;
    frames += r.scan.frames.size();
    if (options.fields == "-") {
      if (is_log) print_fields(r.file, description, r.log, r.scan);
      continue;
    }
    if (is_log && !options.fields.empty()) write_fields(options.fields, path.filename(), description, r.log, r.scan);
    if (is_log && options.seeds > 0) run_campaigns(r, description, options);
    missed += r.ok() ? 0 : 1;
    if (options.json)
      fmt::print("{}\n", report_json(r, description).dump());
    else
      print_table(r, description);
  }
  if (logs == 0) throw std::runtime_error(options.folder + ": no MAVLink log");
  if (options.json && options.fields != "-")
    fmt::print("{}\n", ordered_json{{"summary", true}, {"logs", logs}, {"frames", frames}, {"ok", missed == 0}}.dump());
  return missed == 0 ? 0 : 1;
}

}  // namespace

int eval_mavlink_main(int argc, char** argv) {
  CLI::App app{"Counts, gaps and damage campaigns over recorded MAVLink logs: raw streams and telemetry logs, versions 1 and "
               "2, told from their content. Exit code 1: a frame was lost or wrong under damage.",
               "wasp-eval mavlink"};
  Options options;
  app.add_option("DIR", options.folder, "folder with logs, or one log")->required();
  app.add_flag("--json", options.json, "one JSON object a file and line, and a summary");
  app.add_option("--fields", options.fields,
                 "decoded frames, floats exact: '-' prints JSON lines instead of the report, else a folder for one CSV a "
                 "log and message");
  app.add_option("--dialect", options.dialect, "message description (JSON) in place of wasp's own");
  app.add_option("--key", options.key, "signing key file: signatures are verified");
  app.add_option("--seeds", options.seeds, "damaged streams a campaign and rate; 0: no campaigns")->capture_default_str();
  app.add_option("--campaign-bytes", options.campaign_bytes, "the campaigns take so much of a log")
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    return run(options);
  } catch (const std::exception& error) {
    fmt::print(stderr, "wasp-eval mavlink: {}\n", error.what());
    return 2;
  }
}

}  // namespace wasp::tools
