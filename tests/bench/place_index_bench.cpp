// SPDX-License-Identifier: Apache-2.0
#include <benchmark/benchmark.h>
#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "app/simulator/simulation.h"
#include "engine/base/random.h"
#include "maps/place_index.h"
#include "tests/bench/bench_sequence.h"

// The search for a place among all keyframes of all maps. The maps are those of the simulator's museum and
// desks: keyframes from where each place is built, questions from where it is visited later, by another way.
// Larger libraries hold the same maps again, mirrored and under noise as coarse as what a thumbnail shows,
// 150 keyframes a map. The counters:
//   median_ms, p95_ms       a question, in milliseconds of computing
//   recall_at_5             part of the questions whose place is among the first five candidates
//   bytes_a_keyframe        resident memory that the index takes
namespace docent::bench {
namespace {

constexpr std::size_t kKeyFramesOfAMap = 150;
constexpr std::size_t kQuestions = 1000;

struct View {
  std::uint64_t map_key = 0;
  engine::SmallBlurryImage thumbnail;
};
struct Places {
  std::map<std::uint64_t, std::vector<engine::SmallBlurryImage>> maps;  // by key
  std::vector<View> visits;
};

// Every fourth frame of building is a keyframe and every eighth of visiting a question.
void AddScene(const std::string& name, std::uint64_t first_key, Places* places) {
  const auto simulation = app::MakeSimulation(name);
  for (int frame = 0; frame < simulation->frame_count(); frame += 4) {
    const std::string& label = simulation->label(frame);
    const bool build = label.starts_with("build"), visit = label.starts_with("visit");
    if (!build && !(visit && frame % 8 == 0)) continue;
    cv::Mat bgr, gray;
    simulation->Render(frame, &bgr);
    cv::cvtColor(bgr, gray, cv::COLOR_BGR2GRAY);
    const std::uint64_t key = first_key + std::stoul(label.substr(5));
    if (build) {
      places->maps[key].push_back(engine::MakeSmallBlurryImage(gray));
    } else {
      places->visits.push_back({key, engine::MakeSmallBlurryImage(gray)});
    }
  }
}

const Places& SimulatedPlaces() {
  static const Places places = [] {
    cv::setNumThreads(1);
    Places made;
    AddScene("museum", 1, &made);
    AddScene("desks", 101, &made);
    return made;
  }();
  return places;
}

// The same view of another place: mirrored, and half of what it shows is something else.
engine::SmallBlurryImage Replica(const engine::SmallBlurryImage& image, bool mirrored, Random* random) {
  constexpr int kCell = 6;  // thumbnail pixels, as the blur
  cv::Mat cells(image.pixels.rows / kCell, image.pixels.cols / kCell, CV_32FC1), noise;
  for (int y = 0; y < cells.rows; ++y) {
    for (int x = 0; x < cells.cols; ++x) cells.at<float>(y, x) = static_cast<float>(random->Uniform(-1, 1));
  }
  cv::resize(cells, noise, image.pixels.size(), 0, 0, cv::INTER_CUBIC);
  cv::Scalar mean, deviation, noise_mean, noise_deviation;
  cv::meanStdDev(image.pixels, mean, deviation);
  cv::meanStdDev(noise, noise_mean, noise_deviation);
  engine::SmallBlurryImage replica;
  replica.scale = image.scale;
  if (mirrored) {
    cv::flip(image.pixels, replica.pixels, 1);
  } else {
    replica.pixels = image.pixels.clone();
  }
  replica.pixels += noise * (deviation[0] / noise_deviation[0]);
  return replica;
}

// Keys of the simulated places as they are, and replicas of them from 1000 on, each filled up to a map's
// size.
void FillIndex(std::size_t maps, maps::PlaceIndex* index) {
  const Places& places = SimulatedPlaces();
  Random random(7);
  index->Reserve(maps * kKeyFramesOfAMap);
  std::size_t made = 0;
  while (made < maps) {
    const std::size_t round = made / places.maps.size();
    for (const auto& [key, thumbnails] : places.maps) {
      if (made == maps) break;
      std::vector<maps::KeyFrameThumbnail> map;
      for (std::size_t i = 0; i < kKeyFramesOfAMap; ++i) {
        const engine::SmallBlurryImage& original = thumbnails[i % thumbnails.size()];
        const bool original_itself = round == 0 && i < thumbnails.size();
        map.push_back({static_cast<engine::KeyFrameId>(i),
                       maps::Pack(original_itself ? original : Replica(original, round % 2 == 1, &random))});
      }
      index->SetThumbnails(round == 0 ? key : 1000 * round + key, map);
      ++made;
    }
  }
}

double ResidentBytes() {
  malloc_trim(0);  // what was freed before would hide what is taken now
  std::ifstream file("/proc/self/statm");
  double total = 0, resident = 0;
  file >> total >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

bool HasPlace(const std::vector<engine::PlaceCandidate>& candidates, std::uint64_t key) {
  return std::any_of(candidates.begin(), candidates.end(),
                     [&](const auto& candidate) { return candidate.map_key == key; });
}

void FindPlaces(benchmark::State& state) {
  const Places& places = SimulatedPlaces();
  const double before = ResidentBytes();
  maps::PlaceIndex index;
  FillIndex(static_cast<std::size_t>(state.range(0)), &index);
  const double bytes = ResidentBytes() - before;
  std::vector<double> milliseconds;
  double total = 0, found = 0;
  for (auto _ : state) {
    for (std::size_t i = 0; i < kQuestions; ++i) {
      const View& view = places.visits[i % places.visits.size()];
      const double start = ThreadMilliseconds();
      const auto candidates = index.FindPlaces(view.thumbnail, 5, 5, 0);
      milliseconds.push_back(ThreadMilliseconds() - start);
      total += milliseconds.back();
      found += HasPlace(candidates, view.map_key);
    }
    state.SetIterationTime(1e-3 * total);
  }
  const auto asked = static_cast<double>(milliseconds.size());
  state.counters["keyframes"] = static_cast<double>(index.keyframes());
  state.counters["bytes_a_keyframe"] = bytes / static_cast<double>(index.keyframes());
  state.counters["recall_at_5"] = found / asked;
  state.counters["median_ms"] = Quantile(&milliseconds, 0.5);
  state.counters["p95_ms"] = Quantile(&milliseconds, 0.95);
}
BENCHMARK(FindPlaces)
    ->ArgName("maps")
    ->Arg(20)
    ->Arg(30)
    ->Arg(100)
    ->Arg(300)
    ->Arg(1000)
    ->Iterations(1)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace docent::bench
