// SPDX-License-Identifier: Apache-2.0
#include "engine/matching/pose_refinement.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "engine/base/random.h"
#include "tests/engine/geometry/test_math.h"
#include "tests/engine/rendered_world.h"

namespace docent::engine {
namespace {

const CameraModel kLens(LensModel::kRadialTangential, {640, 480, 400, 402, 320, 238},
                        {-0.2, 0.05, 1e-3, -5e-4, 0});

Rigid3 TruePose() {
  return testing_world::CameraAt({0.3, -0.2, -0.1}, {4, -8, 11});
}

Rigid3 Perturbed(Random* random, double distance_m, double angle_deg) {
  Vector6 twist;
  for (int i = 0; i < 3; ++i) {
    twist[i] = random->Uniform(-distance_m, distance_m);
    twist[i + 3] = Radians(random->Uniform(-angle_deg, angle_deg));
  }
  return Rigid3::Exp(twist) * TruePose();
}

// Adds points spread over the image, one to four metres away, on four pyramid levels, with noise in
// proportion to the pixel size of the level. With `infinite`, the points are infinite.
void AddMeasurements(int count, double noise_sigmas, bool infinite, Random* random,
                     std::vector<PoseMeasurement>* measurements) {
  for (int i = 0; i < count; ++i) {
    const double y = random->Uniform(10, 470);  // one after the other; see RandomNormals
    const double x = random->Uniform(10, 630);
    const Eigen::Vector2d pixel(x, y);
    const double sigma = 1 << random->Below(4);
    PoseMeasurement measurement;
    const Eigen::Vector3d ray = *kLens.Unproject(pixel);
    if (infinite) {
      measurement.point_in_map << TruePose().rotation.inverse() * ray, 0;
    } else {
      measurement.point_in_map << TruePose().inverse() * Eigen::Vector3d(random->Uniform(1, 4) * ray), 1;
    }
    measurement.pixel = pixel + noise_sigmas * sigma * RandomNormals(random);
    measurement.inverse_sigma = 1 / sigma;
    measurements->push_back(measurement);
  }
}

PoseRefinement Refine(const Rigid3& start, std::vector<PoseMeasurement>* measurements) {
  PoseRefinementMemory memory;
  return RefinePose(kLens, start, {}, measurements, &memory, {Eigen::Vector3d::Zero(), start});
}

Vector6 PoseError(const PoseRefinement& refined) {
  return (refined.camera_from_map * TruePose().inverse()).Log();
}

TEST(PoseRefinement, IsExactWithoutNoise) {
  Random random(1);
  for (int trial = 0; trial < 30; ++trial) {
    std::vector<PoseMeasurement> measurements;
    AddMeasurements(60, 0, false, &random, &measurements);
    const PoseRefinement refined = Refine(Perturbed(&random, 0.1, 4), &measurements);
    EXPECT_TRUE(refined.converged);
    EXPECT_EQ(refined.inliers, 60);
    EXPECT_LT(PoseError(refined).norm(), 1e-5);
  }
}

TEST(PoseRefinement, FindsThePoseWithThirtyPercentOutliers) {
  Random random(2);
  for (int trial = 0; trial < 30; ++trial) {
    std::vector<PoseMeasurement> measurements;
    AddMeasurements(140, 0.7, false, &random, &measurements);
    AddMeasurements(60, 0.7, false, &random, &measurements);
    for (std::size_t i = 140; i < 200; ++i)
      measurements[i].pixel += 0.5 / measurements[i].inverse_sigma *
                               Eigen::Vector2d(random.Uniform(40, 120), random.Uniform(-120, 120));
    const PoseRefinement refined = Refine(Perturbed(&random, 0.04, 1.5), &measurements);
    EXPECT_TRUE(refined.converged);
    EXPECT_LT(PoseError(refined).head<3>().norm(), 0.015);
    EXPECT_LT(PoseError(refined).tail<3>().norm(), 0.006);
    EXPECT_NEAR(refined.sigma, 0.7, 0.35);
    int accepted_outliers = 0, rejected_inliers = 0;
    for (std::size_t i = 0; i < 200; ++i) {
      const bool accepted = measurements[i].weight > 1e-3;
      (i < 140 ? rejected_inliers : accepted_outliers) += i < 140 ? !accepted : accepted;
    }
    EXPECT_EQ(accepted_outliers, 0);
    EXPECT_LT(rejected_inliers, 4);
  }
}

TEST(PoseRefinement, CovarianceMatchesTheErrors) {
  Random random(3);
  constexpr int kTrials = 400;
  double squared_distance = 0;
  Matrix6 scatter = Matrix6::Zero(), estimated = Matrix6::Zero();
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<PoseMeasurement> measurements;
    AddMeasurements(100, 1, false, &random, &measurements);
    const PoseRefinement refined = Refine(Perturbed(&random, 0.02, 1), &measurements);
    ASSERT_TRUE(refined.converged);
    const Vector6 error = PoseError(refined);
    squared_distance += error.dot(refined.covariance.ldlt().solve(error)) / kTrials;
    scatter += error * error.transpose() / kTrials;
    estimated += refined.covariance / kTrials;
  }
  // With six degrees of freedom the mean is six. Tukey's weights make the estimated covariance slightly too
  // large.
  EXPECT_GT(squared_distance, 4.2);
  EXPECT_LT(squared_distance, 7.0);
  for (int i = 0; i < 6; ++i) {
    EXPECT_GT(estimated(i, i), 0.8 * scatter(i, i)) << i;
    EXPECT_LT(estimated(i, i), 1.7 * scatter(i, i)) << i;
  }
}

TEST(PoseRefinement, CovarianceShrinksWithMoreMeasurements) {
  Random random(4);
  std::vector<PoseMeasurement> few, many;
  AddMeasurements(50, 1, false, &random, &few);
  AddMeasurements(800, 1, false, &random, &many);
  const double ratio =
      Refine(TruePose(), &few).covariance.trace() / Refine(TruePose(), &many).covariance.trace();
  EXPECT_GT(ratio, 8);
  EXPECT_LT(ratio, 32);
}

TEST(PoseRefinement, DoesNotConvergeOnDegenerateMeasurements) {
  Random random(5);
  std::vector<PoseMeasurement> none, two, same, rays, line;
  AddMeasurements(2, 0, false, &random, &two);
  AddMeasurements(1, 0, false, &random, &same);
  same.resize(50, same[0]);
  AddMeasurements(4, 0.5, true, &random, &rays);
  // Points on one line in space: the camera could rotate about it.
  const Rigid3 map_from_camera = TruePose().inverse();
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d x(-1 + 0.04 * i, 0.3 - 0.01 * i, 2 + 0.02 * i);
    PoseMeasurement measurement;
    measurement.point_in_map << map_from_camera * x, 1;
    measurement.pixel = *kLens.Project(x);
    line.push_back(measurement);
  }
  EXPECT_FALSE(Refine(TruePose(), &none).converged);
  EXPECT_FALSE(Refine(TruePose(), &two).converged);
  EXPECT_FALSE(Refine(TruePose(), &same).converged);
  EXPECT_FALSE(Refine(TruePose(), &rays).converged);
  EXPECT_FALSE(Refine(TruePose(), &line).converged);
}

