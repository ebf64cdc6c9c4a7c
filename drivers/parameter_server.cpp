#include "drivers/parameter_server.h"

namespace wasp::drivers {

bool ParameterServer::add(std::string_view name, std::uint8_t type, double value) {
  const ParameterName padded = parameter_name(name);
  if (count_ == kMost || name.empty() || name.size() > padded.size() || find(padded) >= 0) return false;
  if (!encode_parameter(encoding_, type, value)) return false;
  rows_[count_++] = {padded, type, value};
  return true;
}

bool ParameterServer::add_writable(std::string_view name, std::uint8_t type, double value, double least,
                                   double greatest) {
  if (!add(name, type, value)) return false;
  ParameterRow& row = rows_[count_ - 1];
  row.writable = true;
  row.least = least;
  row.greatest = greatest;
  return true;
}

int ParameterServer::find(const ParameterName& name) const WASP_REALTIME {
  for (std::size_t i = 0; i < count_; ++i)
    if (name_of(rows_[i].name) == name_of(name)) return static_cast<int>(i);
  return -1;
}

bool ParameterServer::set(ParameterRow& row, const mavlink::ParamSet& m) WASP_REALTIME {
  if (!row.writable || m.param_type != row.type) return false;
  const auto value = decode_parameter(encoding_, m.param_type, m.param_value);
  if (!value || *value < row.least || *value > row.greatest || *value == row.value) return false;
  row.value = *value;
  return true;
}

void ParameterServer::tell(int index) WASP_REALTIME {
  if (index >= 0 && static_cast<std::size_t>(index) < count_) to_tell_[static_cast<std::size_t>(index)] = true;
}

void ParameterServer::tell_all() WASP_REALTIME {
  for (std::size_t i = 0; i < count_; ++i) to_tell_[i] = true;
  looked_ = 0;  // in order
}

bool ParameterServer::next(mavlink::ParamValue& out) WASP_REALTIME {
  for (std::size_t n = 0; n < count_; ++n) {
    const std::size_t i = (looked_ + n) % count_;
    if (!to_tell_[i]) continue;
    const ParameterRow& row = rows_[i];
    to_tell_[i] = false;
    looked_ = i + 1;
    out.param_id = row.name;
    out.param_type = row.type;
    out.param_count = static_cast<std::uint16_t>(count_);
    out.param_index = static_cast<std::uint16_t>(i);
    out.param_value = encode_parameter(encoding_, row.type, row.value).value_or(0.f);  // it was checked when added
    return true;
  }
  return false;
}

}  // namespace wasp::drivers
