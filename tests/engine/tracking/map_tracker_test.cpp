// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/map_tracker.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <opencv2/core.hpp>
#include <set>

#include "engine/tracking/tracker.h"
#include "engine/vision/features.h"
#include "tests/engine/geometry/test_math.h"
#include "tests/engine/rendered_world.h"

namespace docent::engine {
namespace {

using testing_world::CameraAt;
using testing_world::RenderedWorld;
using Effort = MapTracker::Effort;

class TrackingInAMap : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    world_ = new RenderedWorld(RenderedWorld::Room(21));
    camera_ = testing_world::PinholeCamera(400, 300);
    map_ =
        testing_world::TrueMap(*world_, camera_,
                               {CameraAt({0, 0, 0}), CameraAt({0.3, 0, 0}), CameraAt({-0.3, 0.1, 0.2})}, 350)
            .Snapshot();
  }
  static void TearDownTestSuite() {
    delete world_;
    world_ = nullptr;
    map_.reset();
    camera_.reset();
  }
  static std::shared_ptr<const ImageFeatures> Show(const RenderedWorld& world, const Rigid3& view,
                                                   std::uint64_t seed = 3) {
    return MakeFeatures(world.Render(*camera_, view, 1.5, seed));
  }
  static void ExpectAt(const MapTrackResult& result, const Rigid3& truth) {
    EXPECT_TRUE(result.converged);
    EXPECT_LT((result.camera_from_map.OriginInSource() - truth.OriginInSource()).norm(), 0.006);
    EXPECT_LT(RotationErrorDeg(result.camera_from_map, truth), 0.15);
  }
  // The minimum requirements of the tracker for a pose.
  static bool IsAcceptable(const MapTrackResult& result) {
    const TrackerOptions tracker;
    return result.converged && result.sigma <= tracker.max_sigma && result.inliers >= tracker.min_inliers &&
           result.occupied_cells >= tracker.min_cells && result.Quality() >= tracker.lost_quality;
  }

  static RenderedWorld* world_;
  static std::shared_ptr<const CameraModel> camera_;
  static std::shared_ptr<const MapSnapshot> map_;
};
RenderedWorld* TrackingInAMap::world_ = nullptr;
std::shared_ptr<const CameraModel> TrackingInAMap::camera_;
std::shared_ptr<const MapSnapshot> TrackingInAMap::map_;

const std::vector<Rigid3>& ViewsOfTheRoom() {
  static const std::vector<Rigid3> views = {CameraAt({0.1, 0.05, 0.1}, {1, -2, 3}),
                                            CameraAt({-0.2, 0, -0.2}, {-3, 4, -6}),
                                            CameraAt({0.25, -0.1, 0.3}, {2, 0, 0})};
  return views;
}

TEST_F(TrackingInAMap, FindsThePoseFromAPerturbedPrediction) {
  MapTracker tracker({}, camera_);
  Random random(1);
  for (const Rigid3& view : ViewsOfTheRoom()) {
    const auto features = Show(*world_, view);
    for (int trial = 0; trial < 4; ++trial) {
      const Rigid3 predicted =
          CameraAt({random.Uniform(-0.03, 0.03), random.Uniform(-0.03, 0.03), random.Uniform(-0.03, 0.03)},
                   {random.Uniform(-2, 2), random.Uniform(-2, 2), random.Uniform(-2, 2)}) *
          view;
      const MapTrackResult result = tracker.Track(*map_, *features, predicted, Effort::kStandard, &random);
      ExpectAt(result, view);
      EXPECT_GT(result.Quality(), 0.5);
      EXPECT_GT(result.inliers, 100);
      EXPECT_GE(result.occupied_cells, 10);
      EXPECT_TRUE(IsAcceptable(result));
    }
  }
}

// The room, but another one from `shown` of the width on.
cv::Mat RoomBesideAnother(const RenderedWorld& room, const CameraModel& camera, const Rigid3& view,
                          double shown) {
  const RenderedWorld other = RenderedWorld::Room(22);
  cv::Mat image = room.Render(camera, view, 1.5, 3);
  const int first = static_cast<int>(shown * image.cols);
  const cv::Rect rest(first, 0, image.cols - first, image.rows);
  if (rest.width > 0) other.Render(camera, view, 1.5, 3)(rest).copyTo(image(rest));
  return image;
}

TEST_F(TrackingInAMap, ReportsTheRatioOfTheImageThatShowsSomethingElse) {
  const Rigid3 view = ViewsOfTheRoom()[0];
  double last = -1;
  for (const double shown : {1.0, 0.75, 0.5}) {
    const cv::Mat image = RoomBesideAnother(*world_, *camera_, view, shown);
    MapTracker tracker({}, camera_);
    Random random(4);
    const MapTrackResult result =
        tracker.Track(*map_, *MakeFeatures(image), view, Effort::kStandard, &random);
    EXPECT_NEAR(result.contradicted_area, 1 - shown, 0.12);
    EXPECT_GT(result.contradicted_area, last);
    last = result.contradicted_area;
  }
}

