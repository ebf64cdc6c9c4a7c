// What an instance of wasp offers: its regions' directories, read without iceoryx.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace wasp::iceoryx {

struct TopicRow {
  std::string instance, topic, type;
  std::uint64_t bytes = 0;  ///< capacity of one message
  bool ring = true;         ///< blocks (stages, run) are not messages and are not exported
};

/// The regions of an instance: camera, flight, truth.
std::array<std::string, 3> regions_of(const std::string& instance);
/// Topics of the instance's living regions; empty if there are none.
std::vector<TopicRow> topics_of(const std::string& instance);
/// "gray, depth, imu": the names of the rings.
std::string exportable_text(const std::vector<TopicRow>& rows);
/// "no instance 'x' is running; running are: ..."
std::string no_instance_message(const std::string& instance);

/// Bytes of one message of a type, of `capacity` in its slot: the struct's size; of a frame as many as its header says;
/// for types not known here the whole slot.
std::uint32_t message_bytes(std::string_view type, const std::byte* data, std::uint64_t capacity);

}  // namespace wasp::iceoryx
