#include "tools/iceoryx_topics.h"

#include <algorithm>
#include <cstring>
#include <exception>

#include "shm/region.h"
#include "shm/topics.h"
#include "tools/record_attachment.h"
#include "types/messages.h"

namespace wasp::iceoryx {
namespace {

struct TypeSize {
  std::string_view type;
  std::size_t bytes;
};
constexpr TypeSize kTypes[] = {{"Imu", sizeof(ImuSample)},
                               {"Attitude", sizeof(AttitudeSample)},
                               {"Cue", sizeof(Cue)},
                               {"Command", sizeof(Command)},
                               {"Truth", sizeof(Truth)}};

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const auto& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

}  // namespace

std::array<std::string, 3> regions_of(const std::string& instance) {
  return {shm::camera_region(instance), shm::flight_region(instance), shm::truth_region(instance)};
}

std::vector<TopicRow> topics_of(const std::string& instance) {
  std::vector<TopicRow> rows;
  for (const auto& name : regions_of(instance)) try {
      const shm::Region region = shm::Region::attach(name);
      if (!region.writer_alive()) continue;
      for (const auto& e : region.topics())
        rows.push_back({instance, std::string(e.name_view()), std::string(e.type_view()), e.payload_bytes,
                        e.kind == shm::TopicKind::kRing});
    } catch (const std::exception&) {
      continue;  // absent, or still being built
    }
  return rows;
}

std::string exportable_text(const std::vector<TopicRow>& rows) {
  std::vector<std::string> names;
  for (const auto& row : rows)
    if (row.ring) names.push_back(row.topic);
  return joined(names);
}

std::string no_instance_message(const std::string& instance) {
  const auto names = tools::list_instances();
  return "no instance '" + instance + "' is running" +
         (names.empty() ? " (nothing in shared memory)" : "; running: " + joined(names));
}

std::uint32_t message_bytes(std::string_view type, const std::byte* data, std::uint64_t capacity) {
  std::uint64_t bytes = capacity;
  if (type == "Frame") {
    FrameHeader head;
    std::memcpy(&head, data, sizeof head);
    bytes = kFramePixelOffset + static_cast<std::uint64_t>(head.stride_bytes) * head.height_px;
  } else if (const auto* row =
                 std::find_if(std::begin(kTypes), std::end(kTypes), [&](const TypeSize& t) { return t.type == type; });
             row != std::end(kTypes)) {
    bytes = row->bytes;
  }
  return static_cast<std::uint32_t>(std::min(bytes, capacity));
}

}  // namespace wasp::iceoryx