TEST(PoseRefinement, IgnoresPointsBehindTheCamera) {
  Random random(6);
  std::vector<PoseMeasurement> measurements;
  AddMeasurements(80, 0.5, false, &random, &measurements);
  for (std::size_t i = 0; i < 20; ++i) {
    const Eigen::Vector3d x = TruePose() * Eigen::Vector3d(measurements[i].point_in_map.head<3>());
    measurements[i].point_in_map.head<3>() = TruePose().inverse() * Eigen::Vector3d(-x);
  }
  const PoseRefinement refined = Refine(TruePose(), &measurements);
  EXPECT_TRUE(refined.converged);
  EXPECT_LE(refined.inliers, 60);
  EXPECT_LT(PoseError(refined).norm(), 0.02);
  for (std::size_t i = 0; i < 20; ++i) EXPECT_EQ(measurements[i].weight, 0);
}

TEST(PoseRefinement, InfinitePointsImproveTheRotation) {
  Random random(7);
  std::vector<PoseMeasurement> finite, mixed;
  AddMeasurements(60, 0.5, false, &random, &finite);
  mixed = finite;
  AddMeasurements(400, 0.5, true, &random, &mixed);
  const PoseRefinement alone = Refine(Perturbed(&random, 0.02, 1), &finite);
  const PoseRefinement both = Refine(Perturbed(&random, 0.02, 1), &mixed);
  ASSERT_TRUE(alone.converged && both.converged);
  EXPECT_EQ(alone.observed, ObservedMotion::kSixDof);
  EXPECT_EQ(both.observed, ObservedMotion::kHybrid);
  EXPECT_EQ(both.finite_inliers, alone.inliers);
  EXPECT_GT(both.inliers, both.finite_inliers + 300);
  EXPECT_LT((both.covariance.bottomRightCorner<3, 3>().trace()),
            (alone.covariance.bottomRightCorner<3, 3>().trace()));
}

