// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/panorama/panorama_registration.h"

#include <gtest/gtest.h>

#include <map>
#include <vector>

#include "engine/base/random.h"
#include "tests/engine/geometry/test_math.h"
#include "tests/engine/mapping/panorama/panorama_scene.h"

namespace docent::engine {
namespace {

using testing_world::BlankKeyFrame;
using testing_world::CameraAt;

// Two panorama maps with a reference and three dependent keyframes each, in arbitrary orientations. Every
// keyframe observes the infinite points of its own panorama map, at noisy pixels.
class PanoramaRegistrationTest : public ::testing::TestWithParam<std::uint64_t> {
 protected:
  void SetUp() override {
    for (int i = 0; i < 2; ++i) AddPanorama();
    const KeyFrameId plain = map_.AddKeyFrame(BlankKeyFrame(CameraAt({3, 0, 0}))).keyframe.id;
    MapPoint finite;
    finite.point_in_map << RandomVector(&random_, 2), 1.0;
    finite.source_keyframe = plain;
    finite_ = map_.AddPoint(finite);
    map_.AddObservation({plain, finite_, {10, 10}, 0});
    ASSERT_EQ(Validate(*map_.Snapshot()), "");
  }

  void AddPanorama() {
    const Eigen::Vector3d center = RandomVector(&random_, 2);
    const KeyFrameId reference =
        map_.AddKeyFrame(BlankKeyFrame(CameraAt(center, RandomVector(&random_, 90)))).keyframe.id;
    const PanoramaId panorama = map_.OpenPanorama(reference);
    std::vector<KeyFrameId> members = {reference};
    for (int i = 0; i < 3; ++i) {
      KeyFrame dependent = BlankKeyFrame(CameraAt(center, RandomVector(&random_, 90)));
      dependent.kind = KeyFrameKind::kPanorama;
      dependent.panorama = panorama;
      members.push_back(map_.AddKeyFrame(dependent).keyframe.id);
    }
    for (int i = 0; i < 40; ++i) {
      MapPoint point;
      point.point_in_map = {0, 0, 1, 0};
      point.panorama = panorama;
      point.source_keyframe = members[static_cast<std::size_t>(i) % members.size()];
      point.source_pixel = {5, 5};
      const MapPointId id = map_.AddPoint(point);
      const Eigen::Vector2f pixel(static_cast<float>(random_.Uniform(1, 62)),
                                  static_cast<float>(random_.Uniform(1, 62)));
      map_.AddObservation({point.source_keyframe, id, pixel, 0});
      if (i % 2 == 0) {
        const KeyFrameId other = members[static_cast<std::size_t>(i + 1) % members.size()];
        map_.AddObservation({other, id, pixel + Eigen::Vector2f(-0.5f, 0.25f), 0});
      }
      map_.UpdateDirection(map_.FindPoint(id));
    }
  }

  // Every keyframe and infinite point relative to the reference of its panorama map.
  struct FromReference {
    std::map<KeyFrameId, Rigid3> keyframes;  // keyframe_from_reference
    std::map<MapPointId, Eigen::Vector3d> directions;
  };
  FromReference RelativeToReference(PanoramaId panorama) {
    FromReference seen;
    const Rigid3 reference_from_map =
        map_.FindKeyFrame(map_.panoramas()[panorama].reference)->keyframe.camera_from_map;
    for (const auto& [id, record] : map_.keyframes()) {
      if (record.keyframe.panorama == panorama)
        seen.keyframes[id] = record.keyframe.camera_from_map * reference_from_map.inverse();
    }
    for (const Map::PointRecord& record : map_.points()) {
      if (record.point.panorama == panorama)
        seen.directions[record.point.id] = reference_from_map.rotation * record.point.position();
    }
    return seen;
  }
  void MoveReference(PanoramaId panorama, const Eigen::Vector3d& by, const Eigen::Vector3d& rotation) {
    Rigid3& pose = map_.FindKeyFrame(map_.panoramas()[panorama].reference)->keyframe.camera_from_map;
    pose = Rigid3(Rotation3::Exp(rotation), by) * pose;
  }
  static void ExpectEqual(const FromReference& a, const FromReference& b, double tolerance) {
    ASSERT_EQ(a.keyframes.size(), b.keyframes.size());
    ASSERT_EQ(a.directions.size(), b.directions.size());
    for (const auto& [id, pose] : a.keyframes)
      EXPECT_TRUE(IsNear(pose, b.keyframes.at(id), tolerance, tolerance)) << id;
    for (const auto& [id, direction] : a.directions)
      EXPECT_LE((direction - b.directions.at(id)).norm(), tolerance) << id;
  }

