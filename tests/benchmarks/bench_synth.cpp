// SPDX-License-Identifier: BSD-3-Clause
// Frames a second of the world generator: bench_synth --benchmark_filter=Render
#include <benchmark/benchmark.h>

#include "plumbline/core/executor.hpp"
#include "plumbline/synth/source.hpp"

namespace {

using namespace plumbline;

std::unique_ptr<synth::SynthSource> open(const char* name, synth::Sensor sensor) {
  const core::Executor executor(2);
  synth::SynthOptions options;
  options.frames = 300;
  options.sensor = sensor;
  const auto scene = synth::load_scene(name, std::string(PLUMBLINE_SOURCE_DIR) + "/pipelines/scenes");
  if (!scene) throw std::runtime_error(scene.error().message);
  const auto world = synth::build_world(*scene, options, executor);
  if (!world) throw std::runtime_error(world.error().message);
  auto source = synth::SynthSource::create(*world, 0);
  if (!source) throw std::runtime_error(source.error().message);
  return std::move(*source);
}

/// 16 frames at once on two threads; the counter is frames a second.
void render(benchmark::State& state, const char* name, synth::Sensor sensor) {
  const core::Executor executor(2);
  const auto source = open(name, sensor);
  std::size_t at = 0;
  for (auto unused : state) {
    (void)unused;
    executor.parallel_for(16, [&](std::size_t i) {
      auto frame = source->read((at + i) * 7 % source->size());
      benchmark::DoNotOptimize(frame);
    });
    at += 16;
  }
  state.counters["frames"] = benchmark::Counter(static_cast<double>(at), benchmark::Counter::kIsRate);
}

void build(benchmark::State& state, const char* name) {
  for (auto unused : state) {
    (void)unused;
    benchmark::DoNotOptimize(open(name, synth::Sensor::kKinect));
  }
}

BENCHMARK_CAPTURE(render, room_kinect, "room", synth::Sensor::kKinect)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(render, room_ideal, "room", synth::Sensor::kIdeal)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(render, structure_kinect, "structure", synth::Sensor::kKinect)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(render, office_kinect, "office", synth::Sensor::kKinect)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(build, room, "room")->Unit(benchmark::kMillisecond)->UseRealTime()->Iterations(1);
BENCHMARK_CAPTURE(build, office, "office")->Unit(benchmark::kMillisecond)->UseRealTime()->Iterations(1);

}  // namespace

BENCHMARK_MAIN();
