// SPDX-License-Identifier: Apache-2.0
#include "engine/initialization/corner_tracks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <set>
#include <vector>

#include "engine/vision/features.h"
#include "tests/engine/geometry/test_math.h"
#include "tests/engine/rendered_world.h"

namespace docent::engine {
namespace {

using testing_world::Camera;
using testing_world::CameraAt;
using testing_world::RenderedWorld;

// An image that is grey but for a textured square with edges of this length, whose middle has this column.
cv::Mat ImageWithObject(int edge_px, int column) {
  const int width = Camera()->width_px(), height = Camera()->height_px();
  cv::Mat object(edge_px, edge_px, CV_8UC1), image(height, width + 2 * edge_px, CV_8UC1, cv::Scalar(100));
  cv::RNG random(57);
  random.fill(object, cv::RNG::UNIFORM, 0, 255);
  cv::GaussianBlur(object, object, {}, 1.5);
  object.copyTo(image(cv::Rect(edge_px + column - edge_px / 2, (height - edge_px) / 2, edge_px, edge_px)));
  return image(cv::Rect(edge_px, 0, width, height)).clone();
}

constexpr int kObject_px = 140;

std::size_t CornersAtStart(const CornerTracksOptions& options, const cv::Mat& image) {
  CornerTracks tracks(options);
  tracks.Start({}, MakeFeatures(image));
  return tracks.views().front().corners_at_start;
}

TEST(CornerTracks, TakeMoreCornersOfTheObjectsInAPlainScene) {
  CornerTracksOptions coarse;
  coarse.low_texture_corners = 0;
  const cv::Mat object = ImageWithObject(kObject_px, 160), furnished = ImageWithObject(240, 160);
  EXPECT_LT(CornersAtStart(coarse, object),
            static_cast<std::size_t>(CornerTracksOptions().low_texture_corners));
  EXPECT_GT(CornersAtStart({}, object), 1.1 * static_cast<double>(CornersAtStart(coarse, object)));
  EXPECT_EQ(CornersAtStart({}, furnished), CornersAtStart(coarse, furnished));
}

// The next image of a camera with 30 images per second.
void Show(const cv::Mat& image, int number, CornerTracks* tracks) {
  const Timestamp time = FromSeconds(number / 30.0);
  const auto features = MakeFeatures(image);
  if (!tracks->started()) {
    tracks->Start(time, features);
  } else {
    tracks->Track(time, features, *Camera(), AlignedRotation(*tracks->newest(), *features, *Camera()));
  }
}

// Tracks the corners in images of a camera with these poses.
CornerTracks Follow(const RenderedWorld& world, const std::vector<Rigid3>& poses) {
  CornerTracks tracks({});
  for (std::size_t i = 0; i < poses.size(); ++i)
    Show(world.Render(*Camera(), poses[i], 1.5, i + 1), static_cast<int>(i), &tracks);
  return tracks;
}

TEST(CornerTracks, FollowCornersToTheirTruePixels) {
  const RenderedWorld world = RenderedWorld::Room(54);
  std::vector<Rigid3> poses;
  for (int i = 0; i < 8; ++i) poses.push_back(CameraAt({0.004 * i, 0, 0}, {0, 0, 0.5 * i}));
  const CornerTracks tracks = Follow(world, poses);
  std::vector<InitialPair::Match> matches;
  std::vector<std::uint32_t> ids;
  tracks.Matches(tracks.views().front(), &matches, &ids);
  ASSERT_GT(matches.size(), 100u);
  std::vector<double> errors;  // in pixels of the corner's level
  for (const InitialPair::Match& match : matches) {
    const auto hit = world.AtPixel(*Camera(), poses.front(), match.pixel_a.cast<double>());
    ASSERT_TRUE(hit);
    errors.push_back((*Camera()->Project(poses.back() * hit->point) - match.pixel_b.cast<double>()).norm() /
                     (1 << match.level));
  }
  std::sort(errors.begin(), errors.end());
  EXPECT_LT(errors[errors.size() / 2], 0.4);
  EXPECT_LT(errors[errors.size() * 9 / 10], 1.5);
}

TEST(CornerTracks, HaveOneFirstViewInAFurnishedRoomEvenIfHalfOfTheCornersAreLost) {
  std::vector<Rigid3> poses;
  for (int i = 0; i < 12; ++i) poses.push_back(CameraAt({0, 0, 0}, {0, 2.5 * i, 0}));
  const CornerTracks tracks = Follow(RenderedWorld::Room(54), poses);
  ASSERT_EQ(tracks.views().size(), 1u);
  EXPECT_LT(tracks.views().front().alive, 0.7 * static_cast<double>(tracks.views().front().corners_at_start));
}

// An object before a plain wall moves to the left, and in the end out of the image.
constexpr int kStep_px = 6;  // per image
CornerTracks FollowObject(const CornerTracksOptions& options, int images, int step_px = kStep_px) {
  CornerTracks tracks(options);
  for (int i = 0; i < images; ++i) Show(ImageWithObject(kObject_px, 130 - step_px * i), i, &tracks);
  return tracks;
}

TEST(CornerTracks, BeginFurtherFirstViewsInAPlainSceneOnceCornersAreLost) {
  EXPECT_EQ(FollowObject({}, 18, 0).views().size(), 1u);
  const CornerTracks tracks = FollowObject({}, 18);
  const std::vector<CornerTracks::FirstView>& views = tracks.views();
  EXPECT_GE(views.size(), 2u);
  EXPECT_LE(views.size(), static_cast<std::size_t>(CornerTracksOptions().max_views));
  std::set<std::size_t> slots;
  for (const CornerTracks::FirstView& view : views) slots.insert(view.slot);
  EXPECT_EQ(slots.size(), views.size());
  CornerTracksOptions single;
  single.max_views = 1;
  EXPECT_EQ(FollowObject(single, 18).views().size(), 1u);
}

TEST(CornerTracks, TellTheMotionSinceEachFirstView) {
  const CornerTracks tracks = FollowObject({}, 18);
  std::vector<InitialPair::Match> matches;
  std::vector<std::uint32_t> ids;
  for (const CornerTracks::FirstView& view : tracks.views()) {
    const float moved_px = static_cast<float>(kStep_px * view.age_frames);
    tracks.Matches(view, &matches, &ids);
    ASSERT_EQ(matches.size(), view.alive);
    ASSERT_EQ(ids.size(), view.alive);
    EXPECT_TRUE(std::is_sorted(ids.begin(), ids.end()));
    int right = 0;
    for (const InitialPair::Match& match : matches)
      right += (match.pixel_a - match.pixel_b - Eigen::Vector2f(moved_px, 0)).norm() < 0.5f;
    EXPECT_GE(right, 0.95 * static_cast<double>(matches.size())) << "age " << view.age_frames;
    EXPECT_NEAR(tracks.MedianMotionPx(view), static_cast<double>(moved_px), 0.1);
  }
}

TEST(CornerTracks, KeepAFirstViewForSecondsHoweverManyImagesThereAre) {
  const RenderedWorld world = RenderedWorld::Room(51);
  const auto features = MakeFeatures(world.Render(*Camera(), CameraAt({0, 0, 0}), 1.5, 1));
  CornerTracksOptions options;
  options.max_age_frames = 20;
  options.max_age = std::chrono::seconds(1);
  CornerTracks tracks(options);
  tracks.Start({}, features);
  for (int i = 1; i <= 120; ++i) {
    tracks.Track(FromSeconds(i / 120.0), features, *Camera(), Rotation3());
    ASSERT_EQ(tracks.views().front().time, Timestamp{}) << i;
  }
  tracks.Track(FromSeconds(121 / 120.0), features, *Camera(), Rotation3());
  EXPECT_EQ(tracks.views().front().time, FromSeconds(121 / 120.0));
}

TEST(CornerTracks, StartAgainWhereTooFewCornersAreLeft) {
  const CornerTracks tracks = FollowObject({}, 33);
  ASSERT_EQ(tracks.views().size(), 1u);
  EXPECT_GT(tracks.views().front().time, FromSeconds(0.5));
}

TEST(CornerTracks, RememberTheirPixelsInTheLastImages) {
  const RenderedWorld world = RenderedWorld::Room(51);
  CornerTracks tracks({});
  const int last = static_cast<int>(CornerTracks::kRememberedImages) + 3;
  std::vector<InitialPair::Match> matches;
  std::vector<std::uint32_t> ids;
  for (int i = 0; i <= last; ++i) {
    Show(world.Render(*Camera(), CameraAt({0.001 * i, 0, 0}), 1.5, 1), i, &tracks);
    const CornerSequence sequence = tracks.Sequence(tracks.views().front());
    tracks.Matches(tracks.views().front(), &matches, &ids);
    const auto count =
        std::min<std::size_t>(static_cast<std::size_t>(i) + 1, CornerTracks::kRememberedImages);
    ASSERT_EQ(sequence.images.size(), count);
    EXPECT_EQ(sequence.images.back().time, FromSeconds(i / 30.0));
    EXPECT_EQ(sequence.images.front().time, FromSeconds((i + 1 - static_cast<int>(count)) / 30.0));
    ASSERT_EQ(sequence.corners.size(), matches.size());
    for (std::size_t c = 0; c < matches.size(); ++c) {
      ASSERT_EQ(sequence.corners[c].pixels.size(), count);
      EXPECT_EQ(sequence.corners[c].pixels.back(), matches[c].pixel_b);
      if (static_cast<int>(count) == i + 1) {
        EXPECT_EQ(sequence.corners[c].pixels.front(), matches[c].pixel_a);
      }
    }
  }
}

}  // namespace
}  // namespace docent::engine
