#include "scheduling/fault_control.h"

#include <fmt/format.h>

#include <algorithm>

#include "rt/clock.h"
#include "scheduling/fault_request.h"

namespace wasp::scheduling {

FaultControl::FaultControl(const FaultSetup& setup, Log log) : scope_(setup.scope), log_(std::move(log)) {
  if (!setup.timeline.empty()) pending_ = load_fault_timeline(setup.timeline, scope_);
  const std::size_t count = pending_.size();
  if (setup.timeline_over) pending_.clear();
  if (!setup.socket.empty()) socket_ = std::make_unique<FaultSocket>(setup.socket);
  std::string text = "FAULTS ARMED:";
  if (!setup.timeline.empty())
    text += fmt::format(" timeline {} ({} faults{})", setup.timeline, count,
                        setup.timeline_over ? ", not again in a flight that was started again" : "");
  if (socket_) text += fmt::format("{} socket {}", setup.timeline.empty() ? "" : ",", socket_->path());
  log_(text);
}

FaultControl::~FaultControl() { stop(); }

void FaultControl::start(const MissionMarks& marks) {
  rt::ThreadSpec spec;
  spec.name = "faults";
  thread_ = rt::Thread(spec, [this, &marks] { run(marks); });
}

void FaultControl::stop() {
  if (stop_.exchange(true)) return;
  thread_.join();
  clear(std::nullopt);
  for (const auto& fault : pending_)
    log_(fmt::format("fault: {} never fell due ({:g} s after {})", name_of(fault.order.point),
                     to_seconds(fault.delay_ns), kMilestoneNames[static_cast<std::size_t>(fault.after)]));
  pending_.clear();
}

void FaultControl::run(const MissionMarks& marks) {
  while (!stop_) {
    const TimeNs next_ns = look(marks, rt::now());
    if (socket_)
      socket_->serve(next_ns, [this](std::string_view request) { return answer(request, rt::now()); });
    else
      rt::sleep_until(next_ns);
  }
}

TimeNs FaultControl::look(const MissionMarks& marks, TimeNs now_ns) {
  TimeNs next_ns = now_ns + kPatience;
  for (std::size_t i = 0; i < kFaultPoints; ++i) {
    const TimeNs until_ns = active_[i].until_ns;
    if (until_ns == 0) continue;
    if (now_ns >= until_ns)
      end(static_cast<FaultPoint>(i));
    else
      next_ns = std::min(next_ns, until_ns);
  }
  std::erase_if(pending_, [&](const TimedFault& fault) {
    const TimeNs mark_ns = marks.reached_ns(fault.after);
    if (mark_ns == 0) return false;
    const bool due = now_ns >= mark_ns + fault.delay_ns;
    if (due)
      begin(fault.order, now_ns);
    else
      next_ns = std::min(next_ns, mark_ns + fault.delay_ns);
    return due;
  });
  if (ending_) end_process(*ending_);
  return next_ns;
}

void FaultControl::begin(const FaultOrder& order, TimeNs now_ns) {
  log_("fault: " + text_of(order, scope_));
  if (row_of(order.point).use == FaultUse::kMoment) {
    ending_ = order.point;
    return;
  }
  active_[static_cast<std::size_t>(order.point)] = {order, now_ns + order.for_ns};
  board_.set(order.point, now_ns, now_ns + order.for_ns, order.value, order.target);
  if (order.point == FaultPoint::kProcessDescriptors) descriptors_.take_all_but(static_cast<std::size_t>(order.value));
}

void FaultControl::end(FaultPoint point) {
  active_[static_cast<std::size_t>(point)].until_ns = 0;
  board_.clear(point);
  if (point == FaultPoint::kProcessDescriptors) descriptors_.release();
  log_(fmt::format("fault: {} off", name_of(point)));
}

void FaultControl::clear(std::optional<FaultPoint> point) {
  for (std::size_t i = 0; i < kFaultPoints; ++i)
    if (active_[i].until_ns != 0 && (!point || static_cast<std::size_t>(*point) == i)) end(static_cast<FaultPoint>(i));
}

std::string FaultControl::answer(std::string_view text, TimeNs now_ns) {
  try {
    const FaultRequest request = parse_fault_request(text, scope_);
    switch (request.verb) {
      case FaultRequest::Verb::kInject:
        begin(request.order, now_ns);
        return fmt::format("ok {} at {}", name_of(request.order.point), now_ns);
      case FaultRequest::Verb::kClear:
        clear(request.point);
        return "ok";
      case FaultRequest::Verb::kList:
        return list_of_fault_points();
      case FaultRequest::Verb::kStatus:
        return status(now_ns);
    }
  } catch (const std::exception& e) {
    return std::string("error ") + e.what();
  }
  return "error";
}

std::string FaultControl::status(TimeNs now_ns) const {
  std::string text;
  for (const auto& active : active_)
    if (active.until_ns > now_ns)
      text += fmt::format("{}; {:.3f} s to go\n", text_of(active.order, scope_), to_seconds(active.until_ns - now_ns));
  if (!pending_.empty()) text += fmt::format("{} faults of the timeline to come\n", pending_.size());
  return text.empty() ? "nothing is on\n" : text;
}

}  // namespace wasp::scheduling
