#include "tools/iceoryx_import.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "iceoryx_posh/mepoo/chunk_header.hpp"
#include "iceoryx_posh/popo/untyped_subscriber.hpp"
#include "iceoryx_posh/popo/wait_set.hpp"
#include "rt/clock.h"
#include "shm/topics.h"
#include "tools/iceoryx_runtime.h"

namespace wasp::iceoryx {
namespace {

iox::popo::SubscriberOptions subscriber_options() {
  iox::popo::SubscriberOptions options;
  options.queueCapacity = shm::kFrameSlots;
  return options;
}

std::vector<shm::TopicSpec> camera_topics(std::uint32_t width_px, std::uint32_t height_px) {
  const std::uint64_t pixels = static_cast<std::uint64_t>(width_px) * height_px;
  return {{shm::kGray, "Frame", shm::TopicKind::kRing, shm::kFrameSlots, kFramePixelOffset + pixels},
          {shm::kDepth, "Frame", shm::TopicKind::kRing, shm::kFrameSlots, kFramePixelOffset + 2 * pixels}};
}

/// One service and what it may bring.
class Source {
 public:
  Source(const std::string& service, PixelFormat wanted, const ImportOptions& options)
      : name_(service), wanted_(wanted), subscriber_(describe(parse_service(service)), subscriber_options()) {
    if (!options.raw) return;
    expected_.format = wanted;
    expected_.width_px = options.width_px;
    expected_.height_px = options.height_px;
    expected_.stride_bytes = options.width_px * pixel_bytes(wanted);
    raw_ = true;
  }
  iox::popo::UntypedSubscriber& subscriber() { return subscriber_; }
  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const ImportCount& count() const { return count_; }

  /// Hands every waiting frame to `use(frame)`, which returns why it cannot take it.
  template <class Use>
  void take_all(Use&& use) {
    bool more = true;
    for (std::uint32_t i = 0; more && i < 2 * shm::kFrameSlots; ++i) {
      more = false;
      subscriber_.take().and_then([&](const void* chunk) {
        more = true;
        judge(chunk, use);
        subscriber_.release(chunk);
      });
    }
  }

 private:
  template <class Use>
  void judge(const void* chunk, Use&& use) {
    const std::uint64_t bytes = iox::mepoo::ChunkHeader::fromUserPayload(chunk)->userPayloadSize();
    FrameView frame;
    std::string trouble =
        raw_ ? read_raw_frame(chunk, bytes, expected_, rt::now(), frame) : read_frame(chunk, bytes, frame);
    if (raw_) frame.header.sequence = expected_.sequence++;
    if (trouble.empty() && wanted_ != PixelFormat::kNone && frame.header.format != wanted_)
      trouble = fmt::format("it is {}, not {}", format_name(frame.header.format), format_name(wanted_));
    if (trouble.empty()) trouble = use(frame);
    trouble.empty() ? accept(frame) : reject(trouble);
  }
  void accept(const FrameView& frame) {
    ++count_.taken;
    if (last_number_ != 0 && frame.number > last_number_ + 1) count_.missed += frame.number - last_number_ - 1;
    last_number_ = frame.number;
  }
  /// The same trouble is told once, however often it is met in a row.
  void reject(const std::string& trouble) {
    ++count_.rejected;
    if (trouble == told_) return;
    told_ = trouble;
    fmt::print(stderr, "wasp-iceoryx: {}: rejected: {}\n", name_, trouble);
  }

  std::string name_, told_;
  PixelFormat wanted_;
  bool raw_ = false;
  FrameHeader expected_;
  iox::popo::UntypedSubscriber subscriber_;
  ImportCount count_;
  std::uint64_t last_number_ = 0;
};

/// The services, the WaitSet that sleeps on them, and the region they fill.
class ImportSession {
 public:
  ImportSession(const ImportOptions& options, Shared& shared) : options_(options), shared_(shared) {
    if (!options.service.empty()) add(options.service, PixelFormat::kNone);
    if (!options.gray.empty()) add(options.gray, PixelFormat::kMono8);
    if (!options.depth.empty()) add(options.depth, PixelFormat::kDepth16Mm);
    if (options.width_px > 0) make_region(options.width_px, options.height_px);
    if (!region_ && shared.width_px > 0) make_region(shared.width_px, shared.height_px);  // as the worker before knew
  }
  ~ImportSession() {
    for (auto& source : sources_)
      wait_set_.detachEvent(source->subscriber(), iox::popo::SubscriberEvent::DATA_RECEIVED);
  }
  ImportSession(const ImportSession&) = delete;
  ImportSession& operator=(const ImportSession&) = delete;

