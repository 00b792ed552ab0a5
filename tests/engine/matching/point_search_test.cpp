// SPDX-License-Identifier: Apache-2.0
#include "engine/matching/point_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/vision/features.h"
#include "tests/engine/rendered_world.h"

namespace docent::engine {
namespace {

using testing_world::CameraAt;
using testing_world::RenderedWorld;

// A wall two metres ahead, and a map of it with one keyframe that faces it.
class PointSearch : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    world_ = new RenderedWorld(RenderedWorld::SingleWall(2, 11));
    camera_ = testing_world::PinholeCamera(480, 360);
    map_ = testing_world::TrueMap(*world_, camera_, {CameraAt({0, 0, 0})}, 250).Snapshot();
  }
  static void TearDownTestSuite() {
    delete world_;
    world_ = nullptr;
    map_.reset();
    camera_.reset();
  }
  const KeyFrame& Source() const { return map_->keyframes[0]; }

  // The pixel to which the wall's homography maps a pixel of a pyramid level of the source image.
  std::optional<Eigen::Vector2d> ThroughTheWall(const Eigen::Vector2d& source_pixel, int level,
                                                const Rigid3& camera_from_world) const {
    const auto hit =
        world_->AtPixel(*camera_, Source().camera_from_map, LevelZeroFromLevel(source_pixel, level));
    if (!hit) return std::nullopt;
    return camera_->Project(camera_from_world * hit->point);
  }

  static RenderedWorld* world_;
  static std::shared_ptr<const CameraModel> camera_;
  static std::shared_ptr<const MapSnapshot> map_;
};
RenderedWorld* PointSearch::world_ = nullptr;
std::shared_ptr<const CameraModel> PointSearch::camera_;
std::shared_ptr<const MapSnapshot> PointSearch::map_;

const std::vector<Rigid3>& ViewsOfTheWall() {
  static const std::vector<Rigid3> views = {
      CameraAt({0.25, -0.1, 0}, {0, -4, 0}), CameraAt({-0.3, 0.1, 0.5}, {3, 6, 12}),
      CameraAt({0.9, 0.2, 0.3}, {-2, -25, -5}), CameraAt({0.1, 0, -0.8}, {0, 0, 40})};
  return views;
}

TEST_F(PointSearch, PredictsThePositionAndWarpOfTheHomography) {
  PointSearcher searcher;
  for (const Rigid3& view : ViewsOfTheWall()) {
    int predicted_count = 0;
    for (const MapPoint& point : map_->points) {
      const auto predicted = searcher.Predict(point, Source(), *camera_, view);
      if (!predicted) continue;
      ++predicted_count;
      const Eigen::Vector2d truth = *camera_->Project(view * point.position());
      EXPECT_LT((predicted->pixel - truth).norm(), 1e-6);
      const Eigen::Vector2d at = point.source_pixel.cast<double>();
      for (const auto& [axis, step] : {std::pair{0, Eigen::Vector2d(0.5, 0)}, {1, Eigen::Vector2d(0, 0.5)}}) {
        const auto ahead = ThroughTheWall(at + step, point.source_level, view);
        const auto behind = ThroughTheWall(at - step, point.source_level, view);
        ASSERT_TRUE(ahead && behind);
        const Eigen::Vector2d column = predicted->pixel_from_source.col(axis).cast<double>();
        EXPECT_LT((column - (*ahead - *behind)).norm(), 0.03 * column.norm()) << point.id;
      }
    }
    EXPECT_GT(predicted_count, 60);
  }
}

TEST_F(PointSearch, FindsPointsWhereTheHomographyPredictsThem) {
  PointSearcher searcher;
  for (const Rigid3& view : ViewsOfTheWall()) {
    const auto features = MakeFeatures(world_->Render(*camera_, view, 1.5, 5));
    int visible = 0;
    std::vector<double> errors;  // in pixels of the level
    for (const MapPoint& point : map_->points) {
      auto predicted = searcher.Predict(point, Source(), *camera_, view);
      if (!predicted) continue;
      ++visible;
      const Eigen::Vector2d truth = predicted->pixel;
      predicted->pixel += Eigen::Vector2d(3, -2);
      const auto found = searcher.Find(point, Source(), *predicted, *features, 8, true);
      if (!found) continue;
      EXPECT_GT(found->correlation, 0.7f);
      errors.push_back((found->pixel.cast<double>() - truth).norm() / (1 << predicted->level));
    }
    ASSERT_GT(static_cast<double>(errors.size()), 0.5 * visible);
    std::sort(errors.begin(), errors.end());
    EXPECT_LT(errors[errors.size() / 2], 0.1);
    EXPECT_LT(errors[errors.size() * 9 / 10], 0.2);
  }
}

// The images are overexposed by a factor of 2.5.
TEST_F(PointSearch, PhotometricToleranceFindsMorePointsInOverexposedImages) {
  PointSearcher usual, tolerant;
  tolerant.SetComparison(PatchComparison::kTolerant);
  int found_plainly = 0, found_tolerantly = 0;
  std::vector<double> errors;  // of the tolerant search, in pixels of the level
  for (const Rigid3& view : ViewsOfTheWall()) {
    const cv::Mat image = world_->Render(*camera_, view, 1.5, 5);
    const auto features = MakeFeatures(image * 2.5);
    for (const MapPoint& point : map_->points) {
      auto predicted = usual.Predict(point, Source(), *camera_, view);
      if (!predicted) continue;
      const Eigen::Vector2d truth = predicted->pixel;
      predicted->pixel += Eigen::Vector2d(3, -2);
      if (usual.Find(point, Source(), *predicted, *features, 8, true)) ++found_plainly;
      const auto found = tolerant.Find(point, Source(), *predicted, *features, 8, true);
      if (!found) continue;
      ++found_tolerantly;
      errors.push_back((found->pixel.cast<double>() - truth).norm() / (1 << predicted->level));
    }
  }
  EXPECT_GT(found_tolerantly, 1.3 * found_plainly);
  ASSERT_FALSE(errors.empty());
  std::sort(errors.begin(), errors.end());
  EXPECT_LT(errors[errors.size() / 2], 0.2);
}

