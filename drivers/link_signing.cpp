#include "drivers/link_signing.h"

#include <ctime>
#include <stdexcept>

#include "rt/clock.h"

namespace wasp::drivers {
namespace {

TimeNs wall_minus_monotonic() {
  timespec ts{};
  clock_gettime(CLOCK_REALTIME, &ts);
  return static_cast<TimeNs>(ts.tv_sec) * kSecond + ts.tv_nsec - rt::now();
}

const std::string& key_file_of(const SigningSettings& settings) {
  if (settings.key_file.empty())
    throw std::runtime_error("[autopilot] signing = \"" + settings.mode + "\" needs signing_key_file");
  return settings.key_file;
}

}  // namespace

LinkSigning::LinkSigning(const SigningSettings& settings, std::uint8_t first_link)
    : time_file_(mavlink::signing_time_path(key_file_of(settings))),
      wall_ns_(wall_minus_monotonic()),
      key_(mavlink::load_signing_key(settings.key_file)),
      clock_(mavlink::first_signing_time(mavlink::signing_time_of(rt::now() + wall_ns_),
                                         mavlink::load_signing_time(time_file_))),
      signer_(key_, clock_, first_link),
      check_(key_, clock_, settings.mode == "require") {}

std::unique_ptr<LinkSigning> open_signing(const SigningSettings& settings, std::uint8_t first_link) {
  return settings.mode == "off" ? nullptr : std::make_unique<LinkSigning>(settings, first_link);
}

std::string_view refusal_since(const mavlink::SignatureCounts& before,
                               const mavlink::SignatureCounts& now) WASP_REALTIME {
  if (now.wrong != before.wrong) return "signed with another key, or damaged";
  if (now.unsigned_refused != before.unsigned_refused) return "not signed";
  if (now.old != before.old) return "signed before one that came earlier: a replay";
  if (now.too_late != before.too_late) return "signed more than a minute ago";
  if (now.no_room != before.no_room) return "of too many signed streams";
  return {};
}

}  // namespace wasp::drivers