  void wait_and_take() {
    wait_set_.timedWait(iox::units::Duration::fromMilliseconds(100));
    for (auto& source : sources_) source->take_all([this](const FrameView& frame) { return use(frame); });
  }
  void print_account(bool json) const {
    for (const auto& source : sources_) {
      const ImportCount& c = source->count();
      if (json)
        fmt::print("{{\"service\": \"{}\", \"taken\": {}, \"rejected\": {}, \"missed\": {}}}\n", source->name(),
                   c.taken, c.rejected, c.missed);
      else
        fmt::print("{:<36} {:>9} taken  {:>6} rejected  {:>6} missed\n", source->name(), c.taken, c.rejected, c.missed);
    }
    std::fflush(stdout);
  }

 private:
  void add(const std::string& service, PixelFormat wanted) {
    sources_.push_back(std::make_unique<Source>(service, wanted, options_));
    wait_set_.attachEvent(sources_.back()->subscriber(), iox::popo::SubscriberEvent::DATA_RECEIVED).or_else([&](auto) {
      throw std::runtime_error("cannot wait for service " + service);
    });
  }
  void make_region(std::uint32_t width_px, std::uint32_t height_px) {
    shared_.width_px = 0;  // should another camera have taken over meanwhile, its region is not ours to remove
    region_.emplace(options_.instance, width_px, height_px);
    shared_.width_px = width_px;
    shared_.height_px = height_px;
    fmt::print("wasp-iceoryx: camera of instance {}, {}x{}\n", options_.instance, width_px, height_px);
    std::fflush(stdout);
  }
  std::string use(const FrameView& frame) {
    if (!region_) make_region(frame.header.width_px, frame.header.height_px);
    if (region_->publish(frame)) return {};
    return fmt::format("wrong size: {}x{} {} does not fit a camera of {}x{}", frame.header.width_px,
                       frame.header.height_px, format_name(frame.header.format), shared_.width_px.load(),
                       shared_.height_px.load());
  }

  const ImportOptions& options_;
  Shared& shared_;
  std::optional<CameraRegion> region_;
  std::vector<std::unique_ptr<Source>> sources_;
  iox::popo::WaitSet<> wait_set_;
};

int serve(const ImportOptions& options, Shared& shared) {
  if (const int code = connect(shared, options.wait_s); code != kDone || stop_requested()) return code;
  ImportSession session(options, shared);
  while (!stop_requested()) {
    session.wait_and_take();
    shared.beats.fetch_add(1);
    if (same_daemon()) continue;
    fmt::print(stderr, "wasp-iceoryx: another iox-roudi has taken over; registering with it\n");
    session.print_account(options.json);
    return kReconnect;
  }
  session.print_account(options.json);
  return kDone;
}

}  // namespace

CameraRegion::CameraRegion(const std::string& instance, std::uint32_t width_px, std::uint32_t height_px)
    : region_(shm::Region::create(shm::camera_region(instance), camera_topics(width_px, height_px), "iceoryx")),
      gray_(region_, shm::kGray, "Frame"),
      depth_(region_, shm::kDepth, "Frame") {}

bool CameraRegion::publish(const FrameView& frame) {
  shm::RingWriter& ring = frame.header.format == PixelFormat::kDepth16Mm ? depth_ : gray_;
  FrameHeader header = frame.header;
  header.stride_bytes = header.width_px * pixel_bytes(header.format);
  const std::size_t row = header.stride_bytes;
  if (kFramePixelOffset + static_cast<std::uint64_t>(row) * header.height_px > ring.payload_bytes()) return false;
  std::byte* slot = ring.loan();
  ring.announce();
  std::memcpy(slot, &header, sizeof header);
  if (frame.header.stride_bytes == row)
    std::memcpy(slot + kFramePixelOffset, frame.pixels, row * header.height_px);
  else
    for (std::size_t v = 0; v < header.height_px; ++v)
      std::memcpy(slot + kFramePixelOffset + v * row, frame.pixels + v * frame.header.stride_bytes, row);
  ring.publish(rt::now());
  return true;
}

void check_request(const ImportOptions& options) {
  if (options.service.empty() && options.gray.empty() && options.depth.empty())
    throw std::runtime_error("nothing to import: name a service with --service, --gray or --depth");
  if (!options.service.empty() && (!options.gray.empty() || !options.depth.empty()))
    throw std::runtime_error("--service and --gray or --depth exclude each other");
  for (const auto& service : {options.service, options.gray, options.depth})
    if (!service.empty()) parse_service(service);
  if (options.raw && options.width_px == 0) throw std::runtime_error("--raw needs --size WIDTHxHEIGHT");
  if (options.raw && !options.service.empty())
    throw std::runtime_error("--raw pixels do not say what they are: name their service with --gray or --depth");
}

int run_import(const ImportOptions& options) {
  Shared& shared = map_shared();
  const int code = supervise(shared, [&](Shared& s) { return serve(options, s); });
  if (shared.width_px > 0) shm::Region::remove(shm::camera_region(options.instance));  // made by us
  return code;
}

}  // namespace wasp::iceoryx
