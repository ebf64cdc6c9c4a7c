// wasp-kinect: dumps for fakenect, from simulated flights or from recordings, and the depth models side by side.
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "drivers/kinect_depth.h"
#include "drivers/recording.h"
#include "missions/fakenect_flight.h"
#include "sim/fakenect_check.h"

namespace {

using namespace wasp;
namespace fs = std::filesystem;

struct Options {
  std::string mission = "hover", model = "linear";
  std::vector<std::string> configs;
  std::uint32_t seed = 1;
  missions::FakenectFlight part;
  fs::path folder, out;
  bool repair = false;
};

sim::FakenectOptions dump_options(const Options& o) {
  sim::FakenectOptions options = o.part.dump;
  drivers::published_model(o.model, options.model);
  return options;
}

void record(const Options& o) {
  missions::FakenectFlight part = o.part;
  part.dump = dump_options(o);
  const missions::MissionSetup setup = missions::load_mission(o.mission, o.seed, o.configs);
  const std::uint64_t n = missions::record_fakenect(setup, part, o.out);
  std::printf("%s: %llu exposures of mission %s, seed %u\n", o.out.c_str(), static_cast<unsigned long long>(n),
              o.mission.c_str(), o.seed);
}

void convert(const Options& o) {
  const drivers::Recording recording = drivers::Recording::open(o.folder);
  for (const auto& problem : recording.problems()) std::fprintf(stderr, "%s\n", problem.c_str());
  sim::FakenectDump dump(o.out, dump_options(o));
  std::vector<std::uint8_t> gray(recording.gray_size().pixels());
  std::vector<std::uint16_t> depth(recording.depth_size().pixels());
  for (std::size_t i = 0; i < recording.entries().size(); ++i) {
    const auto& entry = recording.entries()[i];
    GrayView gray_view;
    DepthView depth_view;
    if (entry.has_gray()) {
      recording.load_gray(i, gray);
      gray_view = {gray.data(), recording.gray_size().width_px, recording.gray_size().height_px,
                   recording.gray_size().width_px};
    }
    if (entry.has_depth()) {
      recording.load_depth(i, depth);
      depth_view = {depth.data(), recording.depth_size().width_px, recording.depth_size().height_px,
                    recording.depth_size().width_px};
    }
    dump.add(entry.offset_ns, gray_view, depth_view);
  }
  std::printf("%s: %llu exposures of %s (%s)\n", o.out.c_str(), static_cast<unsigned long long>(dump.exposures()),
              o.folder.c_str(), recording.layout().c_str());
}

int check(const Options& o) {
  const sim::FakenectReport report = sim::check_fakenect(o.folder);
  for (const auto& problem : report.problems) std::printf("%s\n", problem.c_str());
  std::printf("%s: %zu entries, %zu of no use\n", o.folder.c_str(), report.entries, report.problems.size());
  if (o.repair && !report.problems.empty()) {
    sim::write_fakenect_index(o.folder, report);
    std::printf("INDEX.txt now names the %zu good ones; what it was is INDEX.txt.before\n", report.good.size());
  }
  return report.problems.empty() || o.repair ? 0 : 1;
}

void models() {
  std::printf("raw value of each depth by the linear model; what the other two make of it\n");
  std::printf("depth_m  raw     step_mm  tangent_m  of it    gaussians_m  of it\n");
  const auto& linear = drivers::kBurrusLinear;
  for (const double z : {0.4, 0.5, 0.6, 0.8, 1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 7.0}) {
    const double raw = (1 / z - linear.coefficients[1]) / linear.coefficients[0];
    const double step_mm = 1000 * (drivers::model_depth_m(linear, raw + 1) - z);
    const double tangent = drivers::model_depth_m(drivers::kMagnenatTangent, raw);
    const double gaussians = drivers::model_depth_m(drivers::kThesisGaussians, raw);
    std::printf("%5.1f  %7.1f  %7.2f  %8.3f  %+6.1f %%  %9.3f  %+7.1f %%\n", z, raw, step_mm, tangent,
                100 * (tangent / z - 1), gaussians, 100 * (gaussians / z - 1));
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "A first-generation Kinect that is not there: dumps that libfreenect's fakenect plays to `wasp camera`\n"
      "(LD_LIBRARY_PATH=.../fakenect FAKENECT_PATH=DUMP wasp camera --driver kinect), and the depth models."};
  app.name("wasp kinect");
  app.require_subcommand(1);
  Options o;
  const auto add_model = [&o](CLI::App* to) {
    to->add_option("--model", o.model, "by which millimetres become raw values")
        ->check(CLI::IsMember({"two-gaussians", "tangent", "linear"}))
        ->capture_default_str();
    to->add_option("--first-ticks", o.part.dump.first_ticks, "of the device's 60 MHz counter")->capture_default_str();
  };
  auto* recorder = app.add_subcommand("record", "fly a mission in lockstep and keep what its camera saw");
  recorder->add_option("OUT", o.out, "folder to make; 46 MB a second, and truth.csv")->required();
  recorder->add_option("--mission", o.mission, "what is flown")->capture_default_str();
  recorder->add_option("--config", o.configs, "further flight configuration")->check(CLI::ExistingFile);
  recorder->add_option("--seed", o.seed, "of world, sensors and vehicle")->capture_default_str();
  recorder->add_option("--from", o.part.from_s, "since the start [s]")->check(CLI::Range(0.1, 1e4))->capture_default_str();
  recorder->add_option("--seconds", o.part.seconds, "how much is kept")->check(CLI::Range(0.1, 600.0))->capture_default_str();
  add_model(recorder);
  auto* converter = app.add_subcommand("convert", "a recording of any layout, 640 x 480, as such a dump");
  converter->add_option("RECORDING", o.folder, "folder")->required()->check(CLI::ExistingDirectory);
  converter->add_option("OUT", o.out, "folder to make")->required();
  add_model(converter);
  auto* checker = app.add_subcommand("check", "entries fakenect would die of, or read beyond, by file and line");
  checker->add_option("DUMP", o.folder, "folder")->required()->check(CLI::ExistingDirectory);
  checker->add_flag("--repair", o.repair, "write an INDEX.txt without them");
  auto* table = app.add_subcommand("models", "the three published depth models side by side");
  CLI11_PARSE(app, argc, argv);
  try {
    if (*recorder) record(o);
    if (*converter) convert(o);
    if (*checker) return check(o);
    if (*table) models();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "wasp kinect: %s\n", error.what());
    return 1;
  }
  return 0;
}