// All infinite points indicate half a degree more rotation than the finite ones. They have a hundredth of the
// weight each (hybrid-slam §3.1), and no influence on the translation.
TEST(PoseRefinement, FollowsFinitePointsWhereInfiniteOnesDisagree) {
  Random random(11);
  std::vector<PoseMeasurement> finite, mixed, turned;
  AddMeasurements(100, 0.2, false, &random, &finite);
  AddMeasurements(150, 0.2, true, &random, &turned);
  const Rotation3 more = Rotation3::Exp({0, kPi / 360, 0});
  for (PoseMeasurement& measurement : turned) {
    const Eigen::Vector3d ray = *kLens.Unproject(measurement.pixel);
    measurement.point_in_map << TruePose().rotation.inverse() * (more * ray), 0;
  }
  mixed = finite;
  mixed.insert(mixed.end(), turned.begin(), turned.end());
  const PoseRefinement alone = Refine(TruePose(), &finite);
  const PoseRefinement both = Refine(TruePose(), &mixed);
  ASSERT_TRUE(both.converged);
  EXPECT_LT((both.camera_from_map.rotation.inverse() * alone.camera_from_map.rotation).Angle(),
            0.1 * kPi / 360);
  EXPECT_LT((both.camera_from_map.OriginInSource() - alone.camera_from_map.OriginInSource()).norm(), 0.003);
}

TEST(PoseRefinement, RotatesAboutTheInitialCentreWithInfinitePointsOnly) {
  Random random(13);
  for (const int finite : {0, 6}) {
    for (int round = 0; round < 20; ++round) {
      std::vector<PoseMeasurement> measurements;
      AddMeasurements(150, 0.5, true, &random, &measurements);
      AddMeasurements(finite, 0.5, false, &random, &measurements);
      // The start differs by a rotation only; the rays do not constrain the centre.
      Rigid3 start = Perturbed(&random, 0, 2);
      start = Rigid3(start.rotation, -(start.rotation * TruePose().OriginInSource()));
      const PoseRefinement refined = Refine(start, &measurements);
      ASSERT_TRUE(refined.converged);
      EXPECT_EQ(refined.observed, ObservedMotion::kPanorama);
      EXPECT_LT((refined.camera_from_map.OriginInSource() - start.OriginInSource()).norm(), 1e-9);
      EXPECT_LT((refined.camera_from_map.rotation.inverse() * TruePose().rotation).Angle(), 1e-3);
      EXPECT_EQ((refined.covariance.topLeftCorner<3, 3>().norm()), 0);
      EXPECT_GT((refined.covariance.bottomRightCorner<3, 3>().trace()), 0);
    }
  }
}