  Random random_{GetParam()};
  Map map_;
  MapPointId finite_ = kNoId;
};

TEST_P(PanoramaRegistrationTest, KeepsRotationsAndDirectionsRelativeToTheReference) {
  for (int round = 0; round < 5; ++round) {
    const FromReference before[2] = {RelativeToReference(0), RelativeToReference(1)};
    const PanoramaRegistration registration(map_);
    MoveReference(0, RandomVector(&random_, 0.3), RandomVector(&random_, 0.5));
    MoveReference(1, RandomVector(&random_, 0.3), RandomVector(&random_, 0.5));
    registration.Follow(&map_);
    ExpectEqual(before[0], RelativeToReference(0), 1e-9);
    ExpectEqual(before[1], RelativeToReference(1), 1e-9);
    EXPECT_EQ(Validate(*map_.Snapshot()), "");
  }
}

TEST_P(PanoramaRegistrationTest, KeepsDependentKeyframesAtTheReferencesCentre) {
  const PanoramaRegistration registration(map_);
  MoveReference(1, {0.1, -0.2, 0.4}, {0.2, -0.1, 0.7});
  registration.Follow(&map_);
  const Rigid3 reference = map_.FindKeyFrame(map_.panoramas()[1].reference)->keyframe.camera_from_map;
  int dependents = 0;
  for (const auto& [id, record] : map_.keyframes()) {
    if (record.keyframe.panorama != 1 || record.keyframe.kind != KeyFrameKind::kPanorama) continue;
    ++dependents;
    EXPECT_LT((record.keyframe.camera_from_map.OriginInSource() - reference.OriginInSource()).norm(), 1e-9);
  }
  EXPECT_EQ(dependents, 3);
}

TEST_P(PanoramaRegistrationTest, LeavesPanoramasBitwiseEqualIfTheirReferenceDidNotMove) {
  const auto before = map_.Snapshot();
  const PanoramaRegistration registration(map_);
  MoveReference(0, {0.1, 0, 0}, {0, 0.1, 0});
  registration.Follow(&map_);
  const auto after = map_.Snapshot();
  for (std::size_t i = 0; i < before->keyframes.size(); ++i) {
    const KeyFrame &a = before->keyframes[i], &b = after->keyframes[i];
    const bool same =
        a.camera_from_map.translation == b.camera_from_map.translation &&
        a.camera_from_map.rotation.quaternion().coeffs() == b.camera_from_map.rotation.quaternion().coeffs();
    EXPECT_EQ(same, a.panorama != 0) << a.id;
  }
  for (std::size_t i = 0; i < before->points.size(); ++i) {
    const MapPoint &a = before->points[i], &b = after->points[i];
    EXPECT_EQ(a.point_in_map == b.point_in_map, a.panorama != 0) << a.id;
  }
}

// A panorama map that is opened in between is not moved, and a dependent keyframe that was localized in
// between keeps its pose.
TEST_P(PanoramaRegistrationTest, LeavesKeyframesThatWereLocalizedSinceUnchanged) {
  const PanoramaRegistration registration(map_);
  KeyFrameId localized = kNoId;
  for (const auto& [id, record] : map_.keyframes()) {
    if (record.keyframe.panorama == 0 && record.keyframe.kind == KeyFrameKind::kPanorama) localized = id;
  }
  const Rigid3 pose = CameraAt({0.5, 0.6, 0.7}, {10, 20, 30});
  map_.FindKeyFrame(localized)->keyframe.camera_from_map = pose;
  map_.OpenPanorama(localized);
  MoveReference(0, {0.1, 0, 0}, {0, 0.1, 0});
  registration.Follow(&map_);
  EXPECT_TRUE(testing_world::SamePose(map_.FindKeyFrame(localized)->keyframe.camera_from_map, pose));
  EXPECT_EQ(Validate(*map_.Snapshot()), "");
}

INSTANTIATE_TEST_SUITE_P(Seeds, PanoramaRegistrationTest, ::testing::Values(1, 2, 3));

}  // namespace
}  // namespace docent::engine
