// SPDX-License-Identifier: Apache-2.0
#include <benchmark/benchmark.h>
#include <malloc.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "engine/mapping/bundle/bundle_system.h"
#include "engine/mapping/bundle/map_adjustment.h"
#include "engine/mapping/bundle/robust_loss.h"
#include "tests/bench/bench_sequence.h"
#include "tests/bench/ceres_bundle.h"
#include "tests/engine/mapping/bundle/bundle_scene.h"

// Bundle adjustment: one step compared with the arithmetic operations that it needs, and whole adjustments
// compared with Ceres.
namespace docent::bench {
namespace {

using engine::BundleProblem;
using engine::KeyFrameId;

// Multiplications and additions, counted from the formulas: a projection with its Jacobian about 110, with
// the loss and weights 130; a point's 3x3 block and gradient 60; a pose's 6x6 block, gradient and its 6x3
// block with the point 280; elimination 220 for each pair of free cameras that see the same point, and 150
// for each such camera. Back-substitution linearises again and evaluates the residuals (70).
double Operations(const BundleProblem& problem) {
  std::vector<int> free_views(problem.points.size(), 0);
  double operations = 0;
  for (const BundleProblem::Measurement& measurement : problem.measurements) {
    operations += 130 + 60 + 70;
    if (problem.cameras[static_cast<std::size_t>(measurement.camera)].fixed) continue;
    operations += 280 + 130 + 60;
    ++free_views[static_cast<std::size_t>(measurement.point)];
  }
  for (const int views : free_views) operations += 150.0 * views + 110.0 * views * (views + 1);
  const double size = 6.0 * static_cast<double>(problem.cameras.size());
  return operations + size * size * size / 3;
}

BundleProblem MadeUp(int cameras, int fixed, int points) {
  engine::BundleSceneOptions options;
  options.cameras = cameras;
  options.fixed_cameras = fixed;
  options.points = points;
  options.noise_px = 0.5;
  return engine::MakeBundleScene(options).problem;
}

void BundleStep(benchmark::State& state) {
  const BundleProblem problem = MadeUp(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)),
                                       static_cast<int>(state.range(2)));
  engine::BundleSystem system(problem, engine::RobustLoss::kTukey, nullptr);
  for (auto _ : state) benchmark::DoNotOptimize(system.Step(5, 1e-4));
  state.counters["measurements"] = static_cast<double>(problem.measurements.size());
  state.counters["operations"] = benchmark::Counter(
      Operations(problem), benchmark::Counter::kIsIterationInvariantRate, benchmark::Counter::kIs1000);
}
// The ratio of free keyframes of a local adjustment, and a whole map.
BENCHMARK(BundleStep)->Args({28, 20, 2000})->Args({100, 1, 5000})->Unit(benchmark::kMillisecond);

// The problem of these keyframes of a map and the finite points that they see, as AdjustLocally and
// AdjustGlobally state it. Free poses and points have errors of up to 2 and 5 thousandths of the depth, as
// new ones have.
BundleProblem ProblemOf(const engine::MapSnapshot& map, const std::set<KeyFrameId>& free,
                        const std::set<KeyFrameId>& fixed) {
  BundleProblem problem;
  Random random(3);
  std::map<KeyFrameId, int> cameras;
  for (const engine::KeyFrame& keyframe : map.keyframes) {
    if (!free.contains(keyframe.id) && !fixed.contains(keyframe.id)) continue;
    cameras[keyframe.id] = static_cast<int>(problem.cameras.size());
    const bool held = keyframe.fixed || fixed.contains(keyframe.id);
    const double by = held ? 0 : 0.002;
    problem.cameras.push_back(
        {keyframe.camera,
         engine::Rigid3::Exp(engine::RandomTwist(&random, by * keyframe.mean_depth, by)) *
             keyframe.camera_from_map,
         held});
  }
  std::map<engine::MapPointId, std::vector<const engine::Observation*>> seen;
  std::set<engine::MapPointId> adjusted;
  for (const engine::Observation& observation : map.observations) {
    if (!cameras.contains(observation.keyframe) || map.FindPoint(observation.point)->infinite()) continue;
    seen[observation.point].push_back(&observation);
    if (free.contains(observation.keyframe)) adjusted.insert(observation.point);
  }
  for (const engine::MapPointId id : adjusted) {
    const engine::MapPoint& point = *map.FindPoint(id);
    const double depth = (map.FindKeyFrame(point.source_keyframe)->camera_from_map * point.position()).z();
    const auto index = static_cast<int>(problem.points.size());
    problem.points.push_back({point.position() + engine::RandomVector(&random, 0.005 * depth), false});
    for (const engine::Observation* observation : seen[id]) {
      problem.measurements.push_back({cameras[observation->keyframe], index, observation->pixel,
                                      static_cast<float>(1 << observation->level), false});
    }
  }
  return problem;
}

