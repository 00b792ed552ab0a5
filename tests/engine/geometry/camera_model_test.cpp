// SPDX-License-Identifier: Apache-2.0
#include "engine/geometry/camera_model.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <memory>
#include <opencv2/calib3d.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "engine/base/random.h"
#include "engine/geometry/projection_batch.h"
#include "tests/engine/geometry/transform_laws.h"

namespace docent::engine {
namespace {

using Distortion = std::array<double, 5>;

constexpr CameraModel::Intrinsics kIntrinsics{752, 480, 420.5, 421.6, 355.2, 250.3};

struct LensCase {
  const char* name;
  LensModel model;
  Distortion distortion;
};

// Lenses that are one-to-one over the whole image of kIntrinsics, from no distortion to strong distortion.
const std::vector<LensCase>& Lenses() {
  static const std::vector<LensCase> lenses = {
      {"pinhole", LensModel::kRadialTangential, {}},
      {"barrel", LensModel::kRadialTangential, {-0.296609, 0.080818}},
      {"barrel, decentred", LensModel::kRadialTangential, {-0.28, 0.09, 0.003, -0.004, -0.01}},
      {"pincushion", LensModel::kRadialTangential, {0.3, 0.1, -0.002, 0.001, 0.05}},
      {"FOV without distortion", LensModel::kFov, {0}},
      {"FOV nearly without distortion", LensModel::kFov, {1e-7}},
      {"FOV", LensModel::kFov, {0.93}},
      {"FOV, strong", LensModel::kFov, {1.4}},
      {"equidistant", LensModel::kKannalaBrandt, {}},
      {"fisheye", LensModel::kKannalaBrandt, {-0.013, 0.021, -0.0035, 0.0012}},
      {"fisheye, strong", LensModel::kKannalaBrandt, {-0.08, 0.01, -0.0005, 0.00001}},
  };
  return lenses;
}

CameraModel MakeCamera(const LensCase& lens) {
  return {lens.model, kIntrinsics, lens.distortion};
}

std::vector<Eigen::Vector2d> WholeImage(const CameraModel& camera) {
  std::vector<Eigen::Vector2d> pixels = {{camera.intrinsics().cx, camera.intrinsics().cy}};
  for (int y = 0; y < camera.height_px(); y += 9) {
    for (int x = 0; x < camera.width_px(); x += 9) {
      pixels.emplace_back(x, y);
    }
  }
  pixels.emplace_back(camera.width_px() - 1, camera.height_px() - 1);
  return pixels;
}

TEST(CameraModelTest, ProjectInvertsUnprojectForEveryPixel) {
  for (const LensCase& lens : Lenses()) {
    const CameraModel camera = MakeCamera(lens);
    for (const Eigen::Vector2d& pixel : WholeImage(camera)) {
      const auto ray = camera.Unproject(pixel);
      ASSERT_TRUE(ray) << lens.name << " at " << pixel.transpose();
      EXPECT_NEAR(ray->norm(), 1, 1e-14);
      for (const double depth : {1e-3, 1.0, 1e4}) {
        const auto back = camera.Project(depth * *ray);
        ASSERT_TRUE(back) << lens.name << " at " << pixel.transpose();
        EXPECT_LT((*back - pixel).norm(), 1e-8) << lens.name << " at " << pixel.transpose();
      }
    }
  }
}

TEST(CameraModelTest, UnprojectInvertsProjectWithinTheLensRange) {
  Random random(1);
  for (const LensCase& lens : Lenses()) {
    const CameraModel camera = MakeCamera(lens);
    for (int i = 0; i < 500; ++i) {
      // Near the limit a pixel covers an ever larger angle, and the limit itself is excluded.
      const double angle = random.Uniform(0, 0.95 * camera.max_angle()), turn = random.Uniform(0, 2 * kPi);
      const Eigen::Vector3d ray(std::sin(angle) * std::cos(turn), std::sin(angle) * std::sin(turn),
                                std::cos(angle));
      const auto pixel = camera.Project(ray);
      ASSERT_TRUE(pixel) << lens.name << " at " << angle;
      const auto back = camera.Unproject(*pixel);
      ASSERT_TRUE(back) << lens.name << " at " << angle;
      EXPECT_LT((*back - ray).norm(), 1e-9) << lens.name << " at " << angle;
    }
  }
}

TEST(CameraModelTest, JacobianEqualsTheNumericDerivative) {
  Random random(2);
  for (const LensCase& lens : Lenses()) {
    const CameraModel camera = MakeCamera(lens);
    std::vector<Eigen::Vector3d> points = {
        {0, 0, 2}, {1e-12, 0, 2}, {1e-9, -1e-9, 1}, {1e-6, 1e-6, 1}, {1e-4, 0, 3}};
    for (const Eigen::Vector2d& pixel : WholeImage(camera)) {
      points.push_back(random.Uniform(0.5, 5) * *camera.Unproject(pixel));
    }
    for (const Eigen::Vector3d& point : points) {
      Eigen::Vector2d pixel;
      Eigen::Matrix<double, 2, 3> jacobian;
      ASSERT_TRUE(camera.Project(point, &pixel, &jacobian));
      EXPECT_EQ(pixel, *camera.Project(point));
      for (int axis = 0; axis < 3; ++axis) {
        const double h = 1e-5 * point.norm();
        const Eigen::Vector3d step = h * Eigen::Vector3d::Unit(axis);
        // A five-point stencil: its error is of fourth order in the step.
        const Eigen::Vector2d numeric =
            (8 * (*camera.Project(point + step) - *camera.Project(point - step)) -
             (*camera.Project(point + 2 * step) - *camera.Project(point - 2 * step))) /
            (12 * h);
        EXPECT_LT((jacobian.col(axis) - numeric).norm(), 1e-6 * (1 + jacobian.norm()))
            << lens.name << " at " << point.transpose();
      }
    }
  }
}

TEST(CameraModelTest, ProjectsABatchAsEachOfItsPointsToTheBit) {
  Random random(5);
  int invalid = 0;
  for (const LensCase& lens : Lenses()) {
    const auto camera = std::make_shared<const CameraModel>(MakeCamera(lens));
    for (const ReadoutMotion& motion : {ReadoutMotion{}, ReadoutMotion{{0.7, -1.5, 0.4}, {0, 0.03}}}) {
      const CameraModel image = CameraModel::WithReadout(camera, motion);
      ProjectionBatch batch;
      for (std::size_t i = 0; i < ProjectionBatch::kSize; ++i) {
        batch.measured_x[i] = random.Uniform(0, 751);
        batch.measured_y[i] = random.Uniform(0, 479);
        batch.x[i] = random.Uniform(-2, 2);
        batch.y[i] = random.Uniform(-2, 2);
        batch.z[i] = i == 0 ? 0 : random.Uniform(-0.3, 3);
      }
      image.ProjectAtExposureOf(&batch);
      for (std::size_t i = 0; i < ProjectionBatch::kSize; ++i) {
        Eigen::Vector2d pixel;
        Eigen::Matrix<double, 2, 3> jacobian;
        const bool valid = image.ProjectAtExposureOf({batch.measured_x[i], batch.measured_y[i]},
                                                     {batch.x[i], batch.y[i], batch.z[i]}, &pixel, &jacobian);
        EXPECT_EQ(batch.valid[i], valid ? 1 : 0) << lens.name;
        invalid += valid ? 0 : 1;
        if (!valid) continue;
        EXPECT_EQ(Eigen::Vector2d(batch.pixel_x[i], batch.pixel_y[i]), pixel) << lens.name;
        Eigen::Matrix<double, 2, 3> in_batch;
        in_batch << batch.xx[i], batch.xy[i], batch.xz[i], batch.yx[i], batch.yy[i], batch.yz[i];
        EXPECT_EQ(in_batch, jacobian) << lens.name;
      }
    }
  }
  EXPECT_GT(invalid, 20) << "points behind the camera are among them";
}

TEST(CameraModelTest, MatchesTheOpenCvPinholeModel) {
  Random random(3);
  const cv::Matx33d matrix(kIntrinsics.fx, 0, kIntrinsics.cx, 0, kIntrinsics.fy, kIntrinsics.cy, 0, 0, 1);
  for (const LensCase& lens : Lenses()) {
    if (lens.model != LensModel::kRadialTangential) {
      continue;
    }
    const CameraModel camera = MakeCamera(lens);
    std::vector<cv::Point3d> points;
    for (const Eigen::Vector2d& pixel : WholeImage(camera)) {
      const Eigen::Vector3d point = random.Uniform(0.5, 5) * *camera.Unproject(pixel);
      points.emplace_back(point.x(), point.y(), point.z());
    }
    std::vector<cv::Point2d> projected;
    const std::vector<double> distortion(lens.distortion.begin(), lens.distortion.end());
    cv::projectPoints(points, cv::Vec3d(), cv::Vec3d(), matrix, distortion, projected);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto pixel = camera.Project(Eigen::Vector3d(points[i].x, points[i].y, points[i].z));
      ASSERT_TRUE(pixel);
      EXPECT_LT((*pixel - Eigen::Vector2d(projected[i].x, projected[i].y)).norm(), 1e-8) << lens.name;
    }
  }
}

TEST(CameraModelTest, MatchesTheOpenCvFisheyeModel) {
  Random random(4);
  const cv::Matx33d matrix(kIntrinsics.fx, 0, kIntrinsics.cx, 0, kIntrinsics.fy, kIntrinsics.cy, 0, 0, 1);
  for (const LensCase& lens : Lenses()) {
    if (lens.model != LensModel::kKannalaBrandt) {
      continue;
    }
    const CameraModel camera = MakeCamera(lens);
    std::vector<cv::Point3d> points;
    for (int i = 0; i < 500;
         ++i) {  // OpenCV divides by z, so only points in front of the camera are comparable
      points.emplace_back(random.Uniform(-3, 3), random.Uniform(-3, 3), random.Uniform(0.3, 4));
    }
    std::vector<cv::Point2d> projected;
    const cv::Vec4d distortion(lens.distortion[0], lens.distortion[1], lens.distortion[2],
                               lens.distortion[3]);
    cv::fisheye::projectPoints(points, projected, cv::Vec3d(), cv::Vec3d(), matrix, distortion);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto pixel = camera.Project(Eigen::Vector3d(points[i].x, points[i].y, points[i].z));
      ASSERT_TRUE(pixel);
      EXPECT_LT((*pixel - Eigen::Vector2d(projected[i].x, projected[i].y)).norm(), 1e-8) << lens.name;
    }
  }
}

