// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/bench_places.h"

#include <malloc.h>
#include <unistd.h>

#include <fstream>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "app/simulator/simulation.h"
#include "engine/vision/features.h"

namespace docent::bench {
namespace {

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

}  // namespace

View ViewOf(const cv::Mat& gray) {
  const auto features = engine::MakeFeatures(gray);
  return {features->small_blurry, engine::MakeWordBag(*features)};
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

void MakeMaps(std::size_t maps, std::size_t keyframes, const GiveMap& give) {
  const Places& places = SimulatedPlaces();
  Random random(7);
  std::size_t made = 0;
  while (made < maps) {
    const std::size_t round = made / places.maps.size();
    for (const auto& [key, views] : places.maps) {
      if (made == maps) break;
      std::vector<engine::KeyFrameThumbnail> thumbnails;
      std::vector<engine::KeyFrameWords> words;
      for (std::size_t i = 0; i < keyframes; ++i) {
        const auto id = static_cast<engine::KeyFrameId>(i);
        // A small map has views from the whole walk.
        const View& original =
            views[keyframes < views.size() ? i * views.size() / keyframes : i % views.size()];
        const bool itself = round == 0 && i < views.size();
        thumbnails.push_back(
            {id, engine::Pack(itself ? original.thumbnail
                                     : Replica(original.thumbnail, round % 2 == 1, &random))});
        // Five consecutive keyframes form a place.
        words.push_back({id, id / 5 * 5, itself ? original.words : Replica(original.words, &random)});
      }
      give(round == 0 ? key : 1000 * round + key, thumbnails, words);
      ++made;
    }
  }
}

void FillIndex(std::size_t maps, std::size_t keyframes, engine::PlaceIndex* index) {
  index->Reserve(maps * keyframes);
  MakeMaps(maps, keyframes,
           [index](std::uint64_t key, const std::vector<engine::KeyFrameThumbnail>& thumbnails,
                   const std::vector<engine::KeyFrameWords>& words) {
             index->SetAppearance(key, thumbnails, words);
           });
}

double ResidentBytes() {
  malloc_trim(0);  // memory that was freed before would hide new allocations
  std::ifstream file("/proc/self/statm");
  double total = 0, resident = 0;
  file >> total >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

std::size_t RankOf(const std::vector<engine::PlaceCandidate>& candidates, std::uint64_t key) {
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (candidates[i].map_key == key) return i;
  }
  return 1000;
}

}  // namespace docent::bench
