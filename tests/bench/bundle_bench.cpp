// SPDX-License-Identifier: Apache-2.0
#include <benchmark/benchmark.h>

#include "engine/mapping/bundle_system.h"
#include "tests/engine/mapping/bundle_scene.h"

// One step of bundle adjustment, compared with the arithmetic operations that it needs.
namespace docent::bench {
namespace {

// Multiplications and additions, counted from the formulas: a projection with its Jacobian about 110, with
// the loss and weights 130; a point's 3x3 block and gradient 60; a pose's 6x6 block, gradient and its 6x3
// block with the point 280; elimination 220 for each pair of free cameras that see the same point, and 150
// for each such camera. Back-substitution linearises again and evaluates the residuals (70).
double Operations(const engine::BundleProblem& problem) {
  std::vector<int> free_views(problem.points.size(), 0);
  double operations = 0;
  for (const engine::BundleProblem::Measurement& measurement : problem.measurements) {
    operations += 130 + 60 + 70;
    if (problem.cameras[static_cast<std::size_t>(measurement.camera)].fixed) continue;
    operations += 280 + 130 + 60;
    ++free_views[static_cast<std::size_t>(measurement.point)];
  }
  for (const int views : free_views) operations += 150.0 * views + 110.0 * views * (views + 1);
  const double size = 6.0 * static_cast<double>(problem.cameras.size());
  return operations + size * size * size / 3;
}

void BundleStep(benchmark::State& state) {
  engine::BundleSceneOptions options;
  options.cameras = static_cast<int>(state.range(0));
  options.fixed_cameras = static_cast<int>(state.range(1));
  options.points = static_cast<int>(state.range(2));
  options.noise_px = 0.5;
  const engine::BundleProblem problem = engine::MakeBundleScene(options).problem;
  engine::BundleSystem system(problem, engine::RobustLoss::kTukey, nullptr);
  for (auto _ : state) benchmark::DoNotOptimize(system.Step(5, 1e-4));
  state.counters["measurements"] = static_cast<double>(problem.measurements.size());
  state.counters["operations"] = benchmark::Counter(
      Operations(problem), benchmark::Counter::kIsIterationInvariantRate, benchmark::Counter::kIs1000);
}
// The ratio of free keyframes of a local adjustment, and a whole map.
BENCHMARK(BundleStep)->Args({28, 20, 2000})->Args({100, 1, 5000})->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace docent::bench