TEST(CameraModelTest, FovLensFollowsDevernayAndFaugeras) {
  constexpr double kOmega = 0.93;
  const CameraModel camera(LensModel::kFov, kIntrinsics, {kOmega});
  const Eigen::Vector3d point(0.6, -0.8, 1.25);
  const double radius = 1.0 / 1.25;
  const double distorted = std::atan(2 * radius * std::tan(kOmega / 2)) / kOmega;
  const Eigen::Vector2d expected(kIntrinsics.fx * distorted * 0.6 + kIntrinsics.cx,
                                 kIntrinsics.fy * distorted * -0.8 + kIntrinsics.cy);
  EXPECT_LT((*camera.Project(point) - expected).norm(), 1e-10);
}

TEST(CameraModelTest, PinholeAndFovDoNotProjectPointsBehindTheCamera) {
  Random random(5);
  for (const LensCase& lens : Lenses()) {
    const CameraModel camera = MakeCamera(lens);
    if (lens.model == LensModel::kKannalaBrandt) {
      continue;
    }
    for (int i = 0; i < 1000; ++i) {
      EXPECT_FALSE(
          camera.Project(Eigen::Vector3d(random.Uniform(-1, 1), random.Uniform(-1, 1), -random.Uniform())));
    }
    EXPECT_FALSE(camera.Project(Eigen::Vector3d(0, 0, 0)));
    EXPECT_FALSE(camera.Project(Eigen::Vector3d(1, 0, 0)));
  }
}

