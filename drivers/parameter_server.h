// wasp's own parameters over MAVLink (guide, "Parameter Protocol"): the set is made before the start and never changes;
// a list request marks every row to be told, a read or a set marks one, and `next` hands them out one by one when the
// line has room, however many ask. A set is answered by the value in force, also when it was refused. No thread, no
// clock; after the last `add` realtime-safe: yes.
#pragma once

#include <array>
#include <bitset>
#include <cstdint>

#include "drivers/autopilot_link.h"
#include "drivers/parameter_value.h"

namespace wasp::drivers {

struct ParameterRow {
  ParameterName name{};
  std::uint8_t type = mavlink::mav_param_type::kReal32;
  double value = 0;
  bool writable = false;
  double least = 0, greatest = 0;  ///< of a writable one
};

class ParameterServer {
 public:
  static constexpr std::size_t kMost = 128;

  explicit ParameterServer(ParameterEncoding encoding) noexcept : encoding_(encoding) {}

  /// False: no room, a name that is empty, too long or there already, or a value its type cannot carry. Before the
  /// start only.
  bool add(std::string_view name, std::uint8_t type, double value);
  /// One that PARAM_SET may change within its range.
  bool add_writable(std::string_view name, std::uint8_t type, double value, double least, double greatest);

  /// True if the frame was a request of this protocol (whoever it was for). `changed` is called with the index of a row
  /// that was set to another value.
  template <class Changed>
  bool receive(const mavlink::Frame& frame, const LinkIdentity& self, Changed&& changed) WASP_REALTIME {
    if (frame.is<mavlink::ParamRequestList>()) {
      const auto m = frame.as<mavlink::ParamRequestList>();
      if (for_us(self, m.target_system, m.target_component)) tell_all();
    } else if (frame.is<mavlink::ParamRequestRead>()) {
      const auto m = frame.as<mavlink::ParamRequestRead>();
      if (for_us(self, m.target_system, m.target_component))
        tell(m.param_index >= 0 ? m.param_index : find(m.param_id));
    } else if (frame.is<mavlink::ParamSet>()) {
      const auto m = frame.as<mavlink::ParamSet>();
      if (!for_us(self, m.target_system, m.target_component)) return true;
      const int row = find(m.param_id);
      tell(row);
      if (row >= 0 && set(rows_[static_cast<std::size_t>(row)], m)) changed(static_cast<std::size_t>(row));
    } else {
      return false;
    }
    return true;
  }

  [[nodiscard]] bool waiting() const WASP_REALTIME { return to_tell_.any(); }
  /// The next answer; false if none waits.
  bool next(mavlink::ParamValue& out) WASP_REALTIME;
  [[nodiscard]] const ParameterRow& row(std::size_t index) const WASP_REALTIME { return rows_[index]; }
  [[nodiscard]] std::size_t count() const noexcept { return count_; }
  [[nodiscard]] ParameterEncoding encoding() const noexcept { return encoding_; }

 private:
  static bool for_us(const LinkIdentity& self, std::uint8_t system, std::uint8_t component) WASP_REALTIME {
    return (system == 0 || system == self.system_id) && (component == 0 || component == self.component_id);
  }
  [[nodiscard]] int find(const ParameterName& name) const WASP_REALTIME;
  bool set(ParameterRow& row, const mavlink::ParamSet& m) WASP_REALTIME;
  void tell(int index) WASP_REALTIME;
  void tell_all() WASP_REALTIME;

  ParameterEncoding encoding_;
  std::array<ParameterRow, kMost> rows_{};
  std::size_t count_ = 0, looked_ = 0;
  std::bitset<kMost> to_tell_;
};

}  // namespace wasp::drivers