// Infinite points with an assumed distance, observed by a camera that has rotated about a point behind it.
TEST(PoseRefinement, RotatesAboutThePivotWhenOnlyTheRotationIsObserved) {
  Random random(12);
  const Eigen::Vector3d pivot(0.1, 0, -0.6);
  constexpr double kDistance = 2.5;
  const Rigid3 source = TruePose();
  const Rotation3 rotation = Rotation3::Exp({0.02, 0.3, -0.01});
  const Eigen::Vector3d fixed_in_map = source.inverse() * pivot;
  const Rigid3 turned(rotation * source.rotation, pivot - rotation * source.rotation * fixed_in_map);
  std::vector<PoseMeasurement> measurements;
  while (measurements.size() < 60) {
    const Eigen::Vector3d ray = *kLens.Unproject({random.Uniform(10, 630), random.Uniform(10, 470)});
    PoseMeasurement measurement;
    measurement.direction = true;
    measurement.point_in_map << (source.rotation.inverse() * ray + source.OriginInSource() / kDistance),
        1 / kDistance;
    const auto pixel = kLens.Project((turned * measurement.point_in_map).head<3>());
    if (!pixel || !kLens.IsInside(*pixel, 4)) continue;
    measurement.pixel = *pixel;
    measurements.push_back(measurement);
  }
  const Rotation3 guess = Rotation3::Exp({-0.02, 0.04, 0.03}) * turned.rotation;
  const Rigid3 start(guess, pivot - guess * fixed_in_map);
  PoseRefinementMemory memory;
  const PoseRefinement refined = RefinePose(kLens, start, {}, &measurements, &memory, {pivot, start});
  EXPECT_TRUE(refined.converged);
  EXPECT_EQ(refined.observed, ObservedMotion::kPanorama);
  EXPECT_EQ(refined.inliers, 60);
  EXPECT_EQ(refined.finite_inliers, 0);
  EXPECT_LT((refined.camera_from_map * turned.inverse()).Log().norm(), 1e-6);
}

// However small the assumed distance of an infinite point is, only the finite points determine the position.
TEST(PoseRefinement, AssumedDistancesDoNotMoveTheCamera) {
  Random random(13);
  std::vector<PoseMeasurement> finite;
  AddMeasurements(80, 0.5, false, &random, &finite);
  std::vector<PoseMeasurement> mixed = finite;
  AddMeasurements(80, 0.5, true, &random, &mixed);
  for (PoseMeasurement& measurement : mixed) {
    if (measurement.point_in_map[3] != 0) continue;
    measurement.direction = true;
    measurement.point_in_map +=
        (TruePose().OriginInSource() / 0.7).homogeneous() - Eigen::Vector4d(0, 0, 0, 1);
    measurement.point_in_map[3] = 1 / 0.7;
  }
  const Rigid3 start = Perturbed(&random, 0.02, 1);
  const PoseRefinement alone = Refine(start, &finite), together = Refine(start, &mixed);
  EXPECT_EQ(together.observed, ObservedMotion::kHybrid);
  EXPECT_LT((alone.camera_from_map.OriginInSource() - together.camera_from_map.OriginInSource()).norm(),
            3e-4);
}

// The matrix of the normal equations after a refinement without any error, where every robust weight is one.
Matrix6 Information(std::vector<PoseMeasurement> measurements) {
  const PoseRefinement refined = Refine(TruePose(), &measurements);
  EXPECT_TRUE(refined.converged);
  EXPECT_LT(PoseError(refined).norm(), 1e-9);
  const double sigma = PoseRefinementOptions().min_sigma;
  return sigma * sigma * refined.covariance.inverse();
}