TEST_F(PointSearch, ChoosesTheLevelWhereThePatchKeepsItsSize) {
  PointSearcher searcher;
  int too_small_or_large = 0, suitable = 0, coarse = 0;
  for (const double distance : {0.15, 0.3, 0.5, 1.0, 1.5, 2.0, 3.5, 5.0, 9.0, 20.0}) {
    const Rigid3 view = CameraAt({0, 0, 2 - distance});
    for (const MapPoint& point : map_->points) {
      if (point.position().head<2>().norm() > 0.05 * distance + 0.1) continue;
      const auto pixel = camera_->Project(view * point.position());
      if (!camera_->IsInside(*pixel, 10)) continue;
      const double area = std::pow(2 / distance, 2) * std::pow(4.0, point.source_level);
      const auto predicted = searcher.Predict(point, Source(), *camera_, view);
      if (area < 0.23 || area > 3.3 * 64) {
        EXPECT_FALSE(predicted) << "area ratio " << area;
        ++too_small_or_large;
      } else if (area > 0.27 && area < 2.9 * 64) {
        ASSERT_TRUE(predicted) << "area ratio " << area;
        ++suitable;
        const double at_level = area / std::pow(4.0, predicted->level);
        EXPECT_LT(at_level, 3.1);
        if (predicted->level > 0) {
          EXPECT_GT(at_level, 0.7);
          ++coarse;
        }
      }
    }
  }
  EXPECT_GT(too_small_or_large, 20);
  EXPECT_GT(suitable, 100);
  EXPECT_GT(coarse, 20);
}

TEST_F(PointSearch, RejectsPointsBehindOutsideOrSeenEdgeOn) {
  PointSearcher searcher;
  const std::vector<Rigid3> blind = {CameraAt({0, 0, 0}, {0, 180, 0}), CameraAt({0, 0, 0}, {0, 90, 0}),
                                     CameraAt({0, 0, 2.5}), CameraAt({-3, 0, 1.7}, {0, 88, 0})};
  for (const Rigid3& view : blind) {
    int predicted = 0;
    for (const MapPoint& point : map_->points)
      predicted += searcher.Predict(point, Source(), *camera_, view).has_value();
    EXPECT_EQ(predicted, 0) << view;
  }
}

TEST_F(PointSearch, FindsAlmostNothingInAnImageOfAnotherWorld) {
  const RenderedWorld other = RenderedWorld::SingleWall(2, 999);
  PointSearcher searcher;
  const auto features = MakeFeatures(other.Render(*camera_, ViewsOfTheWall()[0]));
  int visible = 0, found = 0;
  for (const MapPoint& point : map_->points) {
    const auto predicted = searcher.Predict(point, Source(), *camera_, ViewsOfTheWall()[0]);
    if (!predicted) continue;
    ++visible;
    found += searcher.Find(point, Source(), *predicted, *features, 8, true).has_value();
  }
  EXPECT_GT(visible, 100);
  EXPECT_LT(found, visible / 5);
}

TEST_F(PointSearch, FindsPointsWithoutACornerOnlyWhenAllowed) {
  PointSearcher searcher;
  ImageFeatures features = *MakeFeatures(world_->Render(*camera_, ViewsOfTheWall()[0]));
  for (std::size_t level = 0; level < kPyramidLevels; ++level) {
    features.corners[level].clear();
    std::fill(features.row_begin[level].begin(), features.row_begin[level].end(), 0);
  }
  int visible = 0, with_corner = 0, direct = 0;
  for (const MapPoint& point : map_->points) {
    const auto predicted = searcher.Predict(point, Source(), *camera_, ViewsOfTheWall()[0]);
    if (!predicted) continue;
    ++visible;
    with_corner += searcher.Find(point, Source(), *predicted, features, 8, false).has_value();
    direct += searcher.Find(point, Source(), *predicted, features, 8, true).has_value();
  }
  EXPECT_EQ(with_corner, 0);
  EXPECT_GT(direct, 0.8 * visible);
}

TEST_F(PointSearch, DoesNotDependOnEarlierSearches) {
  PointSearcher used, fresh;
  const auto features = MakeFeatures(world_->Render(*camera_, ViewsOfTheWall()[1]));
  for (const MapPoint& point : map_->points) {
    if (const auto predicted = used.Predict(point, Source(), *camera_, ViewsOfTheWall()[3]))
      used.Find(point, Source(), *predicted, *features, 8, true);
  }
  used.Clear();
  int found = 0;
  for (const MapPoint& point : map_->points) {
    const auto a = used.Predict(point, Source(), *camera_, ViewsOfTheWall()[1]);
    const auto b = fresh.Predict(point, Source(), *camera_, ViewsOfTheWall()[1]);
    ASSERT_EQ(a.has_value(), b.has_value());
    if (!a) continue;
    const auto found_a = used.Find(point, Source(), *a, *features, 8, true);
    const auto found_b = fresh.Find(point, Source(), *b, *features, 8, true);
    ASSERT_EQ(found_a.has_value(), found_b.has_value());
    if (!found_a) continue;
    EXPECT_EQ(found_a->pixel, found_b->pixel);
    ++found;
  }
  EXPECT_GT(found, 100);
}

}  // namespace
}  // namespace docent::engine
