// SPDX-License-Identifier: Apache-2.0
#include <benchmark/benchmark.h>
#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <map>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "app/simulator/simulation.h"
#include "engine/base/random.h"
#include "engine/recognition/inverted_file.h"
#include "engine/recognition/place_index.h"
#include "engine/vision/features.h"
#include "tests/bench/bench_sequence.h"
#include "tests/bench/library_size.h"

// Place recognition among all keyframes of all maps. The maps are those of the simulator's museum and desks:
// the keyframes are from the walks on which each place is mapped, the queries from later visits on other
// paths. Larger libraries contain replicas of these maps: thumbnails are mirrored and changed by noise as
// coarse as their content, and half of each keyframe's words are replaced; 150 keyframes per map. Counters:
//   median_ms, p95_ms       CPU time of a query in milliseconds, its words being given
//   recall_at_1, _5         ratio of the queries whose map is first, or among the first five candidates
//   bytes_a_keyframe        resident memory of the index
// FindChangedPlaces runs the same queries under changes that a visitor causes, with thumbnails and words each
// alone and with both. SearchWords is the search of the inverted file alone. DescribeAQuery is the cost of
// computing the words of a query.
namespace docent::bench {
namespace {

constexpr std::size_t kQuestions = 1000;

struct View {
  engine::SmallBlurryImage thumbnail;
  engine::WordBag words;
};
struct Visit {
  std::uint64_t map_key = 0;
  cv::Mat gray;
  View view;
};
struct Places {
  std::map<std::uint64_t, std::vector<View>> maps;  // by key
  std::vector<Visit> visits;
};

View ViewOf(const cv::Mat& gray) {
  const auto features = engine::MakeFeatures(gray);
  return {features->small_blurry, engine::MakeWordBag(*features)};
}

// Every fourth frame of a mapping walk is a keyframe, and every eighth of a visit a query.
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
      places->maps[key].push_back(ViewOf(gray));
    } else {
      places->visits.push_back({key, gray, ViewOf(gray)});
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

// A replica of a view as another place: mirrored, and half of its content replaced.
engine::SmallBlurryImage Replica(const engine::SmallBlurryImage& image, bool mirrored, Random* random) {
  constexpr int kCell = 6;  // thumbnail pixels, as large as the blur
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

// Keeps half of the words and adds as many from other keyframes, common ones more often.
engine::WordBag Replica(const engine::WordBag& words, Random* random) {
  static const std::vector<std::uint32_t> all = [] {
    std::vector<std::uint32_t> leaves;
    for (const auto& [key, views] : SimulatedPlaces().maps) {
      for (const View& view : views) {
        for (const engine::VisualWord& word : view.words)
          leaves.insert(leaves.end(), static_cast<std::size_t>(word.count()), word.leaf());
      }
    }
    return leaves;
  }();
  std::vector<std::uint32_t> leaves;
  for (const engine::VisualWord& word : words) {
    for (int i = 0; i < word.count(); ++i) {
      const std::uint32_t other = all[random->Below(static_cast<std::uint32_t>(all.size()))];
      leaves.push_back(random->Below(2) == 0 ? word.leaf() : other);
    }
  }
  return engine::MakeWordBag(std::move(leaves));
}

// The simulated places with their own keys, and replicas of them with keys from 1000 on, each filled up to
// the size of a map.
void FillIndex(std::size_t maps, engine::PlaceIndex* index) {
  const Places& places = SimulatedPlaces();
  Random random(7);
  index->Reserve(maps * kKeyFramesOfAMap);
  std::size_t made = 0;
  while (made < maps) {
    const std::size_t round = made / places.maps.size();
    for (const auto& [key, views] : places.maps) {
      if (made == maps) break;
      std::vector<engine::KeyFrameThumbnail> thumbnails;
      std::vector<engine::KeyFrameWords> words;
      for (std::size_t i = 0; i < kKeyFramesOfAMap; ++i) {
        const auto id = static_cast<engine::KeyFrameId>(i);
        const View& original = views[i % views.size()];
        const bool itself = round == 0 && i < views.size();
        thumbnails.push_back(
            {id, engine::Pack(itself ? original.thumbnail
                                     : Replica(original.thumbnail, round % 2 == 1, &random))});
        // Five consecutive keyframes form a place.
        words.push_back({id, id / 5 * 5, itself ? original.words : Replica(original.words, &random)});
      }
      index->SetAppearance(round == 0 ? key : 1000 * round + key, thumbnails, words);
      ++made;
    }
  }
}

double ResidentBytes() {
  malloc_trim(0);  // memory that was freed before would hide new allocations
  std::ifstream file("/proc/self/statm");
  double total = 0, resident = 0;
  file >> total >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

// The rank of a map among the candidates; 1000 if it is not among them.
std::size_t RankOf(const std::vector<engine::PlaceCandidate>& candidates, std::uint64_t key) {
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (candidates[i].map_key == key) return i;
  }
  return 1000;
}

void FindPlaces(benchmark::State& state) {
  const Places& places = SimulatedPlaces();
  const double before = ResidentBytes();
  engine::PlaceIndex index;
  FillIndex(static_cast<std::size_t>(state.range(0)), &index);
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
    ->ArgName("maps")
    ->Arg(20)
    ->Arg(30)
    ->Arg(100)
    ->Arg(300)
    ->Arg(1000)
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
  FillIndex(static_cast<std::size_t>(state.range(1)), &index);
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