// Each measurement adds J^T J, where J must equal the numeric derivative of the projection, for finite and
// infinite points.
TEST(PoseRefinement, JacobiansMatchNumericDifferences) {
  Random random(17);
  for (int round = 0; round < 10; ++round) {
    std::vector<PoseMeasurement> measurements;
    AddMeasurements(30, 0, false, &random, &measurements);
    AddMeasurements(40, 0, true, &random, &measurements);
    Matrix6 numeric = Matrix6::Zero();
    for (const PoseMeasurement& measurement : measurements) {
      Eigen::Matrix<double, 2, 6> jacobian;
      for (int i = 0; i < 6; ++i) {
        constexpr double kStep = 1e-6;
        const auto moved = [&](double step) -> Eigen::Vector2d {
          const Rigid3 pose = Rigid3::Exp(Vector6(step * Vector6::Unit(i))) * TruePose();
          const Eigen::Vector4d& x = measurement.point_in_map;
          return *kLens.Project(pose.rotation * Eigen::Vector3d(x.head<3>()) + x[3] * pose.translation);
        };
        jacobian.col(i) = (moved(kStep) - moved(-kStep)) / (2 * kStep) * measurement.inverse_sigma;
      }
      const bool infinite = measurement.point_in_map[3] == 0;
      numeric += (infinite ? 0.01 : 1.0) * jacobian.transpose() * jacobian;
    }
    const Matrix6 information = Information(measurements);
    EXPECT_LT((information - numeric).norm(), 1e-5 * numeric.norm());
  }
}

// Infinite points add no information on the translation or on its correlation with the rotation (hybrid-slam
// eq. 1-2).
TEST(PoseRefinement, InfinitePointsDoNotConstrainTheTranslation) {
  Random random(19);
  for (int round = 0; round < 10; ++round) {
    std::vector<PoseMeasurement> finite, mixed;
    AddMeasurements(30, 0, false, &random, &finite);
    mixed = finite;
    AddMeasurements(400, 0, true, &random, &mixed);
    const Matrix6 alone = Information(finite), both = Information(mixed);
    const double size = alone.norm();
    EXPECT_LT(((both - alone).topRows<3>().norm()), 1e-6 * size);
    EXPECT_LT(((both - alone).leftCols<3>().norm()), 1e-6 * size);
    const Matrix6 more = both - alone;
    EXPECT_GT((more.bottomRightCorner<3, 3>().trace()), 1e-3 * size);
  }
}

// Adds points in a strip at the image border, where translation and rotation shift them alike. Twenty points
// spread over the image determine a pose, but twenty in this strip do not.
void AddPointsAtTheBorder(int count, const Rigid3& seen_from, Random* random,
                          std::vector<PoseMeasurement>* measurements) {
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector2d pixel(random->Uniform(4, 30), random->Uniform(100, 300));
    PoseMeasurement measurement;
    measurement.point_in_map << seen_from.inverse() *
                                    Eigen::Vector3d(random->Uniform(2.5, 3) * *kLens.Unproject(pixel)),
        1;
    measurement.pixel = pixel + RandomNormals(random);
    measurements->push_back(measurement);
  }
}

double DistanceMoved(const PoseRefinement& refined, const Rigid3& from) {
  return (refined.camera_from_map.OriginInSource() - from.OriginInSource()).norm();
}

TEST(PoseRefinement, KeepsThePositionWhenFinitePointsConstrainItPoorly) {
  Random random(23);
  std::vector<PoseMeasurement> at_border, spread;
  AddMeasurements(100, 0.5, true, &random, &at_border);
  spread = at_border;
  AddMeasurements(60, 0.2, false, &random, &spread);
  AddPointsAtTheBorder(20, TruePose(), &random, &at_border);
  const Rigid3 start = Perturbed(&random, 0, 0.5);
  const PoseRefinement with_pivot = Refine(start, &at_border), placed = Refine(start, &spread);
  EXPECT_EQ(with_pivot.observed, ObservedMotion::kPanorama);
  EXPECT_LT(DistanceMoved(with_pivot, start),
            2 * PoseRefinementOptions().max_position_sigma * with_pivot.mean_depth);
  EXPECT_EQ(placed.observed, ObservedMotion::kHybrid);
}

