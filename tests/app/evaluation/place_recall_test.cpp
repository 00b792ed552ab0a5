// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "app/simulator/simulation.h"
#include "engine/recognition/place_index.h"
#include "engine/vision/features.h"

// Measures how often the place index retrieves the right one of twelve similar bays of the simulated museum
// among its first five candidates. The keyframes come from the images where the maps are built, the queries
// from the later visits. By chance, the first candidate is right in one of twelve queries, and one of five in
// a third of them.
namespace docent::app {
namespace {

struct Visit {
  std::uint64_t map_key = 0;
  cv::Mat gray;
};
struct Museum {
  engine::PlaceIndex index;
  std::vector<Visit> visits;
};

std::unique_ptr<const Museum> MakeMuseum() {
  auto museum = std::make_unique<Museum>();
  const auto simulation = MakeSimulation("museum:12");
  std::map<std::uint64_t, std::shared_ptr<engine::MapSnapshot>> maps;
  for (int frame = 0; frame < simulation->frame_count(); frame += 24) {
    const std::string& label = simulation->label(frame);
    const bool build = label.starts_with("build"), visit = label.starts_with("visit");
    if (!build && !visit) continue;
    cv::Mat bgr, gray;
    simulation->Render(frame, &bgr);
    cv::cvtColor(bgr, gray, cv::COLOR_BGR2GRAY);
    const std::uint64_t key = 1 + std::stoul(label.substr(5));
    if (visit) {
      museum->visits.push_back({key, gray});
      continue;
    }
    auto& map = maps[key];
    if (!map) map = std::make_shared<engine::MapSnapshot>();
    engine::KeyFrame keyframe;
    keyframe.id = map->next_keyframe++;
    keyframe.features = engine::MakeFeatures(gray);
    // The keyframes are far apart, so that each is a separate place and five candidates are five keyframes.
    keyframe.camera_from_map.translation.x() = 10.0 * keyframe.id;
    map->keyframes.push_back(keyframe);
  }
  for (const auto& [key, map] : maps) museum->index.SetMap(key, map);
  return museum;
}

// How the visitor's image differs from the author's.
struct Change {
  const char* name;
  double angle_deg, scale;
  double shift;  // ratio of the image width
  bool thumbnails_fail;
  bool needs_both;  // with the first candidate, both cues together must beat thumbnails or words alone
};
constexpr Change kChanges[] = {{"unchanged", 0, 1, 0, false, false},
                               {"nearer", 0, 1.4, 0, false, true},
                               {"rolled", 40, 1, 0, true, false},
                               {"shifted", 0, 1, 0.4, true, false}};

cv::Mat Changed(const cv::Mat& gray, const Change& change) {
  const cv::Point2f middle(gray.cols / 2.0f, gray.rows / 2.0f);
  cv::Mat warp = cv::getRotationMatrix2D(middle, change.angle_deg, change.scale), out;
  warp.at<double>(0, 2) += change.shift * gray.cols;
  cv::warpAffine(gray, out, warp, gray.size());
  return out;
}

// The ratio of queries whose map is among the first `count` candidates.
struct Recall {
  double by_thumbnails = 0, by_words = 0, by_both = 0;
};
Recall RecallOf(const Museum& museum, int count, const Change& change) {
  std::array<double, 3> found{};
  for (const Visit& visit : museum.visits) {
    const auto features = engine::MakeFeatures(Changed(visit.gray, change));
    const engine::WordBag words = engine::MakeWordBag(*features);
    const engine::SmallBlurryImage nothing;
    const std::array<engine::PlaceQuery, 3> queries = {
        engine::PlaceQuery(features->small_blurry), {nothing, words}, {features->small_blurry, words}};
    for (std::size_t i = 0; i < queries.size(); ++i) {
      const auto places = museum.index.FindPlaces(queries[i], count, count, 0);
      found[i] += std::any_of(places.begin(), places.end(),
                              [&](const auto& place) { return place.map_key == visit.map_key; });
    }
  }
  const auto query_count = static_cast<double>(museum.visits.size());
  return {found[0] / query_count, found[1] / query_count, found[2] / query_count};
}

TEST(PlaceRecall, IsHighForShiftedRotatedAndScaledImages) {
  const auto made = MakeMuseum();
  const Museum& museum = *made;
  ASSERT_GE(museum.visits.size(), 36u);
  for (const Change& change : kChanges) {
    const Recall first = RecallOf(museum, 1, change), five = RecallOf(museum, 5, change);
    SCOPED_TRACE(change.name);
    EXPECT_GE(five.by_both, 0.95);
    EXPECT_GE(five.by_words, 0.95);
    EXPECT_GE(first.by_both, first.by_thumbnails);
    EXPECT_GE(five.by_both, five.by_thumbnails);
    if (change.needs_both) {
      EXPECT_GT(first.by_both, std::max(first.by_thumbnails, first.by_words));
    }
    if (change.thumbnails_fail) {
      EXPECT_GT(first.by_both, first.by_thumbnails + 0.4);
    } else {
      EXPECT_GE(five.by_thumbnails, 0.9);
    }
  }
}

}  // namespace
}  // namespace docent::app
