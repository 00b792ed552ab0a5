// SPDX-License-Identifier: Apache-2.0
#include <benchmark/benchmark.h>
#include <faiss/IndexFlat.h>
#include <faiss/IndexHNSW.h>
#include <faiss/IndexIVFPQ.h>
#include <omp.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "engine/recognition/thumbnail_array.h"
#include "tests/bench/bench_places.h"
#include "tests/bench/bench_sequence.h"

// The scan of all thumbnails (ThumbnailArray) beside approximate searches of FAISS for the same thumbnails,
// on one thread. It is built only where FAISS is installed, of which the program itself needs nothing. The
// scan compares each thumbnail at all shifts of up to a sixth of the image; the others see the pixels as one
// vector and know no shifts. Counters:
//   build_s                of the index, without making the thumbnails
//   median_ms, p95_ms      CPU time of a query
//   bytes_a_keyframe       resident memory of the index
//   map_at_5               ratio of the queries whose map is among the first five maps
//   scan_at_5              ratio of the queries whose first map by the scan is among the first five maps
namespace docent::bench {
namespace {

constexpr std::size_t kKeyFrames = 25;  // Of a map.
constexpr std::size_t kMostAsked = 200, kHits = 64;

// The thumbnails of many maps and of some visits.
struct Thumbnails {
  std::size_t dimensions = 0;
  std::unique_ptr<engine::ThumbnailArray> array;
  std::vector<std::uint64_t> keys;  // Of the maps, by slot.
  std::vector<engine::PackedThumbnail> asked;
  std::vector<std::uint64_t> answers;
};

std::vector<float> VectorOf(const engine::PackedThumbnail& thumbnail) {
  return {thumbnail.pixels.begin(), thumbnail.pixels.end()};
}

// Gives the vectors of all maps in blocks, so that they are never all in memory.
using AddVectors = std::function<void(const std::vector<float>& vectors, std::size_t count)>;

double SecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// The first five maps of some slots, best first.
std::vector<std::uint64_t> FirstMaps(const std::vector<std::size_t>& slots,
                                     const std::vector<std::uint64_t>& keys) {
  std::vector<std::uint64_t> maps;
  for (const std::size_t slot : slots) {
    if (slot >= keys.size() || std::find(maps.begin(), maps.end(), keys[slot]) != maps.end()) continue;
    maps.push_back(keys[slot]);
    if (maps.size() == 5) break;
  }
  return maps;
}

Thumbnails MakeThumbnails(std::size_t maps) {
  Thumbnails made;
  MakeMaps(maps, kKeyFrames,
           [&](std::uint64_t key, const std::vector<engine::KeyFrameThumbnail>& thumbnails,
               const std::vector<engine::KeyFrameWords>& /*words*/) {
             for (const engine::KeyFrameThumbnail& view : thumbnails) {
               const engine::PackedThumbnail& thumbnail = view.thumbnail;
               if (!made.array) {
                 made.array = std::make_unique<engine::ThumbnailArray>(thumbnail.width, thumbnail.height,
                                                                       maps * kKeyFrames);
                 made.dimensions = thumbnail.pixels.size();
               }
               made.array->Append(thumbnail, {key, view.keyframe});
               made.keys.push_back(key);
             }
           });
  for (const Visit& visit : SimulatedPlaces().visits) {
    if (made.asked.size() == kMostAsked) break;
    made.asked.push_back(engine::Pack(visit.view.thumbnail));
    made.answers.push_back(visit.map_key);
  }
  return made;
}

// The vectors of the maps, which are made anew.
void GiveVectors(std::size_t maps, const AddVectors& add) {
  constexpr std::size_t kBlock = 1000;  // Maps.
  std::vector<float> block;
  std::size_t count = 0;
  const auto flush = [&] {
    if (count > 0) add(block, count);
    block.clear();
    count = 0;
  };
  MakeMaps(maps, kKeyFrames,
           [&](std::uint64_t /*key*/, const std::vector<engine::KeyFrameThumbnail>& thumbnails,
               const std::vector<engine::KeyFrameWords>& /*words*/) {
             for (const engine::KeyFrameThumbnail& view : thumbnails) {
               block.insert(block.end(), view.thumbnail.pixels.begin(), view.thumbnail.pixels.end());
               ++count;
             }
             if (count >= kBlock * kKeyFrames) flush();
           });
  flush();
}

std::unique_ptr<faiss::Index> MakeIndex(const std::string& kind, std::size_t dimensions,
                                        std::size_t keyframes, std::unique_ptr<faiss::Index>* quantizer) {
  constexpr std::size_t kSubvectors = 60;  // Of 20 pixels each, one byte.
  constexpr int kNeighbours = 32, kBits = 8;
  const auto d = static_cast<faiss::Index::idx_t>(dimensions);
  if (kind == "HNSW")
    return std::make_unique<faiss::IndexHNSWSQ>(static_cast<int>(d), faiss::ScalarQuantizer::QT_8bit,
                                                kNeighbours);
  *quantizer = std::make_unique<faiss::IndexFlatL2>(d);
  const auto lists = static_cast<std::size_t>(std::sqrt(static_cast<double>(keyframes)));
  auto index = std::make_unique<faiss::IndexIVFPQ>(quantizer->get(), dimensions, lists, kSubvectors, kBits);
  index->nprobe = std::max<std::size_t>(8, lists / 16);
  return index;
}

struct Answers {
  std::vector<double> milliseconds;
  double map = 0, scan = 0;  // Numbers of the queries that were answered so.
};

void Report(Answers answers, double build_s, double bytes, std::size_t keyframes, benchmark::State* state) {
  const auto asked = static_cast<double>(answers.milliseconds.size());
  state->counters["keyframes"] = static_cast<double>(keyframes);
  state->counters["build_s"] = build_s;
  state->counters["bytes_a_keyframe"] = bytes / static_cast<double>(keyframes);
  state->counters["map_at_5"] = answers.map / asked;
  state->counters["scan_at_5"] = answers.scan / asked;
  state->counters["median_ms"] = Quantile(&answers.milliseconds, 0.5);
  state->counters["p95_ms"] = Quantile(&answers.milliseconds, 0.95);
}

std::vector<std::size_t> SlotsOf(const std::vector<engine::ThumbnailArray::Hit>& hits) {
  std::vector<std::size_t> slots;
  for (const auto& hit : hits) slots.push_back(hit.slot);
  return slots;
}

void Count(const std::vector<std::uint64_t>& maps, std::uint64_t answer, std::uint64_t scanned,
           Answers* answers) {
  answers->map += std::find(maps.begin(), maps.end(), answer) != maps.end();
  answers->scan += std::find(maps.begin(), maps.end(), scanned) != maps.end();
}

void SearchThumbnails(benchmark::State& state, const std::string& kind) {
  omp_set_num_threads(1);
  const auto maps = static_cast<std::size_t>(state.range(0));
  const double before = ResidentBytes();
  Thumbnails all = MakeThumbnails(maps);
  double bytes = ResidentBytes() - before, build_s = 0;
  std::unique_ptr<faiss::Index> quantizer, index;
  if (kind != "scan") {
    index = MakeIndex(kind, all.dimensions, all.keys.size(), &quantizer);
    const double array_bytes = ResidentBytes();
    std::vector<float> training;
    GiveVectors(std::min<std::size_t>(maps, 2000),
                [&](const std::vector<float>& vectors, std::size_t /*count*/) {
                  training.insert(training.end(), vectors.begin(), vectors.end());
                });
    auto start = std::chrono::steady_clock::now();
    index->train(static_cast<faiss::Index::idx_t>(training.size() / all.dimensions), training.data());
    build_s = SecondsSince(start);
    training = {};
    GiveVectors(maps, [&](const std::vector<float>& vectors, std::size_t count) {
      start = std::chrono::steady_clock::now();
      index->add(static_cast<faiss::Index::idx_t>(count), vectors.data());
      build_s += SecondsSince(start);
    });
    bytes = ResidentBytes() - array_bytes;
  }
  Answers answers;
  for (auto _ : state) {
    double total = 0;
    for (std::size_t i = 0; i < all.asked.size(); ++i) {
      double start = ThreadMilliseconds();
      std::vector<std::size_t> slots = SlotsOf(all.array->Search(all.asked[i], all.keys.size(), kHits));
      const std::vector<std::uint64_t> scanned = FirstMaps(slots, all.keys);
      if (index) {
        const std::vector<float> vector = VectorOf(all.asked[i]);
        std::vector<float> distances(kHits);
        std::vector<faiss::Index::idx_t> labels(kHits, -1);
        start = ThreadMilliseconds();
        index->search(1, vector.data(), kHits, distances.data(), labels.data());
        slots.assign(labels.begin(), labels.end());
      }
      answers.milliseconds.push_back(ThreadMilliseconds() - start);
      total += answers.milliseconds.back();
      Count(FirstMaps(slots, all.keys), all.answers[i], scanned.empty() ? 0 : scanned.front(), &answers);
    }
    state.SetIterationTime(1e-3 * total);
  }
  Report(std::move(answers), build_s, bytes, all.keys.size(), &state);
}

void Sizes(benchmark::internal::Benchmark* bench) {
  bench->ArgName("maps")->Iterations(1)->UseManualTime()->Unit(benchmark::kMillisecond);
}
BENCHMARK_CAPTURE(SearchThumbnails, scan, std::string("scan"))
    ->Apply(Sizes)
    ->Arg(1'000)
    ->Arg(10'000)
    ->Arg(100'000);
BENCHMARK_CAPTURE(SearchThumbnails, IVF_PQ, std::string("IVF-PQ"))
    ->Apply(Sizes)
    ->Arg(1'000)
    ->Arg(10'000)
    ->Arg(100'000);
BENCHMARK_CAPTURE(SearchThumbnails, HNSW, std::string("HNSW"))->Apply(Sizes)->Arg(1'000)->Arg(10'000);

}  // namespace
}  // namespace docent::bench