// All keyframes that an adjustment may move.
std::set<KeyFrameId> Localized(const engine::MapSnapshot& map) {
  std::set<KeyFrameId> localized;
  for (const engine::KeyFrame& keyframe : map.keyframes) {
    if (keyframe.kind == engine::KeyFrameKind::kSixDof) localized.insert(keyframe.id);
  }
  return localized;
}

// The ids with the largest counts, of equal ones the lowest.
std::set<KeyFrameId> Largest(const std::map<KeyFrameId, int>& counts, int wanted) {
  std::vector<std::pair<int, KeyFrameId>> sorted;
  for (const auto& [id, count] : counts) sorted.emplace_back(-count, id);
  std::sort(sorted.begin(), sorted.end());
  std::set<KeyFrameId> largest;
  for (const auto& [count, id] : sorted) {
    if (static_cast<int>(largest.size()) < wanted) largest.insert(id);
  }
  return largest;
}

// As AdjustLocally chooses them for the newest keyframe.
BundleProblem LocalProblem(const engine::MapSnapshot& map) {
  const engine::MapAdjustmentOptions options;
  const std::set<KeyFrameId> localized = Localized(map);
  const KeyFrameId newest = *localized.rbegin();
  // How many points each keyframe shares with these.
  const auto sharing_with = [&](const std::set<KeyFrameId>& keyframes) {
    std::set<engine::MapPointId> points;
    for (const engine::Observation& observation : map.observations) {
      if (keyframes.contains(observation.keyframe) && !map.FindPoint(observation.point)->infinite())
        points.insert(observation.point);
    }
    std::map<KeyFrameId, int> shared;
    for (const engine::Observation& observation : map.observations) {
      if (points.contains(observation.point) && localized.contains(observation.keyframe) &&
          !keyframes.contains(observation.keyframe))
        ++shared[observation.keyframe];
    }
    return shared;
  };
  std::set<KeyFrameId> free = Largest(sharing_with({newest}), options.window);
  free.insert(newest);
  return ProblemOf(map, free, Largest(sharing_with(free), options.max_fixed));
}

// The problems, and the iterations that the mapper allows them.
struct NamedProblem {
  std::string name;
  int mapper_iterations = 0;
  BundleProblem problem;
  // The robust threshold that our adjustment ends with when it may converge: Ceres gets it from the start.
  double threshold = 0;
};
constexpr int kProblems = 4;
const NamedProblem& Problem(std::int64_t index) {
  static std::array<NamedProblem, kProblems> problems;
  NamedProblem& named = problems[static_cast<std::size_t>(index)];
  if (!named.name.empty()) return named;
  const engine::MapAdjustmentOptions options;
  const bool local = index % 2 == 0;
  named.mapper_iterations = local ? options.local_iterations : options.global_iterations;
  named.name = local ? "local" : "whole map";
  if (index < 2) {
    named.name += ", " + Sequence().name;
    const engine::MapSnapshot& map = *Sequence().map;
    named.problem = local ? LocalProblem(map) : ProblemOf(map, Localized(map), {});
  } else {
    named.name += ", made up";
    named.problem = local ? MadeUp(28, 20, 2000) : MadeUp(100, 1, 5000);
  }
  BundleProblem converged = named.problem;
  engine::BundleOptions bundle;
  bundle.max_iterations = 100;
  const double sigma = engine::AdjustBundle(bundle, &converged).sigma;
  named.threshold = bundle.threshold_factor * std::max(bundle.min_sigma, sigma);
  return named;
}