TEST(CameraModelTest, FisheyeProjectsPointsBehindTheCamera) {
  const CameraModel camera(LensModel::kKannalaBrandt, {1000, 1000, 200, 200, 500, 500}, {});
  const double angle = 2.0;  // radians, 25 degrees beyond the image plane
  const Eigen::Vector3d ray(std::sin(angle), 0, std::cos(angle));
  const auto pixel = camera.Project(ray);
  ASSERT_TRUE(pixel);
  EXPECT_LT((*pixel - Eigen::Vector2d(500 + 200 * angle, 500)).norm(), 1e-9);
  EXPECT_LT((*camera.Unproject(*pixel) - ray).norm(), 1e-12);
  EXPECT_FALSE(camera.Project(Eigen::Vector3d(0, 0, -1)));
  EXPECT_FALSE(camera.Project(Eigen::Vector3d(0, 0, 0)));
}

// With k1 < 0 alone, the distorted radius r + k1 r^3 has its maximum at r = 1 / sqrt(-3 k1).
TEST(CameraModelTest, PointsBeyondTheDistortionMaximumDoNotProject) {
  const CameraModel camera(LensModel::kRadialTangential, kIntrinsics, {-0.3});
  const double radius = 1 / std::sqrt(0.9);
  EXPECT_NEAR(camera.max_angle(), std::atan(radius), 2e-6);
  EXPECT_TRUE(camera.Project(Eigen::Vector3d(0.999 * radius, 0, 1)));
  EXPECT_FALSE(camera.Project(Eigen::Vector3d(1.001 * radius, 0, 1)));
  // Beyond the maximum r (1 - 0.3 r^2) returns to zero: the point would project to the middle of the image.
  EXPECT_FALSE(camera.Project(Eigen::Vector3d(1 / std::sqrt(0.3), 0, 1)));
  const double edge = radius * (1 - 0.3 * radius * radius);
  EXPECT_TRUE(camera.Unproject({kIntrinsics.cx + 0.999 * edge * kIntrinsics.fx, kIntrinsics.cy}));
  EXPECT_FALSE(camera.Unproject({kIntrinsics.cx + 1.001 * edge * kIntrinsics.fx, kIntrinsics.cy}));
}