TEST(PoseRefinement, KeepsToACertainPivotUnlessPointsConstrainThePositionWell) {
  Random random(29);
  const Eigen::Vector3d pivot(0, 0, -0.5);
  const Rotation3 rotation = Rotation3::Exp({0, 0.02, 0});
  const Rigid3 before = TruePose();
  const Eigen::Vector3d fixed_in_map = before.inverse() * pivot;
  const Rigid3 turned(rotation * before.rotation, pivot - rotation * before.rotation * fixed_in_map);
  PoseRefinementMemory memory;
  double without_pivot = 0, with_pivot = 0;
  constexpr int kTrials = 20;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<PoseMeasurement> at_border;
    AddPointsAtTheBorder(30, turned, &random, &at_border);
    const auto mean_rotation_error = [&](bool reliable) {
      const PoseRefinement refined =
          RefinePose(kLens, before, {}, &at_border, &memory, {pivot, before, reliable});
      EXPECT_EQ(refined.observed, reliable ? ObservedMotion::kPanorama : ObservedMotion::kSixDof);
      return (refined.camera_from_map.rotation * turned.rotation.inverse()).Angle() / kTrials;
    };
    without_pivot += mean_rotation_error(false);
    with_pivot += mean_rotation_error(true);
  }
  EXPECT_LT(with_pivot, 0.4 * without_pivot);

  // The camera has moved sideways by two hundredths of the depth, and points all over the image show it.
  std::vector<PoseMeasurement> spread;
  AddMeasurements(400, 0.3, false, &random, &spread);
  const Rigid3 aside = testing_world::CameraAt({0.05, 0, 0}) * TruePose();
  const PoseRefinement placed = RefinePose(kLens, aside, {}, &spread, &memory, {pivot, aside, true});
  EXPECT_EQ(placed.observed, ObservedMotion::kSixDof);
  EXPECT_LT(DistanceMoved(placed, TruePose()), 0.3 * 0.05);
}

TEST(PoseRefinement, MovesAlongWellConstrainedDirectionsOnly) {
  Random random(31);
  // The strip is tall enough to constrain vertical motion.
  const Rigid3 start = Rigid3::Exp((Vector6() << 0, 0.01, 0, 0, 0, 0).finished()) * TruePose();
  std::vector<PoseMeasurement> at_border;
  AddMeasurements(100, 0.1, true, &random, &at_border);
  AddPointsAtTheBorder(200, TruePose(), &random, &at_border);
  PoseRefinementOptions strict;
  strict.max_position_sigma = 0.0025;
  PoseRefinementMemory memory;
  const PoseRefinement refined =
      RefinePose(kLens, start, strict, &at_border, &memory, {Eigen::Vector3d::Zero(), start});
  EXPECT_EQ(refined.observed, ObservedMotion::kPanorama);
  EXPECT_LT(std::abs(PoseError(refined)[1]), 0.005);
}

// Adds points of a wall four metres away, in the middle of the image. The map has the wall turned by this
// angle about the vertical, as keyframes with little parallax leave it.
void AddTurnedWall(int count, double angle_deg, Random* random, std::vector<PoseMeasurement>* measurements) {
  const Eigen::Vector3d middle(0, 0, 4);
  const Rotation3 turn = Rotation3::Exp({0, Radians(angle_deg), 0});
  for (int i = 0; i < count; ++i) {
    const double x = random->Uniform(-1, 1), y = random->Uniform(-0.8, 0.8);
    const Eigen::Vector3d in_camera = middle + Eigen::Vector3d(x, y, 0);
    PoseMeasurement measurement;
    measurement.point_in_map << TruePose().inverse() * Eigen::Vector3d(middle + turn * (in_camera - middle)),
        1;
    measurement.pixel = *kLens.Project(in_camera) + 0.5 * RandomNormals(random);
    measurements->push_back(measurement);
  }
}

