// wasp bench micro, the serial line: MAVLink frames written and read, each beside the least any implementation must do,
// on any machine: copy the frame's bytes and run the checksum over them.
#include <benchmark/benchmark.h>

#include <array>
#include <cstring>
#include <memory>
#include <span>

#include "messages/checksum.h"
#include "messages/frame_encoder.h"
#include "messages/frame_parser.h"

namespace wasp::bench {
namespace {

using FrameBytes = std::array<std::uint8_t, mavlink::kMaxFrame>;

/// A message no field of which is zero, so that nothing is truncated.
template <class M>
M full_message() {
  std::array<std::uint8_t, M::kMaxLength> payload;
  for (std::size_t i = 0; i < payload.size(); ++i) payload[i] = static_cast<std::uint8_t>(i + 1);
  return M::unpack(payload.data(), payload.size());
}

template <class M>
std::size_t encode_once(FrameBytes& out) {
  mavlink::Encoder encoder(1, 191);
  return encoder.encode(full_message<M>(), out);
}

template <class M>
void mavlink_encode(benchmark::State& state) {
  mavlink::Encoder encoder(1, 191);
  const M message = full_message<M>();
  FrameBytes out;
  std::size_t bytes = 0;
  for (auto _ : state) {
    bytes = encoder.encode(message, out);
    benchmark::DoNotOptimize(out.data());
    benchmark::ClobberMemory();
  }
  state.counters["frame_bytes"] = static_cast<double>(bytes);
}

template <class M>
void mavlink_parse(benchmark::State& state) {
  FrameBytes wire;
  const std::size_t bytes = encode_once<M>(wire);
  const auto parser = std::make_unique<mavlink::Parser>();
  std::uint64_t good = 0;
  for (auto _ : state)
    parser->feed(std::span<const std::uint8_t>(wire).first(bytes), [&](const mavlink::Frame& frame) {
      benchmark::DoNotOptimize(frame.as<M>());
      ++good;
    });
  if (good != static_cast<std::uint64_t>(state.iterations())) state.SkipWithError("frames were refused");
  state.counters["frame_bytes"] = static_cast<double>(bytes);
}

/// The floor: the same bytes copied once and summed once, table in cache, nothing decided.
template <class M>
void mavlink_floor(benchmark::State& state) {
  FrameBytes wire, out;
  const std::size_t bytes = encode_once<M>(wire);
  for (auto _ : state) {
    std::memcpy(out.data(), wire.data(), bytes);
    benchmark::DoNotOptimize(mavlink::crc_add(mavlink::kCrcInitial, std::span<const std::uint8_t>(out).first(bytes)));
    benchmark::ClobberMemory();
  }
  state.counters["frame_bytes"] = static_cast<double>(bytes);
}

BENCHMARK(mavlink_floor<mavlink::SetAttitudeTarget>);
BENCHMARK(mavlink_encode<mavlink::SetAttitudeTarget>);
BENCHMARK(mavlink_parse<mavlink::SetAttitudeTarget>);
BENCHMARK(mavlink_floor<mavlink::HighresImu>);
BENCHMARK(mavlink_encode<mavlink::HighresImu>);
BENCHMARK(mavlink_parse<mavlink::HighresImu>);
BENCHMARK(mavlink_floor<mavlink::Heartbeat>);
BENCHMARK(mavlink_encode<mavlink::Heartbeat>);
BENCHMARK(mavlink_parse<mavlink::Heartbeat>);

}  // namespace
}  // namespace wasp::bench
