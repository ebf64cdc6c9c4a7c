// The reader of recorded MAVLink logs, and the reader of message descriptions. The first byte: even, the rest is a log;
// odd, it is a description in JSON, and what it describes is decoded out of zeros.
// Promises: any bytes are a log of some kind or named as none; no byte is made up; frames lie in the stream, in order, and
// have their times from the file; a description is refused with a reason or decodes every message it has.
#include <vector>

#include "tests/fuzz/fuzz_input.h"
#include "tools/mavlink_fields.h"

namespace wasp {
namespace {

using fuzz::require;

void check_log(std::span<const std::uint8_t> bytes) {
  const auto log = tools::mavlink_log_of({bytes.begin(), bytes.end()}, mavlink::kMessages);
  require(log.stream.size() + 8 * log.stamps.size() <= bytes.size(), "no byte is made up");
  if (log.kind == tools::LogKind::kNotMavlink) {
    require(!log.why.empty() && log.stream.empty(), "what is no log is named");
    return;
  }
  const tools::LogScan found = tools::scan(log.stream, mavlink::kMessages);
  std::size_t begin = 0;
  for (const tools::FoundFrame& f : found.frames) {
    require(f.begin >= begin && f.end <= log.stream.size() && f.payload + f.length <= f.end, "frames lie in the stream");
    begin = f.begin + 1;
  }
  require(found.stray_bytes + found.truncated_bytes <= log.stream.size(), "no byte is stray twice");
}

void check_description(std::string_view text) {
  tools::MavlinkDescription description;
  try {
    description = tools::MavlinkDescription::parse(std::string(text), "input");
  } catch (const std::runtime_error& error) {
    require(std::string_view(error.what()).starts_with("input: "), "a refusal names the file");
    return;
  }
  for (const mavlink::MessageInfo& row : description.rows())
    require(tools::decode(*description.find(row.id), {}).is_object(), "what is described decodes");
}

}  // namespace
}  // namespace wasp

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::span<const std::uint8_t> rest(data + 1, size - 1);
  if ((data[0] & 1) == 0)
    wasp::check_log(rest);
  else
    wasp::check_description({reinterpret_cast<const char*>(rest.data()), rest.size()});
  return 0;
}
