// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/calibration/lens_estimation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "engine/vision/features.h"
#include "tests/engine/mapping/calibration/lens_scene.h"

namespace docent::engine {
namespace {

using Progress = LensEstimation::Progress;

// A map of the scene with images without texture, in which guided matching finds no points.
Map MapOf(const LensScene& scene) {
  static const auto features = MakeFeatures(cv::Mat(480, 640, CV_8UC1, cv::Scalar(128)));
  Map map;
  for (const BundleProblem::Camera& camera : scene.problem.cameras) {
    KeyFrame keyframe;
    keyframe.fixed = camera.fixed;
    keyframe.camera = camera.model;
    keyframe.camera_from_map = camera.camera_from_map;
    keyframe.features = features;
    map.AddKeyFrame(keyframe);
  }
  std::vector<std::vector<Observation>> observations(scene.problem.points.size());
  for (const BundleProblem::Measurement& measurement : scene.problem.measurements) {
    observations[static_cast<std::size_t>(measurement.point)].push_back(
        {static_cast<KeyFrameId>(measurement.camera), 0, measurement.pixel, 0});
  }
  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (observations[i].size() < 2) continue;
    MapPoint point;
    point.point_in_map << scene.problem.points[i].position, 1;
    point.source_keyframe = observations[i].front().keyframe;
    point.source_pixel = observations[i].front().pixel;
    const MapPointId id = map.AddPoint(point);
    for (Observation observation : observations[i]) {
      observation.point = id;
      map.AddObservation(observation);
    }
  }
  for (auto& [id, record] : map.keyframes()) map.UpdateDepth(&record);
  return map;
}

LensEstimationOptions OptionsFor(const LensScene& scene) {
  LensEstimationOptions options;
  options.lenses.push_back({.model = scene.problem.cameras[0].model, .name = "phone"});
  return options;
}

double RelativeError(const LensScene& scene, const EstimatedLens& lens) {
  return std::abs(std::log(lens.model->intrinsics().fx / scene.true_focal()));
}

class LensEstimationTest : public ::testing::Test {
 protected:
  // Runs all steps that are due.
  void Finish(LensEstimation* estimation, Map* map) {
    int steps = 0;
    while (estimation->Step(&searcher_, nullptr, map) != Progress::kNothing) ASSERT_LT(++steps, 200);
  }
  PointSearcher searcher_;
};

TEST_F(LensEstimationTest, EstimatesTheLensAndAdaptsAllKeyFrames) {
  const LensScene scene = MakeLensScene({.field_of_view_deg = 90, .noise_px = 0.3, .from_60_degrees = true});
  Map map = MapOf(scene);
  const Rigid3 first_pose = map.keyframes().at(0).keyframe.camera_from_map;
  const std::uint64_t before = map.Snapshot()->revision;
  LensEstimation estimation(OptionsFor(scene));
  ASSERT_EQ(estimation.Step(&searcher_, nullptr, &map), Progress::kMapChanged);
  const EstimatedLens lens = estimation.last();
  EXPECT_LT(RelativeError(scene, lens), 0.02);
  // After a large first change, the remaining error may be large.
  EXPECT_GT(lens.focal_sigma, 0.02);
  EXPECT_EQ(lens.name, "phone");
  for (const auto& [id, record] : map.keyframes()) EXPECT_EQ(record.keyframe.camera, lens.model);
  EXPECT_TRUE(IsNear(map.keyframes().at(0).keyframe.camera_from_map, first_pose, 1e-9, 1e-9));
  const auto snapshot = map.Snapshot();
  ASSERT_EQ(snapshot->corrections.size(), 1u);
  EXPECT_EQ(snapshot->corrections.back()->revision, before + 1);
  EXPECT_EQ(snapshot->corrections.back()->after_from_before.size(), scene.problem.cameras.size());
  EXPECT_EQ(Validate(*snapshot), "");
  // The initial model is an earlier version of this lens.
  EXPECT_EQ(estimation.CurrentModel(scene.problem.cameras[0].model), lens.model);
  Finish(&estimation, &map);
  const EstimatedLens& final_lens = estimation.lenses()[0];
  EXPECT_LT(final_lens.focal_sigma, lens.focal_sigma);
  EXPECT_LT(RelativeError(scene, final_lens), 0.01);
  EXPECT_LT(RelativeError(scene, final_lens), 3 * final_lens.focal_sigma);
}

TEST_F(LensEstimationTest, TheCorrectionTransformsEachKeyFrameExactly) {
  const LensScene scene = MakeLensScene({.field_of_view_deg = 90, .noise_px = 0.3, .from_60_degrees = true});
  Map map = MapOf(scene);
  const auto before = map.Snapshot();
  LensEstimation estimation(OptionsFor(scene));
  ASSERT_EQ(estimation.Step(&searcher_, nullptr, &map), Progress::kMapChanged);
  const auto after = map.Snapshot();
  for (std::size_t i = 0; i < after->keyframes.size(); ++i) {
    const Sim3& moved = after->corrections.back()->after_from_before.at(after->keyframes[i].id);
    EXPECT_TRUE(IsNear(CorrectedPose(before->keyframes[i].camera_from_map, moved),
                       after->keyframes[i].camera_from_map, 1e-9, 1e-9));
  }
}

TEST_F(LensEstimationTest, FixesTheLensWhenEstimatesAgree) {
  const LensScene scene = MakeLensScene({.field_of_view_deg = 62, .noise_px = 0.3, .cameras = 40});
  LensEstimationOptions options = OptionsFor(scene);
  LensEstimation estimation(options);
  // The map grows: measurements of later keyframes are left out at first.
  std::shared_ptr<const CameraModel> lens;
  for (const int cameras : {10, 14, 20, 28, 40}) {
    LensScene part = scene;
    part.problem.cameras.resize(static_cast<std::size_t>(cameras));
    std::erase_if(part.problem.measurements, [&](const auto& seen) { return seen.camera >= cameras; });
    if (lens) {
      for (BundleProblem::Camera& camera : part.problem.cameras) camera.model = lens;
    }
    Map map = MapOf(part);
    Finish(&estimation, &map);
    lens = estimation.lenses()[0].model;
    const bool early = cameras < 20;
    EXPECT_FALSE(early && estimation.lenses()[0].fixed) << cameras;
  }
  EXPECT_TRUE(estimation.lenses()[0].fixed);
  EXPECT_LE(estimation.lenses()[0].focal_sigma, options.fixed_sigma);
  EXPECT_LT(RelativeError(scene, estimation.lenses()[0]), 3 * options.fixed_sigma);
  LensScene other = MakeLensScene({.field_of_view_deg = 70, .noise_px = 0.3});
  for (BundleProblem::Camera& camera : other.problem.cameras) camera.model = lens;
  Map map = MapOf(other);
  estimation.Reset();
  EXPECT_EQ(estimation.Step(&searcher_, nullptr, &map), Progress::kNothing);
}

// The keyframes that a growing map adds may be seen through another lens than the first ones: a wrong
// estimate and a right one after a wrong one cannot be told apart at first.
TEST_F(LensEstimationTest, ALargeStepNeedsAnotherEstimateThatConfirmsIt) {
  const LensScene narrow = MakeLensScene({.field_of_view_deg = 62, .noise_px = 0.3, .cameras = 80});
  const LensScene wide = MakeLensScene({.field_of_view_deg = 70, .noise_px = 0.3, .cameras = 80});
  LensEstimation estimation(OptionsFor(narrow));
  const auto grow = [&](LensScene scene, int cameras) {
    scene.problem.cameras.resize(static_cast<std::size_t>(cameras));
    std::erase_if(scene.problem.measurements, [&](const auto& seen) { return seen.camera >= cameras; });
    for (BundleProblem::Camera& camera : scene.problem.cameras) camera.model = estimation.lenses()[0].model;
    Map map = MapOf(scene);
    Finish(&estimation, &map);
    return estimation.lenses()[0].model;
  };
  grow(narrow, 10);
  const auto known = grow(narrow, 14);
  EXPECT_EQ(grow(wide, 19), known);
  EXPECT_NE(grow(wide, 25), known);
  EXPECT_LT(RelativeError(wide, estimation.lenses()[0]), 0.02);
}

TEST_F(LensEstimationTest, AdaptsAMapThatWasBuiltWithAnEarlierEstimate) {
  const LensScene scene = MakeLensScene({.field_of_view_deg = 80, .noise_px = 0.3, .from_60_degrees = true});
  Map map = MapOf(scene), old = map;
  LensEstimation estimation(OptionsFor(scene));
  Finish(&estimation, &map);
  const auto lens = estimation.lenses()[0].model;
  estimation.Reset();
  ASSERT_EQ(estimation.Step(&searcher_, nullptr, &old), Progress::kMapChanged);
  EXPECT_EQ(estimation.lenses()[0].model, lens);
  for (const auto& [id, record] : old.keyframes()) EXPECT_EQ(record.keyframe.camera, lens);
}

// A map was joined with one that had the newest estimate already.
TEST_F(LensEstimationTest, TurnsEachDependentKeyFrameByItsOwnChangeOfTheLens) {
  const LensScene scene = MakeLensScene({.field_of_view_deg = 80, .noise_px = 0.3, .from_60_degrees = true});
  Map map = MapOf(scene), joined = map;
  LensEstimation estimation(OptionsFor(scene));
  Finish(&estimation, &map);
  const auto before = scene.problem.cameras[0].model, lens = estimation.lenses()[0].model;
  const Eigen::Vector3d turn(0.1, -0.2, 0.05);
  const auto add_dependent = [&](KeyFrameId reference, const std::shared_ptr<const CameraModel>& camera) {
    KeyFrame dependent = joined.FindKeyFrame(reference)->keyframe;
    dependent.kind = KeyFrameKind::kPanorama;
    dependent.panorama = joined.OpenPanorama(reference);
    dependent.camera = camera;
    dependent.camera_from_map =
        Rigid3(Rotation3::Exp(turn), Eigen::Vector3d::Zero()) * dependent.camera_from_map;
    return joined.AddKeyFrame(dependent).keyframe.id;
  };
  const KeyFrameId old = add_dependent(1, before), current = add_dependent(2, lens);
  estimation.Reset();
  ASSERT_EQ(estimation.Step(&searcher_, nullptr, &joined), Progress::kMapChanged);
  const auto turn_of = [&](KeyFrameId dependent, KeyFrameId reference) {
    const Rotation3& from = joined.FindKeyFrame(reference)->keyframe.camera_from_map.rotation;
    return (joined.FindKeyFrame(dependent)->keyframe.camera_from_map.rotation * from.inverse()).Log();
  };
  const double ratio = lens->intrinsics().fx / before->intrinsics().fx;
  ASSERT_LT(ratio, 0.8);
  EXPECT_LT((turn_of(old, 1) - Eigen::Vector3d(0.1 / ratio, -0.2 / ratio, 0.05)).norm(), 1e-6);
  EXPECT_LT((turn_of(current, 2) - turn).norm(), 1e-6);
}

TEST_F(LensEstimationTest, TheCorrectionContainsADependentKeyFrameOfAnotherLens) {
  const LensScene scene = MakeLensScene({.field_of_view_deg = 90, .noise_px = 0.3, .from_60_degrees = true});
  Map map = MapOf(scene);
  KeyFrame dependent = map.FindKeyFrame(1)->keyframe;
  dependent.kind = KeyFrameKind::kPanorama;
  dependent.panorama = map.OpenPanorama(1);
  dependent.camera = std::make_shared<const CameraModel>(LensWithFocalLength(640, 480, 620, 0));
  dependent.camera_from_map =
      Rigid3(Rotation3::Exp({0.1, -0.2, 0.05}), Eigen::Vector3d::Zero()) * dependent.camera_from_map;
  const KeyFrameId id = map.AddKeyFrame(dependent).keyframe.id;
  LensEstimation estimation(OptionsFor(scene));
  ASSERT_EQ(estimation.Step(&searcher_, nullptr, &map), Progress::kMapChanged);
  const auto& moved = map.corrections().back()->after_from_before;
  EXPECT_EQ(moved.size(), map.keyframes().size());
  ASSERT_TRUE(moved.contains(id));
  EXPECT_TRUE(IsNear(CorrectedPose(dependent.camera_from_map, moved.at(id)),
                     map.FindKeyFrame(id)->keyframe.camera_from_map, 1e-9, 1e-9));
}

TEST_F(LensEstimationTest, ChangesNothingIfTheFocalLengthIsUndetermined) {
  const LensScene scene =
      MakeLensScene({.field_of_view_deg = 80, .noise_px = 0.5, .plane = true, .rotation = 0});
  Map map = MapOf(scene);
  LensEstimation estimation(OptionsFor(scene));
  EXPECT_EQ(estimation.Step(&searcher_, nullptr, &map), Progress::kNothing);
  EXPECT_EQ(map.keyframes().at(3).keyframe.camera, scene.problem.cameras[0].model);
  EXPECT_EQ(estimation.lenses()[0].model, scene.problem.cameras[0].model);
}

TEST_F(LensEstimationTest, IgnoresFewKeyFramesAndOtherCameras) {
  const LensScene few = MakeLensScene({.cameras = 3});
  Map map = MapOf(few);
  LensEstimation estimation(OptionsFor(few));
  EXPECT_EQ(estimation.Step(&searcher_, nullptr, &map), Progress::kNothing);
  Map others = MapOf(MakeLensScene({.field_of_view_deg = 90, .from_60_degrees = true}));
  EXPECT_EQ(estimation.Step(&searcher_, nullptr, &others), Progress::kNothing);
}

TEST_F(LensEstimationTest, AnInterruptedEstimateIsRepeated) {
  const LensScene scene = MakeLensScene({.field_of_view_deg = 90, .from_60_degrees = true});
  Map map = MapOf(scene);
  LensEstimation estimation(OptionsFor(scene));
  const std::atomic<bool> interrupt = true;
  EXPECT_EQ(estimation.Step(&searcher_, &interrupt, &map), Progress::kStepDone);
  EXPECT_EQ(map.keyframes().at(0).keyframe.camera, scene.problem.cameras[0].model);
  EXPECT_EQ(estimation.Step(&searcher_, nullptr, &map), Progress::kMapChanged);
}

TEST_F(LensEstimationTest, WarnsIfAGivenFocalLengthIsTooLongByHalf) {
  // The field of view is 77 degrees (402 px), but the given calibration says 55 degrees (620 px).
  LensScene scene = MakeLensScene({.field_of_view_deg = 77, .noise_px = 0.4, .from_60_degrees = true});
  const auto given = std::make_shared<const CameraModel>(LensWithFocalLength(640, 480, 620, 0));
  for (BundleProblem::Camera& camera : scene.problem.cameras) camera.model = given;
  const Map map = MapOf(scene);
  LensEstimation estimation({});
  const auto contradiction = estimation.Check(nullptr, map);
  ASSERT_TRUE(contradiction);
  EXPECT_EQ(contradiction->given_focal_px, 620);
  EXPECT_NEAR(contradiction->focal_px, scene.lens.intrinsics().fx, 4);
  EXPECT_FALSE(estimation.Check(nullptr, map)) << "it is reported only once";
  EXPECT_EQ(map.keyframes().at(0).keyframe.camera, given);
}

TEST_F(LensEstimationTest, WarnsOnlyOnceAboutACalibrationThatIsLoadedAgain) {
  LensScene scene = MakeLensScene({.field_of_view_deg = 77, .noise_px = 0.4, .from_60_degrees = true});
  LensEstimation estimation({});
  int warnings = 0;
  for (int map = 0; map < 2; ++map) {
    const auto given = std::make_shared<const CameraModel>(LensWithFocalLength(640, 480, 620, 0));
    for (BundleProblem::Camera& camera : scene.problem.cameras) camera.model = given;
    estimation.Reset();
    if (estimation.Check(nullptr, MapOf(scene))) ++warnings;
  }
  EXPECT_EQ(warnings, 1);
}

TEST_F(LensEstimationTest, DoesNotWarnAboutACorrectCalibration) {
  LensScene scene = MakeLensScene({.field_of_view_deg = 77, .k1 = -0.1, .noise_px = 0.4});
  const auto given = std::make_shared<const CameraModel>(scene.lens);
  for (BundleProblem::Camera& camera : scene.problem.cameras) camera.model = given;
  LensEstimation estimation({});
  EXPECT_FALSE(estimation.Check(nullptr, MapOf(scene)));
}

TEST_F(LensEstimationTest, ChecksTheFocalLengthOfAFisheyeLens) {
  const auto fisheye = [](double focal_px) {
    return std::make_shared<const CameraModel>(
        LensModel::kKannalaBrandt,
        CameraModel::Intrinsics{640, 480, 0.97 * focal_px, 1.03 * focal_px, 325, 236},
        std::array<double, 5>{0.01, -0.02, 0, 0, 0});
  };
  LensScene scene = MakeLensScene({.field_of_view_deg = 110, .noise_px = 0.4});
  for (BundleProblem::Measurement& measurement : scene.problem.measurements) {
    const Eigen::Vector3d ray = *scene.lens.Unproject(measurement.pixel.cast<double>());
    measurement.pixel = fisheye(300)->Project(ray)->cast<float>();
  }
  for (const double focal_px : {300., 450.}) {
    const auto given = fisheye(focal_px);
    for (BundleProblem::Camera& camera : scene.problem.cameras) camera.model = given;
    LensEstimation estimation({});
    const auto contradiction = estimation.Check(nullptr, MapOf(scene));
    EXPECT_EQ(contradiction.has_value(), focal_px == 450);
    if (contradiction) {
      EXPECT_NEAR(contradiction->focal_px, 300, 3);
    }
  }
}

}  // namespace
}  // namespace docent::engine
