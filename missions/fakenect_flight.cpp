#include "missions/fakenect_flight.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <stdexcept>

namespace wasp::missions {
namespace {

/// A behaviour that says nothing and keeps what it is shown.
struct Keeper {
  sim::FakenectDump dump;
  TimeNs from_ns, until_ns;
  Mat3 R_cam_body;
  std::vector<TimeNs> exposed_at_ns;

  void keep(const BehaviourInput& input) {
    if (input.exposed_at_ns < from_ns || input.exposed_at_ns >= until_ns) return;
    if (input.accel_valid) {
      const Vec3 accel_cam_mps2 = R_cam_body * Vec3(input.accel_body_mps2[0], input.accel_body_mps2[1],
                                                    input.accel_body_mps2[2]);
      dump.add_accel(input.exposed_at_ns, {accel_cam_mps2.x(), accel_cam_mps2.y(), accel_cam_mps2.z()});
    }
    dump.add(input.exposed_at_ns, input.gray, input.depth);
    exposed_at_ns.push_back(input.exposed_at_ns);
  }
};

std::uint32_t unused_row(const MissionSetup& setup) {
  const auto& rows = setup.flight.behaviours;
  const auto free = std::find_if(rows.begin(), rows.end(), [](const auto& row) { return !row.enabled; });
  if (free == rows.end()) throw std::runtime_error("every behaviour flies in " + setup.name + ": no row is free");
  return static_cast<std::uint32_t>(free - rows.begin());
}

void write_truth(const std::filesystem::path& file, const Keeper& keeper, const sim::LockstepLog& log) {
  std::ofstream out(file);
  out << "exposure,t_s,height_m,north_m,east_m,qw,qx,qy,qz\n";
  for (std::size_t i = 0; i < keeper.exposed_at_ns.size(); ++i) {
    const TimeNs at_ns = keeper.exposed_at_ns[i];
    auto after = std::find_if(log.samples.begin(), log.samples.end(), [&](const auto& s) { return s.at_ns >= at_ns; });
    if (after == log.samples.begin() || after == log.samples.end())
      throw std::runtime_error("the flight ended before the part to be kept did");
    const Truth &a = (after - 1)->truth, &b = after->truth;
    const auto t = static_cast<float>(static_cast<double>(at_ns - (after - 1)->at_ns) /
                                      static_cast<double>(after->at_ns - (after - 1)->at_ns));
    const auto between = [t](float x, float y) { return x + t * (y - x); };
    const auto quat = [](const Truth& s) { return Quat(s.q_ned_body[0], s.q_ned_body[1], s.q_ned_body[2], s.q_ned_body[3]); };
    const Quat q = quat(a).slerp(t, quat(b));
    out << fmt::format("{},{:.6f},{:.5f},{:.5f},{:.5f},{:.6f},{:.6f},{:.6f},{:.6f}\n", i,
                       to_seconds(at_ns - keeper.exposed_at_ns.front()), between(a.height_m, b.height_m),
                       between(a.position_ned_m[0], b.position_ned_m[0]),
                       between(a.position_ned_m[1], b.position_ned_m[1]), q.w(), q.x(), q.y(), q.z());
  }
}

}  // namespace

std::uint64_t record_fakenect(const MissionSetup& setup, const FakenectFlight& part,
                              const std::filesystem::path& folder) {
  sim::LockstepOptions options = lockstep_options(setup);
  const auto keeper = std::make_shared<Keeper>(Keeper{{folder, part.dump},
                                                      from_seconds(part.from_s),
                                                      from_seconds(part.from_s + part.seconds),
                                                      setup.sim.camera.R_body_cam.transpose(),
                                                      {}});
  options.behaviours.push_back({unused_row(setup), Stream::kGrayDepth, std::nullopt, [keeper](const BehaviourInput& input) {
                                  keeper->keep(input);
                                  return sim::LockstepCue{};
                                }});
  const double margin_s = 0.5;
  const double limit_s = part.from_s + part.seconds + margin_s;
  const sim::LockstepLog log = sim::Lockstep(options).fly(limit_s);
  if (keeper->exposed_at_ns.empty()) throw std::runtime_error("no exposure falls into that part of the flight");
  write_truth(folder / "truth.csv", *keeper, log);
  return keeper->dump.exposures();
}

}  // namespace wasp::missions
