// SPDX-License-Identifier: Apache-2.0
#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "engine/mapping/bundle/map_adjustment.h"
#include "engine/matching/point_search.h"
#include "engine/matching/pose_refinement.h"
#include "engine/vision/fast_corners.h"
#include "engine/vision/features.h"
#include "engine/vision/lanes.h"
#include "engine/vision/patch.h"
#include "engine/vision/rotation_alignment.h"
#include "tests/bench/bench_sequence.h"

// The components of tracking a frame and of inserting a keyframe, each alone.
namespace docent::bench {
namespace {

bool HasMap(benchmark::State* state) {
  if (Sequence().map) return true;
  state->SkipWithError("no map could be started on this sequence");
  return false;
}

void ExtractFeatures(benchmark::State& state) {
  const BenchSequence& sequence = Sequence();
  engine::ImageFeatures features;
  std::size_t next = 0;
  for (auto _ : state) {
    const auto hint = features.fast_threshold;
    engine::ExtractFeatures(sequence.frames[next].image, {}, hint, &features);
    next = (next + 1) % sequence.frames.size();
  }
}
BENCHMARK(ExtractFeatures)->Unit(benchmark::kMicrosecond);

void AlignRotation(benchmark::State& state) {
  const BenchSequence& sequence = Sequence();
  std::vector<engine::SmallBlurryImage> thumbnails;
  for (const engine::Frame& frame : sequence.frames) {
    thumbnails.push_back(engine::MakeSmallBlurryImage(frame.image));
    if (thumbnails.size() == 100) break;
  }
  std::size_t next = 1;
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        engine::AlignRotation(thumbnails[next - 1], *sequence.camera, thumbnails[next], *sequence.camera));
    next = next + 1 < thumbnails.size() ? next + 1 : 1;
  }
}
BENCHMARK(AlignRotation)->Unit(benchmark::kMicrosecond);

// Searches a point of the map in a tracked frame, near its prediction.
void PredictAndFindAPoint(benchmark::State& state) {
  if (!HasMap(&state)) return;
  const BenchSequence& sequence = Sequence();
  std::size_t index = sequence.tracked.size() / 2;
  while (index < sequence.tracked.size() && !HasPose(sequence.tracked[index].state)) ++index;
  if (index == sequence.tracked.size()) {
    state.SkipWithError("no frame was tracked in the second half of this sequence");
    return;
  }
  const auto features = engine::MakeFeatures(sequence.frames[index].image);
  const engine::Rigid3& pose = sequence.tracked[index].camera_from_map;
  engine::PointSearcher searcher;
  std::size_t next = 0;
  double searched = 0, found = 0;
  for (auto _ : state) {
    std::optional<engine::PredictedPoint> predicted;
    while (!predicted) {
      const engine::MapPoint& point = sequence.map->points[next];
      next = (next + 1) % sequence.map->points.size();
      const engine::KeyFrame& source = *sequence.map->FindKeyFrame(point.source_keyframe);
      predicted = searcher.Predict(point, source, *sequence.camera, pose);
      if (!predicted) continue;
      ++searched;
      found += searcher.Find(point, source, *predicted, *features, 7, true).has_value();
    }
  }
  state.counters["found"] = searched > 0 ? found / searched : 0;
}
BENCHMARK(PredictAndFindAPoint)->Unit(benchmark::kMicrosecond);

// True if any of these pixels passes the first test of the corner detector.
bool PassesFirstTest(const cv::Mat& image, int y, int begin, int end, int threshold) {
  for (int x = begin; x < end; ++x) {
    const auto at = [&](int dx, int dy) { return static_cast<int>(image.at<std::uint8_t>(y + dy, x + dx)); };
    const int center = at(0, 0), top = at(0, -3), bottom = at(0, 3), left = at(-3, 0), right = at(3, 0);
    const int bright = std::min(std::max(top, bottom), std::max(left, right)) - center;
    const int dark = center - std::max(std::min(top, bottom), std::min(left, right));
    if (std::max(bright, dark) > threshold) return true;
  }
  return false;
}

