// SPDX-License-Identifier: Apache-2.0
#include "content/occluder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <utility>
#include <vector>

#include "content/edits.h"
#include "content/picking.h"
#include "content/scene_codec.h"
#include "content/scene_merge.h"
#include "engine/base/random.h"
#include "tests/content/edit_samples.h"
#include "tests/support/error_of.h"

namespace docent::content {
namespace {

using ::testing::HasSubstr;
using Shape = Occluder::Shape;

double Area(const OccluderMesh& mesh) {
  double area = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    area += 0.5 * (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]).norm();
  }
  return area;
}

bool Hits(const OccluderMesh& mesh, const Ray& ray) {
  for (const auto& [a, b, c] : mesh.triangles) {
    if (IntersectTriangle(ray, mesh.vertices[a], mesh.vertices[b], mesh.vertices[c])) return true;
  }
  return false;
}

Occluder Polygon(std::vector<Eigen::Vector2d> outline) {
  Occluder occluder;
  occluder.shape = Shape::kPolygon;
  occluder.size.setZero();
  occluder.outline = std::move(outline);
  return occluder;
}

TEST(Occluder, HasTheSurfaceOfItsShape) {
  EXPECT_NEAR(Area(MeshOf(OccluderEntity("box").occluder)), 2 * (1 * 0.7 + 0.7 * 0.6 + 1 * 0.6), 1e-12);
  EXPECT_NEAR(Area(MeshOf(OccluderEntity("plane", Shape::kPlane).occluder)), 0.7, 1e-12);
  // Half a percent of the radius, as the sides are flat.
  const double round = std::numbers::pi * (2 * 0.25 + 0.7);
  EXPECT_NEAR(Area(MeshOf(OccluderEntity("can", Shape::kCylinder).occluder)), round, 0.01 * round);
}

TEST(Occluder, BoxAndCylinderStandOnTheirBase) {
  for (const Shape shape : {Shape::kBox, Shape::kCylinder}) {
    double low = 1, high = 0;
    for (const Eigen::Vector3d& vertex : MeshOf(OccluderEntity("it", shape).occluder).vertices) {
      low = std::min(low, vertex.y());
      high = std::max(high, vertex.y());
    }
    EXPECT_EQ(low, 0);
    EXPECT_EQ(high, 0.7);
  }
}

TEST(Occluder, APolygonCoversItsInsideAloneInEitherDirection) {
  // The letter U, whose middle is not a part of it.
  std::vector<Eigen::Vector2d> outline = {{0, 0}, {3, 0}, {3, 2}, {2, 2}, {2, 1}, {1, 1}, {1, 2}, {0, 2}};
  for (int direction = 0; direction < 2; ++direction) {
    const Occluder occluder = Polygon(outline);
    ASSERT_EQ(ShapeProblem(occluder), "");
    const OccluderMesh mesh = MeshOf(occluder);
    EXPECT_EQ(mesh.triangles.size(), outline.size() - 2);
    EXPECT_NEAR(Area(mesh), 5, 1e-12);
    EXPECT_FALSE(Hits(mesh, {{1.5, 1.5, -1}, {0, 0, 1}}));
    EXPECT_TRUE(Hits(mesh, {{1.5, 0.5, -1}, {0, 0, 1}}));
    std::reverse(outline.begin(), outline.end());
  }
}

TEST(Occluder, RandomStarsAreCoveredCompletely) {
  Random random(5);
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<Eigen::Vector2d> outline;
    double area = 0;
    const int n = 3 + static_cast<int>(random.Below(40));
    for (int i = 0; i < n; ++i) {
      const double angle = 2 * std::numbers::pi * i / n, radius = random.Uniform(0.2, 3);
      outline.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
    }
    for (int i = 0; i < n; ++i) {
      const Eigen::Vector2d &a = outline[i], &b = outline[(i + 1) % n];
      area += 0.5 * (a.x() * b.y() - a.y() * b.x());
    }
    EXPECT_NEAR(Area(MeshOf(Polygon(outline))), area, 1e-9 * area) << trial;
  }
}

TEST(Occluder, OutlinesThatEncloseNothingAreRefused) {
  EXPECT_THAT(ShapeProblem(Polygon({{0, 0}, {1, 0}})), HasSubstr("2 points"));
  EXPECT_THAT(ShapeProblem(Polygon(std::vector<Eigen::Vector2d>(65, {0, 0}))), HasSubstr("65 points"));
  EXPECT_THAT(ShapeProblem(Polygon({{0, 0}, {1, 1}, {2, 2}})), HasSubstr("without an area"));
  EXPECT_THAT(ShapeProblem(Polygon({{0, 0}, {2, 2}, {2, 0}, {0, 3}})), HasSubstr("crosses itself"));
  EXPECT_THAT(ShapeProblem(Polygon({{0, 0}, {1, 0}, {std::nan(""), 1}})), HasSubstr("too far away"));
}

TEST(Occluder, APolygonThroughPointsOfTheMapHasThemAsItsCorners) {
  const engine::Rigid3 map_from_table(engine::Rotation3::Exp({0.4, -1.2, 0.3}), {1, 2, 3});
  std::vector<Eigen::Vector3d> corners;
  for (const auto& [x, y] : {std::pair(0.0, 0.0), {1.2, 0.1}, {1.1, 0.8}, {0.4, 0.3}, {-0.1, 0.9}})
    corners.push_back(map_from_table * Eigen::Vector3d(x, y, 0));
  const Occluder occluder = PolygonThrough(corners);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector3d corner(occluder.outline[i].x(), occluder.outline[i].y(), 0);
    EXPECT_LT((occluder.map_from_shape * corner - corners[i]).norm(), 1e-12);
  }
  EXPECT_THAT(ErrorOf([&] { PolygonThrough({corners.data(), 2}); }), HasSubstr("2 points"));
  const std::vector<Eigen::Vector3d> line = {{0, 0, 1}, {0, 0, 2}, {0, 0, 3}};
  EXPECT_EQ(ErrorOf([&] { PolygonThrough(line); }), "the polygon would have an outline without an area");
}

