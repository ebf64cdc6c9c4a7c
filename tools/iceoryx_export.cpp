#include "tools/iceoryx_export.h"
#include "shm/bus_guard.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "rt/clock.h"
#include "tools/iceoryx_message.h"
#include "tools/iceoryx_runtime.h"
#include "tools/iceoryx_topics.h"

namespace wasp::iceoryx {
namespace {

constexpr DurationNs kRegionLook = 100 * kMillisecond;

iox::popo::PublisherOptions publisher_options() {
  iox::popo::PublisherOptions options;
  options.subscriberTooSlowPolicy = iox::popo::ConsumerTooSlowPolicy::DISCARD_OLDEST_DATA;  // never wait for anybody
  return options;
}

}  // namespace

TopicExport::TopicExport(const std::string& instance, const std::string& topic)
    : topic_(topic), publisher_(describe({kService, instance, topic}), publisher_options()) {}

void TopicExport::follow(const shm::Region& region, const shm::TopicEntry& entry) {
  reader_.emplace(region, entry.name_view());
  type_ = entry.type_view();
}

std::uint32_t TopicExport::bytes_of(const shm::Sample& sample) const {
  return message_bytes(type_, sample.data, reader_->payload_bytes());
}

void TopicExport::publish(const shm::Sample& sample) {
  MessageHead head;
  head.payload_bytes = bytes_of(sample);
  head.number = sample.number;
  head.published_at_ns = sample.published_at_ns;
  std::copy_n(type_.begin(), std::min(type_.size(), head.type.size() - 1), head.type.begin());
  publisher_.loan(static_cast<std::uint32_t>(sizeof head) + head.payload_bytes, alignof(std::max_align_t))
      .and_then([&](void* chunk) {
        std::memcpy(chunk, &head, sizeof head);
        std::memcpy(static_cast<std::byte*>(chunk) + sizeof head, sample.data, head.payload_bytes);
        if (reader_->intact(sample)) {
          publisher_.publish(chunk);
          ++exported_;
        } else {
          publisher_.release(chunk);
          ++lost_;
        }
      })
      .or_else([this](iox::popo::AllocationError&) { ++refused_; });
}

void TopicExport::drain() {
  if (!reader_) return;
  if (!publisher_.hasSubscribers()) {
    reader_->latest();
    return;
  }
  const std::uint64_t lost_before = reader_->lost();
  for (std::uint32_t i = 0; i < reader_->slots(); ++i) {
    const shm::Sample sample = reader_->next();
    if (!sample) break;
    publish(sample);
  }
  lost_ += reader_->lost() - lost_before;
}

ExportSession::ExportSession(const ExportOptions& options) : options_(options) {
  const auto sink = [](const std::string& region, const std::string& what) {
    fmt::print(stderr, "wasp-iceoryx: {}: {}\n", region, what);
  };
  for (const auto& region : regions_of(options.instance)) attachments_.emplace_back(region, sink);
}

bool ExportSession::wanted(const shm::TopicEntry& entry) const {
  return entry.kind == shm::TopicKind::kRing &&
         (options_.topics.empty() ||
          std::find(options_.topics.begin(), options_.topics.end(), entry.name_view()) != options_.topics.end());
}

void ExportSession::attach(tools::Attachment& attachment) {
  auto& followers = followers_[&attachment];
  for (const auto& entry : attachment.region()->topics()) {
    if (!wanted(entry)) continue;
    auto& topic = exports_[std::string(entry.name_view())];
    if (!topic) topic = std::make_unique<TopicExport>(options_.instance, std::string(entry.name_view()));
    topic->follow(*attachment.region(), entry);
    followers.push_back(topic.get());
  }
}

void ExportSession::look_for_regions() {
  for (auto& attachment : attachments_) {
    if (attachment.stale()) {
      for (TopicExport* topic : followers_[&attachment]) {
        topic->drain();
        topic->let_go();
      }
      followers_.erase(&attachment);
      attachment.detach();
    }
    if (attachment.try_attach()) attach(attachment);
  }
}

void ExportSession::poll() {
  if (const TimeNs now = rt::now(); now - looked_at_ns_ >= kRegionLook) {
    looked_at_ns_ = now;
    look_for_regions();
  }
  for (auto& [name, topic] : exports_) topic->drain();
}

void ExportSession::print_account(bool json) const {
  for (const auto& [name, t] : exports_) {
    if (json)
      fmt::print("{{\"topic\": \"{}\", \"exported\": {}, \"lost\": {}, \"refused\": {}}}\n", name, t->exported(),
                 t->lost(), t->refused());
    else
      fmt::print("{:<28} {:>9} exported  {:>6} lost  {:>6} refused for want of a free chunk\n", name, t->exported(),
                 t->lost(), t->refused());
  }
  std::fflush(stdout);
}

void check_request(const ExportOptions& options) {
  std::vector<TopicRow> rows;
  const TimeNs deadline = rt::now() + from_seconds(options.wait_s);
  const auto missing = [&]() -> std::string {
    for (const auto& topic : options.topics)
      if (std::none_of(rows.begin(), rows.end(), [&](const TopicRow& r) { return r.topic == topic && r.ring; }))
        return topic;
    return {};
  };
  for (;;) {
    rows = topics_of(options.instance);
    if ((!rows.empty() && missing().empty()) || rt::now() >= deadline || stop_requested()) break;
    rt::sleep_until(rt::now() + 50 * kMillisecond);
  }
  if (rows.empty()) throw std::runtime_error(no_instance_message(options.instance));
  if (const std::string topic = missing(); !topic.empty())
    throw std::runtime_error(fmt::format("instance '{}' has no topic '{}' to export; it has: {}", options.instance,
                                         topic, exportable_text(rows)));
}

namespace {

int serve(const ExportOptions& options, Shared& shared) {
  if (const int code = connect(shared, options.wait_s); code != kDone || stop_requested()) return code;
  shm::install_bus_guard();
  ExportSession session(options);
  session.poll();
  fmt::print("wasp-iceoryx: exporting instance {} as services {}/{}/TOPIC\n", options.instance, kService,
             options.instance);
  std::fflush(stdout);
  const DurationNs period = from_seconds(options.poll_ms * 1e-3);
  TimeNs checked_at_ns = rt::now();
  for (bool same = true; same && !stop_requested(); rt::sleep_until(rt::now() + period)) {
    session.poll();
    shared.beats.fetch_add(1);
    if (rt::now() - checked_at_ns < kRegionLook) continue;
    checked_at_ns = rt::now();
    same = same_daemon();
  }
  session.print_account(options.json);
  if (stop_requested()) return kDone;
  fmt::print(stderr, "wasp-iceoryx: another iox-roudi has taken over; registering with it\n");
  return kReconnect;
}

}  // namespace

int run_export(const ExportOptions& options) {
  return supervise(map_shared(), [&](Shared& shared) { return serve(options, shared); });
}

}  // namespace wasp::iceoryx