TEST(CameraModelTest, FisheyeRangeEndsAtTheDistortionMaximum) {
  const CameraModel camera(LensModel::kKannalaBrandt, kIntrinsics, {-0.1});
  const double angle = 1 / std::sqrt(0.3);
  EXPECT_NEAR(camera.max_angle(), angle, 1e-5);
  EXPECT_TRUE(camera.Project(Eigen::Vector3d(std::sin(0.999 * angle), 0, std::cos(0.999 * angle))));
  EXPECT_FALSE(camera.Project(Eigen::Vector3d(std::sin(1.001 * angle), 0, std::cos(1.001 * angle))));
}

// The range ends at the first maximum, even where a higher coefficient makes the radius increase again later.
TEST(CameraModelTest, FindsAShortDecreasingIntervalOfTheDistortion) {
  // (r d)' = 1 - 3 s + 2.2 s^2 in s = r^2 is negative between two roots; the first ends the range.
  const double k1 = -1.0, k2 = 2.2 / 5;
  const double first_root = (3 - std::sqrt(9 - 8.8)) / 4.4;
  const CameraModel camera(LensModel::kRadialTangential, kIntrinsics, {k1, k2});
  EXPECT_NEAR(camera.max_angle(), std::atan(std::sqrt(first_root)), 2e-6);
}

TEST(CameraModelTest, IsOneToOneWithinTheRangeDespiteDecentring) {
  const CameraModel camera(LensModel::kRadialTangential, kIntrinsics, {-0.3, 0.05, 0.02, -0.03, 0});
  Random random(6);
  for (int i = 0; i < 2000; ++i) {
    const double radius = std::tan(camera.max_angle()) * std::sqrt(random.Uniform()) * 0.999;
    const double turn = random.Uniform(0, 2 * kPi);
    Eigen::Vector2d pixel;
    Eigen::Matrix<double, 2, 3> jacobian;
    ASSERT_TRUE(camera.Project({radius * std::cos(turn), radius * std::sin(turn), 1}, &pixel, &jacobian));
    EXPECT_GT((jacobian.leftCols<2>().determinant()), 0);
  }
}

TEST(CameraModelTest, NonFinitePixelsAndPointsAreRejected) {
  for (const LensCase& lens : Lenses()) {
    const CameraModel camera = MakeCamera(lens);
    const double nan = std::numeric_limits<double>::quiet_NaN(),
                 infinity = std::numeric_limits<double>::infinity();
    EXPECT_FALSE(camera.Unproject({nan, 0})) << lens.name;
    EXPECT_FALSE(camera.Unproject({0, infinity})) << lens.name;
    EXPECT_FALSE(camera.Project(Eigen::Vector3d(nan, 0, 1))) << lens.name;
    EXPECT_FALSE(camera.Project(Eigen::Vector3d(0, 0, nan))) << lens.name;
  }
}

TEST(CameraModelTest, IsInsideRefersToPixelCentres) {
  const CameraModel camera(LensModel::kRadialTangential, kIntrinsics, {});
  EXPECT_TRUE(camera.IsInside({0, 0}));
  EXPECT_TRUE(camera.IsInside({751, 479}));
  EXPECT_FALSE(camera.IsInside({-0.1, 0}));
  EXPECT_FALSE(camera.IsInside({751.1, 0}));
  EXPECT_FALSE(camera.IsInside({3.9, 100}, 4));
}

TEST(CameraModelTest, ValidateAcceptsGoodParameters) {
  for (const LensCase& lens : Lenses()) {
    EXPECT_EQ(CameraModel::Validate(lens.model, kIntrinsics, lens.distortion).value_or(""), "") << lens.name;
  }
  const CameraModel none;
  EXPECT_FALSE(CameraModel::Validate(none.lens(), none.intrinsics(), none.distortion()));
}

