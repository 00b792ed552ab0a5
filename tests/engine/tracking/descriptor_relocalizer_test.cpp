// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/descriptor_relocalizer.h"

#include <gtest/gtest.h>

#include <vector>

#include "engine/vision/features.h"
#include "tests/engine/rendered_world.h"

namespace docent::engine {
namespace {

using testing_world::CameraAt;
using testing_world::World;

constexpr std::uint64_t kKey = 7;

const std::shared_ptr<const CameraModel>& MapCamera() {
  static const auto camera = testing_world::PinholeCamera(480, 360);
  return camera;
}

// A map of a room with three keyframes that are half a metre apart.
const std::shared_ptr<const MapSnapshot>& RoomMap() {
  static const auto map =
      testing_world::TrueMap(World(), MapCamera(),
                             {CameraAt({-0.5, 0, 0}), CameraAt({0, 0, 0}), CameraAt({0.5, 0, 0})}, 300)
          .Snapshot();
  return map;
}

std::vector<PlaceCandidate> AllKeyFrames() {
  std::vector<PlaceCandidate> candidates;
  for (const KeyFrame& keyframe : RoomMap()->keyframes)
    candidates.push_back({.map_key = kKey, .map = RoomMap(), .keyframe = keyframe.id});
  return candidates;
}

std::vector<DescriptorRelocalizer::Suggestion> SuggestFor(const std::shared_ptr<const CameraModel>& camera,
                                                          const Rigid3& view,
                                                          DescriptorRelocalizer* relocalizer) {
  const auto features = MakeFeatures(World().Render(*camera, view, 2));
  const DescribedImage image = DescribeAtResolution(*features, *camera, MapCamera()->PixelAngle());
  return relocalizer->Suggest(image.corners, *camera, AllKeyFrames(), 3);
}

double DistanceOf(const Rigid3& a, const Rigid3& b) {
  return (a.OriginInSource() - b.OriginInSource()).norm();
}

// A camera with twice the focal length, and so about half the field of view, of the map's camera.
std::shared_ptr<const CameraModel> TeleCamera() {
  const CameraModel::Intrinsics map_camera = MapCamera()->intrinsics();
  return std::make_shared<const CameraModel>(
      LensModel::kRadialTangential,
      CameraModel::Intrinsics{map_camera.width_px, map_camera.height_px, 2 * map_camera.fx, 2 * map_camera.fy,
                              map_camera.cx, map_camera.cy},
      std::array<double, 5>{});
}

TEST(DescriptorRelocalizer, LocalizesACameraFarFromAllKeyFrames) {
  DescriptorRelocalizer relocalizer({.max_keyframes_per_call = 3});
  for (const Rigid3& view :
       {CameraAt({0.9, 0.2, -0.4}, {0, -12, 8}), CameraAt({-0.8, -0.1, 0.3}, {3, 10, 0})}) {
    const auto suggestions = SuggestFor(MapCamera(), view, &relocalizer);
    ASSERT_EQ(suggestions.size(), 1u);
    EXPECT_EQ(suggestions[0].candidate.map_key, kKey);
    EXPECT_LT(DistanceOf(suggestions[0].camera_from_map, view), 0.1);
  }
}

TEST(DescriptorRelocalizer, LocalizesACameraWithHalfTheFieldOfView) {
  DescriptorRelocalizer relocalizer({.max_keyframes_per_call = 3});
  const Rigid3 view = CameraAt({0.2, 0, 0.1}, {0, -4, 0});
  const auto suggestions = SuggestFor(TeleCamera(), view, &relocalizer);
  ASSERT_EQ(suggestions.size(), 1u);
  EXPECT_LT(DistanceOf(suggestions[0].camera_from_map, view), 0.1);
}

TEST(DescriptorRelocalizer, LimitsTheKeyFramesDescribedPerCall) {
  DescriptorRelocalizer at_once({.max_keyframes_per_call = 3}), one_per_call({.max_keyframes_per_call = 1});
  const Rigid3 view = CameraAt({0.1, 0, 0});
  const auto wanted = SuggestFor(MapCamera(), view, &at_once);
  ASSERT_EQ(wanted.size(), 1u);
  std::vector<DescriptorRelocalizer::Suggestion> got;
  for (int call = 0; call < 3; ++call) got = SuggestFor(MapCamera(), view, &one_per_call);
  ASSERT_EQ(got.size(), 1u);
  EXPECT_EQ(got[0].inliers, wanted[0].inliers);
  EXPECT_TRUE(got[0].camera_from_map.translation == wanted[0].camera_from_map.translation);
}

TEST(DescriptorRelocalizer, SuggestsNothingForAnotherRoom) {
  DescriptorRelocalizer relocalizer({.max_keyframes_per_call = 3});
  const auto other = testing_world::RenderedWorld::Room(99);
  const auto features = MakeFeatures(other.Render(*MapCamera(), CameraAt({0, 0, 0}), 2));
  const DescribedImage image = DescribeAtResolution(*features, *MapCamera(), MapCamera()->PixelAngle());
  EXPECT_TRUE(relocalizer.Suggest(image.corners, *MapCamera(), AllKeyFrames(), 3).empty());
}

}  // namespace
}  // namespace docent::engine