TEST_F(TrackingInAMap, DoesNotLetAnObjectOfManyPointsOutweighTheRestOfTheImage) {
  const Rigid3 view = ViewsOfTheRoom()[0];
  MapSnapshot dense_on_the_left = *map_;
  std::erase_if(dense_on_the_left.points, [&](const MapPoint& point) {
    const auto pixel = camera_->Project(view * point.position());
    return pixel && pixel->x() > 0.5 * camera_->width_px() && point.id % 2 != 0;
  });
  MapTracker tracker({}, camera_);
  Random random(4);
  const MapTrackResult result =
      tracker.Track(dense_on_the_left, *MakeFeatures(RoomBesideAnother(*world_, *camera_, view, 0.5)), view,
                    Effort::kStandard, &random);
  EXPECT_GT(result.Quality(), 0.55) << "more points are on the left";
  EXPECT_NEAR(result.contradicted_area, 0.5, 0.1);
}

TEST_F(TrackingInAMap, ReportsAttemptsMatchesAndCovariance) {
  MapTracker tracker({}, camera_);
  Random random(2);
  const auto features = Show(*world_, ViewsOfTheRoom()[0]);
  const MapTrackResult result =
      tracker.Track(*map_, *features, ViewsOfTheRoom()[0], Effort::kStandard, &random);
  EXPECT_EQ(static_cast<int>(tracker.attempts().size()), result.attempted);
  EXPECT_EQ(static_cast<int>(tracker.matches().size()), result.found);
  const auto is_inlier = [](const auto& item) { return item.inlier; };
  EXPECT_EQ(std::count_if(tracker.attempts().begin(), tracker.attempts().end(), is_inlier), result.inliers);
  EXPECT_EQ(std::count_if(tracker.matches().begin(), tracker.matches().end(), is_inlier), result.inliers);
  for (const PointMatch& match : tracker.matches()) {
    const MapPoint* point = map_->FindPoint(match.point);
    ASSERT_NE(point, nullptr);
    if (!match.inlier) continue;
    const auto truth = camera_->Project(ViewsOfTheRoom()[0] * point->position());
    EXPECT_LT((match.pixel.cast<double>() - *truth).norm(), 3.0 * (1 << match.level));
  }
  std::vector<double> depths;
  for (const PointMatch& match : tracker.matches())
    if (match.inlier) depths.push_back((ViewsOfTheRoom()[0] * map_->FindPoint(match.point)->position()).z());
  std::nth_element(depths.begin(), depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2),
                   depths.end());
  EXPECT_NEAR(result.median_depth, depths[depths.size() / 2], 0.02);
  const Eigen::LLT<Eigen::Matrix<double, 6, 6>> factor(result.covariance);
  EXPECT_EQ(factor.info(), Eigen::Success) << "the covariance is not positive definite";
  EXPECT_LT(std::sqrt(result.covariance.topLeftCorner<3, 3>().trace()), 0.01);
}

// A person occludes the left half of the image for a while.
TEST_F(TrackingInAMap, SearchesOccludedPointsLessOften) {
  MapTracker tracker({}, camera_);
  Random random(9);
  const Rigid3 view = ViewsOfTheRoom()[0];
  cv::Mat image = world_->Render(*camera_, view, 1.5, 3);
  const auto unoccluded = MakeFeatures(image.clone());
  image(cv::Rect(0, 0, image.cols / 2, image.rows)).setTo(90);
  const auto occluded = MakeFeatures(image);
  const auto track = [&](const ImageFeatures& features, int frames) {
    MapTrackResult result;
    for (int i = 0; i < frames; ++i) {
      result = tracker.Track(*map_, features, view, Effort::kStandard, &random);
      tracker.RecordMisses();
    }
    ExpectAt(result, view);
    return result;
  };
  const MapTrackResult before = track(*unoccluded, 1);
  const MapTrackResult first = track(*occluded, 1);
  const MapTrackResult later = track(*occluded, 20);
  EXPECT_LT(first.Quality(), 0.7 * before.Quality());
  EXPECT_GT(later.Quality(), 1.2 * first.Quality());
  EXPECT_LT(later.attempted, first.attempted);
  EXPECT_GT(later.inliers, 0.9 * first.inliers) << "visible points must still be searched";
  const MapTrackResult again = track(*unoccluded, 20);
  EXPECT_GT(again.inliers, 0.95 * before.inliers) << "points are searched again once they are visible";
}