// Per image. "operations" counts the operations on a vector of bytes that the test needs at least: five
// loads, nine comparisons and differences, a branch and a store for each block; and for a block that passes
// the first test twelve loads, 46 minima and maxima for the strongest bright arc, as many for the dark one,
// and seven more.
void DetectCorners(benchmark::State& state) {
  const BenchSequence& sequence = Sequence();
  const auto features = engine::MakeFeatures(sequence.frames[sequence.frames.size() / 2].image);
  constexpr int kMargin = 6;
  double operations = 0;
  for (std::size_t level = 0; level < engine::kPyramidLevels; ++level) {
    const cv::Mat& image = features->levels[level];
    for (int y = kMargin; y < image.rows - kMargin; ++y) {
      for (int x = kMargin; x < image.cols - kMargin; x += engine::kByteLanes) {
        const int end = std::min(x + engine::kByteLanes, image.cols - kMargin);
        operations += PassesFirstTest(image, y, x, end, features->fast_threshold[level]) ? 16 + 111 : 16;
      }
    }
  }
  std::vector<engine::Corner> corners;
  std::vector<int> row_begin;
  for (auto _ : state) {
    for (std::size_t level = 0; level < engine::kPyramidLevels; ++level)
      engine::DetectFastCorners(features->levels[level], features->fast_threshold[level], kMargin, &corners,
                                &row_begin);
  }
  state.counters["operations"] =
      benchmark::Counter(operations, benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(DetectCorners)->Unit(benchmark::kMicrosecond);

struct CornersOfAnImage {
  cv::Mat image;
  std::vector<Eigen::Vector2f> corners;  // around which a patch fits
};
CornersOfAnImage SomeCorners() {
  const BenchSequence& sequence = Sequence();
  const auto features = engine::MakeFeatures(sequence.frames[sequence.frames.size() / 2].image);
  CornersOfAnImage some{features->levels[0], {}};
  for (const engine::Corner& corner : features->corners[0]) {
    const Eigen::Vector2f pixel(corner.x, corner.y);
    if (engine::PatchFits(some.image, pixel.x(), pixel.y(), 12)) some.corners.push_back(pixel);
  }
  return some;
}

Eigen::Matrix2f SomeWarp() {
  Eigen::Matrix2f warp;
  warp << 1.1f, 0.15f, -0.1f, 0.9f;
  return warp;
}

// "operations": 100 bilinear samples of 22 scalar operations; eight rows of 16 vector operations and eight of
// 14 for the integer sums; 100 for the sums of gradients and the matrix.
void CutAPatch(benchmark::State& state) {
  const CornersOfAnImage some = SomeCorners();
  const Eigen::Matrix2f warp = SomeWarp();
  engine::PatchTemplate patch;
  std::size_t next = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(engine::CutPatch(some.image, some.corners[next], warp, &patch));
    next = (next + 1) % some.corners.size();
  }
  state.counters["operations"] =
      benchmark::Counter(100 * 22 + 8 * 16 + 8 * 14 + 100, benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(CutAPatch)->Unit(benchmark::kNanosecond);

// Starts at the solution: one iteration that finds no step to take, and the final measurement. "operations"
// on vectors of eight: 8 for the first row and 26 for each of eight, 40 for the five totals, 40 for the step.
void AlignAPatch(benchmark::State& state) {
  const CornersOfAnImage some = SomeCorners();
  const Eigen::Matrix2f warp = SomeWarp();
  std::vector<std::pair<engine::PatchTemplate, Eigen::Vector2f>> patches;
  for (const Eigen::Vector2f& corner : some.corners) {
    engine::PatchTemplate patch;
    if (!engine::CutPatch(some.image, corner, warp, &patch)) continue;
    if (const auto aligned = engine::AlignPatch(patch, some.image, corner))
      patches.emplace_back(patch, aligned->pixel);
  }
  if (patches.empty()) {
    state.SkipWithError("no patch could be aligned");
    return;
  }
  std::size_t next = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(engine::AlignPatch(patches[next].first, some.image, patches[next].second));
    next = (next + 1) % patches.size();
  }
  state.counters["operations"] =
      benchmark::Counter(2 * (8 + 8 * 26 + 40 + 40), benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(AlignAPatch)->Unit(benchmark::kNanosecond);

// The pose of an image from 500 points of which 50 are wrong. state.range(0): whether the camera turns while
// a rolling shutter exposes the image.
void RefineAPose(benchmark::State& state) {
  const auto lens = std::make_shared<engine::CameraModel>(
      engine::LensModel::kRadialTangential, engine::CameraModel::Intrinsics{640, 480, 520, 520, 320, 240},
      std::array<double, 5>{0.1, -0.2, 0.001, -0.001, 0.05});
  const Eigen::Vector3d rate(0.3, -0.5, 0.2);  // radians per second
  const auto camera = engine::CameraModel::WithReadout(
      lens, {state.range(0) != 0 ? rate : Eigen::Vector3d::Zero(), Eigen::Vector2d(0, 0.02)});
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<engine::PoseMeasurement> measurements;
  while (measurements.size() < 500) {
    const double depth = 2 + uniform(random);
    const Eigen::Vector3d point(0.5 * depth * uniform(random), 0.4 * depth * uniform(random), depth);
    const auto pixel = camera.Project(point);
    if (!pixel) continue;
    const double noise_px = measurements.size() % 10 == 0 ? 8 : 0.5;
    engine::PoseMeasurement measurement;
    measurement.point_in_map = point.homogeneous();
    measurement.pixel = *pixel + noise_px * Eigen::Vector2d(uniform(random), uniform(random));
    measurements.push_back(measurement);
  }
  Eigen::Matrix<double, 6, 1> twist;  // the error of a prediction
  twist << 0.01, 0.02, -0.01, 0.004, -0.003, 0.002;
  const engine::Rigid3 predicted = engine::Rigid3::Exp(twist);
  engine::PoseRefinementMemory memory;
  for (auto _ : state)
    benchmark::DoNotOptimize(engine::RefinePose(camera, predicted, {}, &measurements, &memory,
                                                {Eigen::Vector3d::Zero(), predicted}));
}
BENCHMARK(RefineAPose)->ArgName("rolling")->Arg(0)->Arg(1)->Unit(benchmark::kMicrosecond);

void AdjustLocally(benchmark::State& state) {
  if (!HasMap(&state)) return;
  const engine::MapSnapshot& snapshot = *Sequence().map;
  const engine::KeyFrameId newest = snapshot.keyframes.back().id;
  for (auto _ : state) {
    state.PauseTiming();
    engine::Map map(snapshot);
    // The typical error of a new keyframe's initial pose.
    engine::Rigid3& pose = map.FindKeyFrame(newest)->keyframe.camera_from_map;
    pose.translation.x() += 0.002 * map.FindKeyFrame(newest)->keyframe.mean_depth;
    state.ResumeTiming();
    benchmark::DoNotOptimize(engine::AdjustLocally({}, newest, nullptr, &map));
  }
  state.counters["keyframes"] = static_cast<double>(snapshot.keyframes.size());
  state.counters["points"] = static_cast<double>(snapshot.points.size());
}
BENCHMARK(AdjustLocally)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace docent::bench