TEST(PoseRefinement, UsesThePredictedCenterBeforeADistantWall) {
  Random random(37);
  for (int trial = 0; trial < 10; ++trial) {
    std::vector<PoseMeasurement> wall;
    AddTurnedWall(120, 4, &random, &wall);
    const auto error_m = [&](const std::optional<PredictedPosition>& center) {
      PoseRefinementMemory memory;
      const PoseRefinement refined = RefinePose(kLens, TruePose(), {}, &wall, &memory,
                                                {Eigen::Vector3d::Zero(), TruePose(), false, center});
      EXPECT_EQ(refined.used_center, center.has_value());
      EXPECT_EQ(refined.observed, ObservedMotion::kSixDof);
      return DistanceMoved(refined, TruePose());
    };
    EXPECT_GT(error_m(std::nullopt), 0.15);
    EXPECT_LT(error_m(PredictedPosition{TruePose().OriginInSource(), 0.02}), 0.03);
  }
}

TEST(PoseRefinement, IgnoresThePredictedCenterWherePointsDetermineThePosition) {
  Random random(41);
  std::vector<PoseMeasurement> spread;
  AddMeasurements(300, 0.5, false, &random, &spread);
  const PredictedPosition wrong{TruePose().OriginInSource() + Eigen::Vector3d(0.2, 0, 0), 1e-3};
  PoseRefinementMemory memory;
  const PoseRefinement with = RefinePose(kLens, TruePose(), {}, &spread, &memory,
                                         {Eigen::Vector3d::Zero(), TruePose(), false, wrong});
  const PoseRefinement without = Refine(TruePose(), &spread);
  EXPECT_FALSE(with.used_center);
  EXPECT_TRUE(IsNear(with.camera_from_map, without.camera_from_map, 1e-12, 1e-12));
}

TEST(PoseRefinement, UsesTheMotionThatThePoseImplies) {
  // The camera stood still before, and turned until the middle of this image.
  const Rotation3 turn = Rotation3::Exp(Eigen::Vector3d(0.01, -0.04, 0.02));
  const Rigid3 before = Rigid3(turn.inverse(), Eigen::Vector3d::Zero()) * TruePose();
  constexpr double kInterval_s = 0.033;
  const Eigen::Vector2d readout_s(0, 0.03);
  const auto lens = std::make_shared<const CameraModel>(kLens);
  const auto camera_at = [&](const Rigid3& pose) {
    const Eigen::Vector3d rate = (pose.rotation * before.rotation.inverse()).Log() / kInterval_s;
    return std::make_shared<const CameraModel>(CameraModel::WithReadout(lens, {rate, readout_s}));
  };
  Random random(43);
  std::vector<PoseMeasurement> measurements;
  AddMeasurements(300, 0, false, &random, &measurements);
  const auto image = camera_at(TruePose());
  for (PoseMeasurement& measurement : measurements)
    measurement.pixel = *image->Project((TruePose() * measurement.point_in_map).head<3>()) +
                        0.3 / measurement.inverse_sigma * RandomNormals(&random);
  const auto error = [&](const CameraAtPose& camera_at_pose) {
    PoseRefinementMemory memory;
    return PoseError(RefinePose(kLens, before, {}, &measurements, &memory, {Eigen::Vector3d::Zero(), before},
                                camera_at_pose))
        .norm();
  };
  EXPECT_LT(error(camera_at), 0.2 * error(nullptr));
  EXPECT_LT(error(camera_at), 2 * error([&](const Rigid3&) { return image; }));
}

}  // namespace
}  // namespace docent::engine