// The figure of this name in /proc/self/status, in bytes.
double StatusBytes(const std::string& name) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with(name + ":")) return 1024 * std::stod(line.substr(name.size() + 1));
  }
  return 0;
}

// The resident memory that a call needs at most, beyond what was resident before.
template <typename Call>
double PeakBytes(const Call& call) {
  malloc_trim(0);                                 // memory that was freed before would hide new allocations
  std::ofstream("/proc/self/clear_refs") << "5";  // the peak starts again
  const double before = StatusBytes("VmRSS");
  call();
  return StatusBytes("VmHWM") - before;
}

// Measures a solver, which adjusts a problem and returns its iterations.
template <typename Solve>
void Measure(const NamedProblem& named, const Solve& solve, benchmark::State* state) {
  BundleProblem result = named.problem;
  const double peak = PeakBytes([&] { solve(&result); });
  double iterations = 0;
  for (auto _ : *state) {
    state->PauseTiming();
    result = named.problem;
    state->ResumeTiming();
    iterations = solve(&result);
  }
  auto& counters = state->counters;
  const auto cost = [&](const BundleProblem& problem) {
    const engine::BundleSystem system(problem, engine::RobustLoss::kTukey, nullptr);
    return engine::RobustCost(engine::RobustLoss::kTukey, named.threshold, system.squared_norms());
  };
  counters["iterations"] = iterations;
  counters["peak_kib"] = peak / 1024;
  counters["cost_before"] = cost(named.problem);
  counters["cost"] = cost(result);
  counters["cameras"] = static_cast<double>(named.problem.cameras.size());
  counters["points"] = static_cast<double>(named.problem.points.size());
  counters["measurements"] = static_cast<double>(named.problem.measurements.size());
  state->SetLabel(named.name);
}

bool HasProblem(benchmark::State* state) {
  if (state->range(0) >= 2 || Sequence().map) return true;
  state->SkipWithError("no map could be started on this sequence");
  return false;
}

int MaxIterations(const NamedProblem& named, const benchmark::State& state) {
  return state.range(1) != 0 ? 100 : named.mapper_iterations;
}

// Arguments of the comparison: the problem (local and whole map of the sequence, local and whole map made
// up), and whether to iterate until convergence (at most 100 times) instead of as often as the mapper.
void AdjustWithOurs(benchmark::State& state) {
  if (!HasProblem(&state)) return;
  const NamedProblem& named = Problem(state.range(0));
  engine::BundleOptions options;
  options.max_iterations = MaxIterations(named, state);
  Measure(
      named, [&](BundleProblem* problem) { return engine::AdjustBundle(options, problem).iterations; },
      &state);
}

// With either factorization of the reduced camera system.
void AdjustWithCeres(benchmark::State& state, bool sparse) {
  if (!HasProblem(&state)) return;
  const NamedProblem& named = Problem(state.range(0));
  CeresOptions options;
  options.threshold = named.threshold;
  options.max_iterations = MaxIterations(named, state);
  options.sparse = sparse;
  double prepare_ms = 0;
  Measure(
      named,
      [&](BundleProblem* problem) {
        const CeresSummary summary = SolveWithCeres(options, problem);
        prepare_ms = summary.prepare_ms;
        return summary.iterations;
      },
      &state);
  state.counters["prepare_ms"] = prepare_ms;
}

void Arguments(benchmark::internal::Benchmark* benchmark) {
  benchmark->ArgNames({"problem", "converge"})
      ->ArgsProduct({benchmark::CreateDenseRange(0, kProblems - 1, 1), {0, 1}})
      ->Unit(benchmark::kMillisecond);
}
BENCHMARK(AdjustWithOurs)->Apply(Arguments);
BENCHMARK_CAPTURE(AdjustWithCeres, dense, false)->Apply(Arguments);
BENCHMARK_CAPTURE(AdjustWithCeres, sparse, true)->Apply(Arguments);

}  // namespace
}  // namespace docent::bench