TEST(Occluder, StandsForWhatWasMeasuredAtItsSurfaceAndNothingElse) {
  for (const Shape shape : {Shape::kPlane, Shape::kBox, Shape::kCylinder, Shape::kPolygon}) {
    const Occluder occluder = OccluderEntity("it", shape).occluder;
    const OccluderMesh mesh = MeshOf(occluder);
    for (const auto& [a, b, c] : mesh.triangles) {
      const Eigen::Vector3d middle = (mesh.vertices[a] + mesh.vertices[b] + mesh.vertices[c]) / 3;
      const Eigen::Vector3d normal =
          (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]).normalized();
      // Errors of up to 4 % of the smaller larger side count as its surface, a third of it does not.
      EXPECT_TRUE(StandsFor(occluder, occluder.map_from_shape * (middle + 0.02 * normal))) << NameOf(shape);
      EXPECT_TRUE(StandsFor(occluder, occluder.map_from_shape * (middle - 0.02 * normal))) << NameOf(shape);
    }
    EXPECT_FALSE(StandsFor(occluder, occluder.map_from_shape * Eigen::Vector3d(0.3, 0.2, 0.9)));
    EXPECT_FALSE(StandsFor(occluder, occluder.map_from_shape * Eigen::Vector3d(2, 0.2, 0)));
    EXPECT_FALSE(StandsFor(occluder, occluder.map_from_shape * Eigen::Vector3d(0.1, 1.3, 0)));
  }
}

TEST(Occluder, IsResizedAndScaledAndEachIsUndone) {
  Scene scene = AllKinds();
  EditHistory history;
  history.Do(SizeEdit(scene, "occluder-1", {2, 3, 4}), &scene);
  EXPECT_EQ(scene.Find("occluder-1")->occluder.size, Eigen::Vector3d(2, 3, 4));
  history.Do(RotateEdit(scene, "occluder-1", 90), &scene);
  history.Do(ScaleEdit(scene, "occluder-2", 3), &scene);
  EXPECT_NEAR(scene.Find("occluder-2")->occluder.map_from_shape.scale, 3.3, 1e-12);
  EXPECT_THAT(ErrorOf([&] { SizeEdit(scene, "occluder-2", {1, 1, 1}); }), HasSubstr("is a polygon"));
  EXPECT_EQ(ErrorOf([&] {
              SizeEdit(scene, "helmet", {1, 1, 1});
            }),
            "'helmet' is a model, which has no sides; scale it instead.");
  EXPECT_EQ(ErrorOf([&] { TextEdit(scene, "occluder-1", "x"); }),
            "'occluder-1' is an occluder, which has no text.");
  EXPECT_THAT(ErrorOf([&] {
                ApplyChange(SizeEdit(scene, "occluder-1", {0, 1, 1}), &scene);
              }),
              HasSubstr("a side"));
  while (history.Undo(&scene)) {
  }
  EXPECT_EQ(EncodeScene(scene), EncodeScene(AllKinds()));
}

TEST(Occluder, APlaneKeepsNoDepthAndACylinderStaysRound) {
  Scene scene;
  scene.entities = {OccluderEntity("wall", Shape::kPlane), OccluderEntity("can", Shape::kCylinder)};
  ApplyChange(SizeEdit(scene, "wall", {2, 3, 4}), &scene);
  ApplyChange(SizeEdit(scene, "can", {2, 3, 4}), &scene);
  EXPECT_EQ(scene.entities[0].occluder.size, Eigen::Vector3d(2, 3, 0));
  EXPECT_EQ(scene.entities[1].occluder.size, Eigen::Vector3d(2, 3, 2));
}

TEST(Occluder, ChangesOfBothSidesOfAMergeAreKept) {
  const Scene base = AllKinds();
  Scene mine = base, theirs = base;
  ApplyChange(SizeEdit(mine, "occluder-1", {2, 2, 2}), &mine);
  ApplyChange(MoveEdit(theirs, "occluder-2", {9, 9, 9}), &theirs);
  const SceneMerge merge = MergeScenes(base, mine, theirs);
  EXPECT_TRUE(merge.conflicts.empty());
  EXPECT_EQ(merge.scene.Find("occluder-1")->occluder.size, Eigen::Vector3d(2, 2, 2));
  EXPECT_EQ(PlaceOf(*merge.scene.Find("occluder-2")), Eigen::Vector3d(9, 9, 9));
}

TEST(Occluder, AProgramThatDoesNotKnowThemRefusesTheScene) {
  Scene scene;
  scene.entities = {OccluderEntity("box")};
  nlohmann::json json = nlohmann::json::parse(EncodeScene(scene));
  EXPECT_EQ(json["docent_scene"], 6);
  json["docent_scene"] = 5;
  EXPECT_THAT(ErrorOf([&] { DecodeScene(json.dump(), "a", [](const std::string&) { return nullptr; }); }),
              HasSubstr("of another kind"));
}

}  // namespace
}  // namespace docent::content
