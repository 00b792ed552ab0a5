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

const std::shared_ptr<const CameraModel>& UsualCamera() {
  static const auto camera = testing_world::PinholeCamera(480, 360);
  return camera;
}

// A room seen from three places that are half a metre apart.
const std::shared_ptr<const MapSnapshot>& RoomMap() {
  static const auto map =
      testing_world::TrueMap(World(), UsualCamera(),
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
  const DescribedImage image = DescribeAtResolution(*features, *camera, UsualCamera()->PixelAngle());
  return relocalizer->Suggest(image.corners, *camera, AllKeyFrames(), 3);
}

double DistanceOf(const Rigid3& a, const Rigid3& b) {
  return (a.OriginInSource() - b.OriginInSource()).norm();
}

// Half the field of view of the map's camera, as a lens of twice the focal length has it.
std::shared_ptr<const CameraModel> TeleCamera() {
  const CameraModel::Intrinsics usual = UsualCamera()->intrinsics();
  return std::make_shared<const CameraModel>(
      LensModel::kRadialTangential,
      CameraModel::Intrinsics{usual.width_px, usual.height_px, 2 * usual.fx, 2 * usual.fy, usual.cx,
                              usual.cy},
      std::array<double, 5>{});
}

TEST(DescriptorRelocalizer, PlacesACameraFarBesideAllKeyFrames) {
  DescriptorRelocalizer relocalizer({.keyframes_a_call = 3});
  for (const Rigid3& view :
       {CameraAt({0.9, 0.2, -0.4}, {0, -12, 8}), CameraAt({-0.8, -0.1, 0.3}, {3, 10, 0})}) {
    const auto suggestions = SuggestFor(UsualCamera(), view, &relocalizer);
    ASSERT_EQ(suggestions.size(), 1u);
    EXPECT_EQ(suggestions[0].candidate.map_key, kKey);
    EXPECT_LT(DistanceOf(suggestions[0].camera_from_map, view), 0.1);
  }
}

TEST(DescriptorRelocalizer, PlacesACameraWithHalfTheFieldOfView) {
  DescriptorRelocalizer relocalizer({.keyframes_a_call = 3});
  const Rigid3 view = CameraAt({0.2, 0, 0.1}, {0, -4, 0});
  const auto suggestions = SuggestFor(TeleCamera(), view, &relocalizer);
  ASSERT_EQ(suggestions.size(), 1u);
  EXPECT_LT(DistanceOf(suggestions[0].camera_from_map, view), 0.1);
}

TEST(DescriptorRelocalizer, DescribesNoMoreKeyFramesInOneCallThanAllowed) {
  DescriptorRelocalizer at_once({.keyframes_a_call = 3}), none({.keyframes_a_call = 0}),
      by_and_by({.keyframes_a_call = 1});
  const Rigid3 view = CameraAt({0.1, 0, 0});
  const auto wanted = SuggestFor(UsualCamera(), view, &at_once);
  ASSERT_EQ(wanted.size(), 1u);
  EXPECT_TRUE(SuggestFor(UsualCamera(), view, &none).empty());
  std::vector<DescriptorRelocalizer::Suggestion> got;
  for (int call = 0; call < 3; ++call) got = SuggestFor(UsualCamera(), view, &by_and_by);
  ASSERT_EQ(got.size(), 1u);
  EXPECT_EQ(got[0].inliers, wanted[0].inliers);
  EXPECT_TRUE(got[0].camera_from_map.translation == wanted[0].camera_from_map.translation);
}

TEST(DescriptorRelocalizer, SuggestsNothingForAnotherRoom) {
  DescriptorRelocalizer relocalizer({.keyframes_a_call = 3});
  const auto other = testing_world::RenderedWorld::Room(99);
  const auto features = MakeFeatures(other.Render(*UsualCamera(), CameraAt({0, 0, 0}), 2));
  const DescribedImage image = DescribeAtResolution(*features, *UsualCamera(), UsualCamera()->PixelAngle());
  EXPECT_TRUE(relocalizer.Suggest(image.corners, *UsualCamera(), AllKeyFrames(), 3).empty());
}

}  // namespace
}  // namespace docent::engine
