// SPDX-License-Identifier: Apache-2.0
#include <benchmark/benchmark.h>

#include <array>
#include <vector>

#include "engine/initialization/planar_target.h"
#include "engine/recognition/descriptor_database.h"
#include "engine/vision/features.h"
#include "tests/bench/bench_sequence.h"

// Descriptors, the vocabulary tree that sorts them, the database of a map, and a planar target.
namespace docent::bench {
namespace {

using engine::DescribedKeypoint;
using engine::DescriptorDatabase;

// The described corners of images from the whole sequence.
const std::vector<std::vector<DescribedKeypoint>>& DescribedImages() {
  static const std::vector<std::vector<DescribedKeypoint>> described = [] {
    std::vector<std::vector<DescribedKeypoint>> images;
    const std::size_t step = std::max<std::size_t>(1, Sequence().frames.size() / 50);
    for (std::size_t i = 0; i < Sequence().frames.size(); i += step)
      images.push_back(DescribeCorners(*engine::MakeFeatures(Sequence().frames[i].image)));
    return images;
  }();
  return described;
}

std::vector<engine::Descriptor> DescriptorsOf(const std::vector<DescribedKeypoint>& places) {
  std::vector<engine::Descriptor> descriptors;
  for (const DescribedKeypoint& place : places) descriptors.push_back(place.oriented.descriptor);
  return descriptors;
}

// A database of this many keyframes: copies of those of the sequence.
void AddKeyFrame(engine::KeyFrameId id, DescriptorDatabase* database) {
  const auto& images = DescribedImages();
  const std::vector<DescribedKeypoint>& places = images[id % images.size()];
  for (std::size_t i = 0; i < places.size(); ++i) {
    database->Add({places[i].oriented.descriptor, id, static_cast<engine::MapPointId>(i), places[i].pixel,
                   places[i].level});
  }
}
DescriptorDatabase MakeDatabase(std::int64_t keyframes) {
  DescriptorDatabase database(engine::DefaultVocabulary());
  for (engine::KeyFrameId id = 0; id < keyframes; ++id) AddKeyFrame(id, &database);
  return database;
}

void DescribeACorner(benchmark::State& state) {
  const auto features = engine::MakeFeatures(Sequence().frames.front().image);
  std::size_t next = 0;
  for (auto _ : state) {
    const engine::Corner corner = features->corners[0][next];
    next = next + 1 < features->corners[0].size() ? next + 1 : 0;
    benchmark::DoNotOptimize(engine::Describe(features->levels[0], Eigen::Vector2f(corner.x, corner.y)));
  }
}
BENCHMARK(DescribeACorner)->Unit(benchmark::kMicrosecond);

void DescribeAnImage(benchmark::State& state) {
  const auto features = engine::MakeFeatures(Sequence().frames.front().image);
  std::size_t described = 0;
  for (auto _ : state) described = DescribeCorners(*features).size();
  state.counters["descriptors"] = static_cast<double>(described);
}
BENCHMARK(DescribeAnImage)->Unit(benchmark::kMicrosecond);

void CompareDescriptors(benchmark::State& state) {
  const auto descriptors = DescriptorsOf(DescribedImages().front());
  std::size_t next = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(SquaredDistance(descriptors[0], descriptors[next]));
    next = next + 1 < descriptors.size() ? next + 1 : 0;
  }
}
BENCHMARK(CompareDescriptors);

// Argument: the number of leaves that are searched.
void DescendTheTree(benchmark::State& state) {
  const auto descriptors = DescriptorsOf(DescribedImages().front());
  std::array<std::uint32_t, engine::VocabularyTree::kMaxNearestLeaves> leaves;
  const auto wanted = std::span(leaves).first(static_cast<std::size_t>(state.range(0)));
  std::size_t next = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(engine::DefaultVocabulary().NearestLeaves(descriptors[next], wanted));
    next = next + 1 < descriptors.size() ? next + 1 : 0;
  }
}
BENCHMARK(DescendTheTree)->Arg(1)->Arg(4)->Arg(8);

// Argument: keyframes in the database.
void AddAndRemoveAKeyFrame(benchmark::State& state) {
  DescriptorDatabase database = MakeDatabase(state.range(0));
  for (auto _ : state) {
    AddKeyFrame(1000000, &database);
    database.RemoveKeyFrame(1000000);
  }
  state.counters["entries"] = static_cast<double>(database.size());
}
BENCHMARK(AddAndRemoveAKeyFrame)->Arg(10)->Arg(100)->Arg(1000)->Unit(benchmark::kMicrosecond);

void MatchAnImage(benchmark::State& state) {
  const DescriptorDatabase database = MakeDatabase(state.range(0));
  const auto queries = DescriptorsOf(DescribedImages()[DescribedImages().size() / 2]);
  for (auto _ : state) benchmark::DoNotOptimize(database.FindMatches(queries, {}));
  state.counters["queries"] = static_cast<double>(queries.size());
  state.counters["entries"] = static_cast<double>(database.size());
}
BENCHMARK(MatchAnImage)->Arg(10)->Arg(100)->Unit(benchmark::kMillisecond);

// The sequence's first image as a target, detected in the same image.
void DetectATarget(benchmark::State& state) {
  const cv::Mat& image = Sequence().frames.front().image;
  const engine::PlanarTarget target(image, 1.0);
  const auto features = engine::MakeFeatures(image);
  double found = 0;
  for (auto _ : state) found = target.Detect(*features, *Sequence().camera, 1).has_value();
  state.counters["found"] = found;
}
BENCHMARK(DetectATarget)->Unit(benchmark::kMillisecond);

// Aligns from a pose that is slightly off, as from frame to frame.
void AlignATarget(benchmark::State& state) {
  const cv::Mat& image = Sequence().frames.front().image;
  const engine::PlanarTarget target(image, 1.0);
  const auto features = engine::MakeFeatures(image);
  const auto detection = target.Detect(*features, *Sequence().camera, 1);
  if (!detection) {
    state.SkipWithError("the image is not found in itself");
    return;
  }
  const engine::Rigid3 off(engine::Rotation3::Exp({0.005, -0.005, 0.005}), {0.005, 0.005, 0.005});
  double found = 0;
  for (auto _ : state)
    found = target.Align(*features, *Sequence().camera, off * detection->camera_from_target).has_value();
  state.counters["found"] = found;
}
BENCHMARK(AlignATarget)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace docent::bench