// Only a quarter of the points in view may be searched per frame.
TEST_F(TrackingInAMap, ChangesItsPointSelectionGradually) {
  Random random(4);
  const Rigid3 view = ViewsOfTheRoom()[0];
  const auto features = Show(*world_, view);
  MapTracker all({}, camera_);
  const int in_view = all.Track(*map_, *features, view, Effort::kStandard, &random).attempted;
  MapTrackerOptions options;
  options.max_fine = in_view / 4;
  MapTracker tracker(options, camera_);
  const auto choose = [&] {
    tracker.Track(*map_, *features, view, Effort::kStandard, &random);
    std::set<MapPointId> chosen;
    for (const MapTracker::Attempt& attempt : tracker.attempts()) chosen.insert(attempt.point);
    return chosen;
  };
  const auto shared = [](const std::set<MapPointId>& a, const std::set<MapPointId>& b) {
    return static_cast<double>(
               std::count_if(a.begin(), a.end(), [&](MapPointId id) { return b.contains(id); })) /
           static_cast<double>(a.size());
  };
  const std::set<MapPointId> first = choose();
  ASSERT_GT(first.size(), 50u);
  std::set<MapPointId> before = first, ever = first;
  for (int frame = 0; frame < 200; ++frame) {
    const std::set<MapPointId> now = choose();
    EXPECT_GT(shared(now, before), 0.8);
    ever.insert(now.begin(), now.end());
    before = now;
  }
  EXPECT_LT(shared(before, first), 0.5) << "the selection must change over time";
  EXPECT_GT(static_cast<double>(ever.size()), 0.7 * in_view) << "most points must be selected at some time";
  tracker.ForgetLastFrame();
  EXPECT_LT(shared(choose(), before), 0.5) << "a rejected selection must not be repeated";
}

TEST_F(TrackingInAMap, RecoversFromABadPrediction) {
  Random random(3);
  const std::vector<Rigid3> offsets = {CameraAt({0.15, 0, 0}, {0, 6, 0}),
                                       CameraAt({-0.1, 0.1, 0.1}, {-5, 0, 5}),
                                       CameraAt({0, 0, 0.2}, {3, -5, 0})};
  for (const Rigid3& view : ViewsOfTheRoom()) {
    const auto features = Show(*world_, view);
    for (const Rigid3& offset : offsets) {
      MapTracker tracker({}, camera_);
      const MapTrackResult result =
          tracker.Track(*map_, *features, offset * view, Effort::kRelocalization, &random);
      ExpectAt(result, view);
      EXPECT_TRUE(IsAcceptable(result));
    }
  }
}

TEST_F(TrackingInAMap, RejectsImagesOfAnotherWorld) {
  const RenderedWorld other = RenderedWorld::Room(4711);
  Random random(4);
  for (const Rigid3& view : ViewsOfTheRoom()) {
    const auto features = Show(other, view);
    for (const Effort effort : {Effort::kStandard, Effort::kWide, Effort::kRelocalization}) {
      MapTracker tracker({}, camera_);
      const MapTrackResult result = tracker.Track(*map_, *features, view, effort, &random);
      EXPECT_FALSE(IsAcceptable(result)) << "effort " << static_cast<int>(effort) << ": " << result.inliers
                                         << " of " << result.attempted << ", sigma " << result.sigma;
    }
  }
}

TEST_F(TrackingInAMap, DoesNotConvergeOnABlankImageOrInAnEmptyMap) {
  Random random(5);
  const auto blank = MakeFeatures(cv::Mat(300, 400, CV_8UC1, cv::Scalar(90)));
  const auto features = Show(*world_, ViewsOfTheRoom()[0]);
  for (const Effort effort : {Effort::kStandard, Effort::kWide, Effort::kRelocalization}) {
    MapTracker tracker({}, camera_);
    EXPECT_FALSE(tracker.Track(*map_, *blank, ViewsOfTheRoom()[0], effort, &random).converged);
    EXPECT_FALSE(tracker.Track(MapSnapshot(), *features, ViewsOfTheRoom()[0], effort, &random).converged);
  }
}

TEST_F(TrackingInAMap, SearchesNoPointsFromBehindTheWalls) {
  MapTracker tracker({}, camera_);
  Random random(6);
  const auto features = Show(*world_, ViewsOfTheRoom()[0]);
  const MapTrackResult result =
      tracker.Track(*map_, *features, CameraAt({0, 0, 6}, {0, 180, 0}), Effort::kStandard, &random);
  EXPECT_EQ(result.attempted, 0);
  EXPECT_FALSE(result.converged);
}

TEST_F(TrackingInAMap, IsDeterministicForAGivenSeed) {
  MapTrackResult results[2];
  for (MapTrackResult& result : results) {
    MapTracker tracker({}, camera_);
    Random random(7);
    for (const Rigid3& view : ViewsOfTheRoom())
      result = tracker.Track(*map_, *Show(*world_, view), view, Effort::kStandard, &random);
  }
  EXPECT_EQ(results[0].camera_from_map.translation, results[1].camera_from_map.translation);
  EXPECT_EQ(results[0].camera_from_map.rotation.quaternion().coeffs(),
            results[1].camera_from_map.rotation.quaternion().coeffs());
  EXPECT_EQ(results[0].inliers, results[1].inliers);
  EXPECT_EQ(results[0].covariance, results[1].covariance);
}

}  // namespace
}  // namespace docent::engine
