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
#include "engine/vision/features.h"
#include "maps/place_index.h"

// How often the place index names the right one of twelve bays of the simulator's museum, which look alike,
// among its first five candidates: keyframes from where the maps are built, questions from the visits later.
// Whoever guesses is right with one candidate of twelve, and with five in a third of all questions.
namespace docent::app {
namespace {

struct Visit {
  std::uint64_t map_key = 0;
  cv::Mat gray;
};
struct Museum {
  maps::PlaceIndex index;
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
    // Each a place of its own, so that five candidates are no more than five keyframes.
    keyframe.camera_from_map.translation.x() = 10.0 * keyframe.id;
    map->keyframes.push_back(keyframe);
  }
  for (const auto& [key, map] : maps) museum->index.SetMap(key, map);
  return museum;
}

// What a visitor's camera does to the image that the author's took.
struct Change {
  const char* name;
  double angle_deg, scale;
  double aside;  // of the image's width
  bool thumbnails_fail;
  bool needs_both;  // neither thumbnails nor words alone are as often right with their first candidate
};
constexpr Change kChanges[] = {{"as it is", 0, 1, 0, false, false},
                               {"nearer", 0, 1.4, 0, false, true},
                               {"rolled", 40, 1, 0, true, false},
                               {"aside", 0, 1, 0.4, true, false}};

cv::Mat Changed(const cv::Mat& gray, const Change& change) {
  const cv::Point2f middle(gray.cols / 2.0f, gray.rows / 2.0f);
  cv::Mat warp = cv::getRotationMatrix2D(middle, change.angle_deg, change.scale), out;
  warp.at<double>(0, 2) += change.aside * gray.cols;
  cv::warpAffine(gray, out, warp, gray.size());
  return out;
}

// Parts of the questions whose map is among the first `count` candidates.
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
  const auto asked = static_cast<double>(museum.visits.size());
  return {found[0] / asked, found[1] / asked, found[2] / asked};
}

TEST(PlaceRecall, IsHighWhateverAVisitorsCameraDoes) {
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