TEST(CameraModelTest, ValidateNamesTheBadParameter) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto validation_error = [](LensModel lens, auto change) {
    CameraModel::Intrinsics intrinsics = kIntrinsics;
    Distortion distortion{};
    change(intrinsics, distortion);
    return CameraModel::Validate(lens, intrinsics, distortion).value_or("");
  };
  const LensModel brown = LensModel::kRadialTangential, fov = LensModel::kFov,
                  fisheye = LensModel::kKannalaBrandt;
  EXPECT_NE(validation_error(brown, [](auto& in, auto&) { in.width_px = 0; }).find("width is 0"),
            std::string::npos);
  EXPECT_NE(validation_error(brown, [](auto& in, auto&) { in.height_px = 70000; }).find("height"),
            std::string::npos);
  EXPECT_NE(validation_error(brown, [](auto& in, auto&) { in.fx = -1; }).find("fx is -1"), std::string::npos);
  EXPECT_NE(validation_error(brown, [&](auto& in, auto&) { in.fy = nan; }).find("fy"), std::string::npos);
  EXPECT_NE(validation_error(brown, [&](auto& in, auto&) { in.cx = nan; }).find("cx"), std::string::npos);
  EXPECT_NE(validation_error(fisheye, [&](auto&, auto& d) { d[2] = nan; }).find("coefficient 3"),
            std::string::npos);
  EXPECT_NE(validation_error(fisheye, [](auto&, auto& d) { d[4] = 0.1; }).find("does not use"),
            std::string::npos);
  EXPECT_NE(validation_error(fov, [](auto&, auto& d) { d[0] = 3.2; }).find("omega"), std::string::npos);
  EXPECT_NE(validation_error(brown, [](auto&, auto& d) { d[0] = -30; }).find("half of the image"),
            std::string::npos);
}

TEST(CameraModelTest, CamerasAreEqualOnlyIfAllParametersAreEqual) {
  const CameraModel a(LensModel::kRadialTangential, kIntrinsics, {-0.3, 0.1});
  EXPECT_EQ(a, CameraModel(LensModel::kRadialTangential, kIntrinsics, {-0.3, 0.1}));
  EXPECT_FALSE(a == CameraModel(LensModel::kRadialTangential, kIntrinsics, {-0.3, 0.2}));
  EXPECT_FALSE(a == CameraModel(LensModel::kKannalaBrandt, kIntrinsics, {-0.3, 0.1}));
  CameraModel::Intrinsics shifted = kIntrinsics;
  shifted.cx += 1;
  EXPECT_FALSE(a == CameraModel(LensModel::kRadialTangential, shifted, {-0.3, 0.1}));
}

// Uses the recorded sequences where they are available: every pixel of their images needs a ray.
TEST(CameraModelTest, SequenceCalibrationsUnprojectEveryPixel) {
  const std::filesystem::path folder = std::filesystem::path(DOCENT_SOURCE_DIR) / "../shared/sequences";
  if (!std::filesystem::is_directory(folder)) {
    GTEST_SKIP() << "no sequences at " << folder;
  }
  int cameras = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    std::ifstream file(entry.path() / "calibration.yaml");
    std::map<std::string, double> values;
    for (std::string line; std::getline(file, line);) {
      const std::size_t colon = line.find(':');
      if (line.starts_with('#') || colon == std::string::npos) {
        continue;
      }
      std::istringstream text(line.substr(colon + 1));
      text >> values[line.substr(0, colon)];
    }
    if (!values.contains("fx") || !values.contains("width")) {
      continue;
    }
    ++cameras;
    const CameraModel::Intrinsics intrinsics{static_cast<int>(values["width"]),
                                             static_cast<int>(values["height"]),
                                             values["fx"],
                                             values["fy"],
                                             values["cx"],
                                             values["cy"]};
    const Distortion distortion{values["k1"], values["k2"], values["p1"], values["p2"], values["k3"]};
    ASSERT_EQ(CameraModel::Validate(LensModel::kRadialTangential, intrinsics, distortion).value_or(""), "");
    const CameraModel camera(LensModel::kRadialTangential, intrinsics, distortion);
    for (const Eigen::Vector2d& pixel : WholeImage(camera)) {
      const auto ray = camera.Unproject(pixel);
      ASSERT_TRUE(ray) << entry.path() << " at " << pixel.transpose();
      EXPECT_LT((*camera.Project(*ray) - pixel).norm(), 1e-9) << entry.path() << " at " << pixel.transpose();
    }
  }
  EXPECT_GT(cameras, 0);
}

}  // namespace
}  // namespace docent::engine
