// SPDX-License-Identifier: Apache-2.0
#include "engine/map/map_readout.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>

namespace docent::engine {
namespace {

std::shared_ptr<const CameraModel> Camera(double focal) {
  return std::make_shared<CameraModel>(LensModel::kRadialTangential,
                                       CameraModel::Intrinsics{640, 480, focal, focal, 319.5, 239.5},
                                       std::array<double, 5>{});
}

std::shared_ptr<const CameraModel> Image(const std::shared_ptr<const CameraModel>& camera, double rate,
                                         double readout_s) {
  return std::make_shared<CameraModel>(CameraModel::WithReadout(camera, {{0, rate, 0}, {0, readout_s}}));
}

KeyFrameId AddKeyFrame(const std::shared_ptr<const CameraModel>& camera, Map* map) {
  KeyFrame keyframe;
  keyframe.camera = camera;
  return map->AddKeyFrame(keyframe).keyframe.id;
}

double ReadoutOf(KeyFrameId id, const Map& map) {
  return map.keyframes().at(id).keyframe.camera->readout_motion().readout_s.y();
}

TEST(MapReadout, GivesTheReadoutTimeToEarlierImagesOfTheSameCamera) {
  const auto camera = Camera(500), other = Camera(600);
  Map map;
  const KeyFrameId turning = AddKeyFrame(Image(camera, 0.7, 0), &map), unknown = AddKeyFrame(camera, &map),
                   of_other = AddKeyFrame(Image(other, 0.7, 0.01), &map);
  EXPECT_TRUE(SetReadout(*camera, {0, 0.02}, &map));
  EXPECT_DOUBLE_EQ(ReadoutOf(turning, map), 0.02);
  const CameraModel& updated = *map.keyframes().at(turning).keyframe.camera;
  EXPECT_DOUBLE_EQ(updated.readout_motion().rotation_rate.y(), 0.7) << "each image keeps its own motion";
  EXPECT_EQ(updated.lens_of_image(), camera);
  EXPECT_EQ(map.keyframes().at(unknown).keyframe.camera, camera) << "how it moved is not known";
  EXPECT_DOUBLE_EQ(ReadoutOf(of_other, map), 0.01);
  EXPECT_FALSE(SetReadout(*camera, {0, 0.02}, &map)) << "they have it already";
}

TEST(MapReadout, KnowsTheLargestRotationRateOfACamera) {
  const auto camera = Camera(500), other = Camera(600);
  Map map;
  EXPECT_DOUBLE_EQ(LargestRotationRateIn(*map.Snapshot(), *camera), 0);
  AddKeyFrame(camera, &map);
  AddKeyFrame(Image(camera, 0.3, 0), &map);
  AddKeyFrame(Image(camera, -0.7, 0), &map);
  AddKeyFrame(Image(camera, 0.1, 0), &map);
  AddKeyFrame(Image(other, 2, 0), &map);
  EXPECT_DOUBLE_EQ(LargestRotationRateIn(*map.Snapshot(), *camera), 0.7);
  map.SetFirstUnadjusted(AddKeyFrame(Image(camera, 0.9, 0), &map));
  EXPECT_DOUBLE_EQ(LargestRotationRateIn(*map.Snapshot(), *camera), 0.7) << "the newest is not adjusted yet";
  map.SetFirstUnadjusted(kNoId);
  EXPECT_DOUBLE_EQ(LargestRotationRateIn(*map.Snapshot(), *camera), 0.9);
}

TEST(MapReadout, TurnsInfinitePointsToWhereTheyWereSeen) {
  const auto camera = Camera(500);
  Map map;
  const KeyFrameId id = AddKeyFrame(Image(camera, 1, 0), &map);
  const PanoramaId panorama = map.OpenPanorama(id);
  const Eigen::Vector2d pixel(320, 470);  // near the last row
  MapPoint point;
  point.panorama = panorama;
  point.point_in_map << *camera->Unproject(pixel), 0.0;
  point.source_keyframe = id;
  const MapPointId seen = map.AddPoint(point);
  map.AddObservation({id, seen, pixel.cast<float>(), 0});
  ASSERT_TRUE(SetReadout(*camera, {0, 0.02}, &map));
  const Eigen::Vector3d direction = map.FindPoint(seen)->point.position().normalized();
  // Exposed almost 10 ms after the middle of the image, when the camera had turned by almost 0.01 radians.
  const double angle = std::acos(direction.dot(*camera->Unproject(pixel)));
  EXPECT_NEAR(angle, 0.02 * ((470.5) / 480 - 0.5), 2e-3);
  EXPECT_LT((*map.keyframes().at(id).keyframe.camera->Project(direction) - pixel).norm(), 0.05);
}

TEST(MapReadout, IsThatOfTheNewestImageOfTheLens) {
  const auto camera = Camera(500), other = Camera(600);
  Map map;
  EXPECT_FALSE(ReadoutIn(map, *camera));
  AddKeyFrame(Image(camera, 0.7, 0.02), &map);
  AddKeyFrame(Image(other, 0.7, 0.01), &map);
  AddKeyFrame(camera, &map);  // how it moved is not known
  EXPECT_EQ(ReadoutIn(map, *camera), Eigen::Vector2d(0, 0.02));
  EXPECT_EQ(ReadoutIn(map, *Image(other, -2, 0)), Eigen::Vector2d(0, 0.01));
  EXPECT_FALSE(ReadoutIn(map, *Camera(700)));
  const auto snapshot = map.Snapshot();
  EXPECT_EQ(ReadoutIn(*snapshot, *camera), Eigen::Vector2d(0, 0.02));
  EXPECT_FALSE(ReadoutIn(*snapshot, *Camera(700)));
}

TEST(MapReadout, DoesNotReplaceThatOfTheCalibration) {
  const auto known = std::make_shared<const CameraModel>(Camera(500)->WithKnownReadout({0, 0.03}));
  Map map;
  AddKeyFrame(Image(Camera(500), 0.7, 0.02), &map);
  const auto image = Image(known, 0.7, 0.03);
  EXPECT_EQ(WithReadoutIn(map, image), image);
}

// The readout times that images of one lens have in A and B once the maps are one.
std::array<double, 2> United(const std::shared_ptr<const CameraModel>& a,
                             const std::shared_ptr<const CameraModel>& b) {
  Map map;
  const KeyFrameId of_a = AddKeyFrame(a, &map), of_b = AddKeyFrame(b, &map);
  UniteReadouts(of_b, &map);
  return {ReadoutOf(of_a, map), ReadoutOf(of_b, map)};
}

TEST(MapReadout, IsTheSameOnceTwoMapsAreOne) {
  const auto camera = Camera(500);
  const auto untold = Image(camera, 0.7, 0), told = Image(camera, 0.4, 0.02),
             differently = Image(camera, -0.2, 0.03);
  using Pair = std::array<double, 2>;
  EXPECT_EQ(United(told, differently), (Pair{0.02, 0.02})) << "that of the first map";
  EXPECT_EQ(United(told, untold), (Pair{0.02, 0.02}));
  EXPECT_EQ(United(untold, told), (Pair{0.02, 0.02})) << "the first map tells none";
  EXPECT_EQ(United(untold, untold), (Pair{0, 0}));
  EXPECT_EQ(United(told, Image(Camera(600), 0.7, 0.03)), (Pair{0.02, 0.03})) << "they are two lenses";
  const auto global = std::make_shared<const CameraModel>(camera->WithKnownReadout({0, 0}));
  EXPECT_EQ(United(Image(global, 0.7, 0), told), (Pair{0, 0})) << "the calibration says so";
  EXPECT_EQ(United(told, Image(global, 0.7, 0)), (Pair{0, 0})) << "the calibration says so";
}

TEST(MapReadout, GoesToANewImageOfTheSameLens) {
  const auto camera = Camera(500);
  Map map;
  AddKeyFrame(Image(camera, 0.7, 0.02), &map);
  const auto image = Image(camera, -0.4, 0);
  const auto updated = WithReadoutIn(map, image);
  EXPECT_EQ(updated->readout_motion().readout_s, Eigen::Vector2d(0, 0.02));
  EXPECT_EQ(updated->readout_motion().rotation_rate, image->readout_motion().rotation_rate);
  EXPECT_EQ(WithReadoutIn(map, updated), updated) << "it has it already";
  EXPECT_EQ(WithReadoutIn(map, camera), camera) << "its motion is not known";
  const auto other = Image(Camera(600), 0.3, 0);
  EXPECT_EQ(WithReadoutIn(map, other), other);
}

}  // namespace
}  // namespace docent::engine
