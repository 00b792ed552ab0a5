// SPDX-License-Identifier: Apache-2.0
#include <benchmark/benchmark.h>

#include <array>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "engine/base/random.h"
#include "engine/recognition/inverted_file.h"
#include "engine/recognition/place_index.h"
#include "engine/vision/features.h"
#include "tests/bench/bench_places.h"
#include "tests/bench/bench_sequence.h"
#include "tests/bench/library_size.h"

// Place recognition among all keyframes of all maps. The maps are those of the simulator's museum and desks:
// the keyframes are from the walks on which each place is mapped, the queries from later visits on other
// paths. Larger libraries contain replicas of these maps: thumbnails are mirrored and changed by noise as
// coarse as their content, and half of each keyframe's words are replaced; 150 or 25 keyframes per map.
// Counters:
//   median_ms, p95_ms       CPU time of a query in milliseconds, its words being given
//   recall_at_1, _5         ratio of the queries whose map is first, or among the first five candidates
//   bytes_a_keyframe        resident memory of the index
// FindChangedPlaces runs the same queries under changes that a visitor causes, with thumbnails and words each
// alone and with both. SearchWords is the search of the inverted file alone. DescribeAQuery is the cost of
// computing the words of a query.
namespace docent::bench {
namespace {

constexpr std::size_t kQuestions = 1000;

void FindPlaces(benchmark::State& state) {
  const Places& places = SimulatedPlaces();
  const double before = ResidentBytes();
  engine::PlaceIndex index;
  FillIndex(static_cast<std::size_t>(state.range(0)), static_cast<std::size_t>(state.range(1)), &index);
  const double bytes = ResidentBytes() - before;
  std::vector<double> milliseconds;
  double total = 0, first = 0, found = 0;
  for (auto _ : state) {
    for (std::size_t i = 0; i < kQuestions; ++i) {
      const Visit& visit = places.visits[i % places.visits.size()];
      const double start = ThreadMilliseconds();
      const auto candidates = index.FindPlaces({visit.view.thumbnail, visit.view.words}, 5, 5, 0);
      milliseconds.push_back(ThreadMilliseconds() - start);
      total += milliseconds.back();
      first += RankOf(candidates, visit.map_key) < 1;
      found += RankOf(candidates, visit.map_key) < 5;
    }
    state.SetIterationTime(1e-3 * total);
  }
  const auto asked = static_cast<double>(milliseconds.size());
  state.counters["keyframes"] = static_cast<double>(index.keyframes());
  state.counters["words_a_keyframe"] =
      static_cast<double>(index.words()) / static_cast<double>(index.keyframes());
  state.counters["bytes_a_keyframe"] = bytes / static_cast<double>(index.keyframes());
  state.counters["recall_at_1"] = first / asked;
  state.counters["recall_at_5"] = found / asked;
  state.counters["median_ms"] = Quantile(&milliseconds, 0.5);
  state.counters["p95_ms"] = Quantile(&milliseconds, 0.95);
}
BENCHMARK(FindPlaces)
    ->ArgNames({"maps", "keyframes_a_map"})
    ->ArgsProduct({{20, 30, 100, 300, 1000}, {kKeyFramesOfAMap}})
    // Museums of small exhibits: the largest needs 7 GB of memory and some minutes.
    ->ArgsProduct({{1'000, 10'000, 100'000}, {25}})
    ->Iterations(1)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);

// Changes that a visitor's camera causes: it rolls, is further away or nearer, is shifted sideways (the rest
// of the image is black), or the light differs.
cv::Mat Changed(const cv::Mat& gray, int change) {
  const auto warped = [&](double angle_deg, double scale, double aside) {
    cv::Mat warp = cv::getRotationMatrix2D({gray.cols / 2.0f, gray.rows / 2.0f}, angle_deg, scale), out;
    warp.at<double>(0, 2) += aside * gray.cols;
    cv::warpAffine(gray, out, warp, gray.size());
    return out;
  };
  cv::Mat out;
  switch (change) {
    case 1:
      return warped(30, 1, 0);
    case 2:
      return warped(90, 1, 0);
    case 3:
      return warped(0, 1.4, 0);
    case 4:
      return warped(0, 0.7, 0);
    case 5:
      return warped(0, 1, 0.4);
    case 6:
      gray.convertTo(out, CV_8U, 0.35);
      return out;
    case 7:
      gray.convertTo(out, CV_8U, 1.8, 30);
      return out;
    case 8:
      cv::blur(gray, out, {21, 1});
      return out;
    default:
      return gray;
  }
}

void FindChangedPlaces(benchmark::State& state) {
  constexpr std::array kNames = {"as it is",
                                 "rolled by 30 degrees",
                                 "rolled by 90 degrees",
                                 "1.4 times nearer",
                                 "1.4 times further",
                                 "shifted by 0.4 of the width",
                                 "dark",
                                 "bright, partly white",
                                 "blurred by 21 pixels of motion"};
  const Places& places = SimulatedPlaces();
  const auto change = static_cast<int>(state.range(0));
  engine::PlaceIndex index;
  FillIndex(static_cast<std::size_t>(state.range(1)), kKeyFramesOfAMap, &index);
  const engine::SmallBlurryImage nothing;
  std::array<double, 3> first{}, found{};
  for (auto _ : state) {
    for (const Visit& visit : places.visits) {
      const View view = ViewOf(Changed(visit.gray, change));
      const std::array<engine::PlaceQuery, 3> queries = {
          engine::PlaceQuery(view.thumbnail), {nothing, view.words}, {view.thumbnail, view.words}};
      for (std::size_t i = 0; i < queries.size(); ++i) {
        const std::size_t rank = RankOf(index.FindPlaces(queries[i], 5, 5, 0), visit.map_key);
        first[i] += rank < 1;
        found[i] += rank < 5;
      }
    }
  }
  const auto asked = static_cast<double>(state.iterations() * places.visits.size());
  constexpr std::array kWays = {"thumbnails", "words", "both"};
  for (std::size_t i = 0; i < kWays.size(); ++i) {
    state.counters[std::string(kWays[i]) + "_at_1"] = first[i] / asked;
    state.counters[std::string(kWays[i]) + "_at_5"] = found[i] / asked;
  }
  state.SetLabel(kNames[static_cast<std::size_t>(change)]);
}
BENCHMARK(FindChangedPlaces)
    ->ArgNames({"change", "maps"})
    ->ArgsProduct({benchmark::CreateDenseRange(0, 8, 1), {30, 300}})
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);

void DescribeAQuery(benchmark::State& state) {
  const auto features = engine::MakeFeatures(SimulatedPlaces().visits.front().gray);
  std::size_t words = 0;
  for (auto _ : state) words = engine::MakeWordBag(*features).size();
  state.counters["words"] = static_cast<double>(words);
}
BENCHMARK(DescribeAQuery)->Unit(benchmark::kMillisecond);

// The postings that a query reads from the inverted file: the search by words alone.
void SearchWords(benchmark::State& state) {
  const Places& places = SimulatedPlaces();
  Random random(7);
  engine::InvertedFile file;
  for (engine::KeyFrameId i = 0; static_cast<std::int64_t>(file.size()) < state.range(0) * 150; ++i) {
    for (const auto& [key, views] : places.maps)
      file.Add(Replica(views[i % views.size()].words, &random), {key, i});
  }
  std::vector<double> postings;
  std::size_t next = 0;
  for (auto _ : state) {
    engine::InvertedFile::Cost cost;
    benchmark::DoNotOptimize(file.Search(places.visits[next].view.words, 64, &cost));
    postings.push_back(static_cast<double>(cost.postings));
    next = next + 1 < places.visits.size() ? next + 1 : 0;
  }
  state.counters["postings"] = Quantile(&postings, 0.5);
  state.counters["keyframes"] = static_cast<double>(file.size());
}
BENCHMARK(SearchWords)
    ->ArgName("maps")
    ->Arg(30)
    ->Arg(100)
    ->Arg(300)
    ->Arg(1000)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace docent::bench
