// SPDX-License-Identifier: Apache-2.0
#include "content/warp.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "content/bent_models.h"
#include "engine/base/random.h"
#include "tests/support/error_of.h"

namespace docent::content {
namespace {

using ::testing::HasSubstr;

Eigen::Vector3d AnyPoint(Random* random) {
  return {random->Uniform(-1, 1), random->Uniform(-1, 1), random->Uniform(-1, 1)};
}

engine::Sim3 SomePose(Random* random) {
  return {engine::Rotation3::Exp(2 * AnyPoint(random)), 5 * AnyPoint(random), random->Uniform(0.1, 3)};
}

TEST(FitWarp, TakesEachPointToItsPlace) {
  Random random(1);
  for (int trial = 0; trial < 50; ++trial) {
    const engine::Sim3 pose = SomePose(&random);
    std::vector<Correspondence> pairs;
    for (std::size_t i = 0; i < kMinWarpPoints + random.Below(kMaxWarpPoints - kMinWarpPoints + 1); ++i) {
      const Eigen::Vector3d point = 3 * AnyPoint(&random) + Eigen::Vector3d(10, 20, 30);
      pairs.push_back({point, pose * (point + 0.2 * AnyPoint(&random))});
    }
    if (pairs.size() == kMinWarpPoints) continue;  // They may nearly lie in a plane.
    const Warp warp = FitWarp(pairs, pose);
    for (const Correspondence& pair : pairs)
      EXPECT_LT((pose * warp(pair.in_model) - pair.in_map).norm(), 1e-9);
    // The weights have no force and no moment, so that the warp is affine far away.
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
    for (std::size_t i = 0; i < warp.controls.size(); ++i) {
      force += warp.weights[i];
      moment += warp.weights[i] * (warp.controls[i] - warp.controls[0]).transpose();
    }
    EXPECT_LT(force.norm(), 1e-9);
    EXPECT_LT(moment.norm(), 1e-9);
  }
}

TEST(FitWarp, ReproducesAnAffineMapEverywhere) {
  Random random(2);
  for (int trial = 0; trial < 20; ++trial) {
    Eigen::Matrix3d linear;
    linear << 1.2, 0.1, 0, -0.2, 0.9, 0.3, 0, 0.1, 1.1;
    const Eigen::Vector3d offset = AnyPoint(&random);
    const engine::Sim3 pose = SomePose(&random);
    std::vector<Correspondence> pairs;
    for (int i = 0; i < 8; ++i) {
      const Eigen::Vector3d point = AnyPoint(&random);
      pairs.push_back({point, pose * (linear * point + offset)});
    }
    const Warp warp = FitWarp(pairs, pose);
    for (int i = 0; i < 20; ++i) {
      const Eigen::Vector3d point = 4 * AnyPoint(&random);
      EXPECT_LT((warp(point) - (linear * point + offset)).norm(), 1e-9);
      EXPECT_LT((warp.Jacobian(point) - linear).norm(), 1e-9);
    }
  }
}

TEST(Warp, TheJacobianIsTheDerivative) {
  Random random(3);
  std::vector<Correspondence> pairs;
  for (int i = 0; i < 12; ++i) {
    const Eigen::Vector3d point = AnyPoint(&random);
    pairs.push_back({point, point + 0.3 * AnyPoint(&random)});
  }
  const Warp warp = FitWarp(pairs, {});
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d point = AnyPoint(&random);
    constexpr double kStep = 1e-5;
    Eigen::Matrix3d numeric;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(axis);
      numeric.col(axis) = (warp(point + step) - warp(point - step)) / (2 * kStep);
    }
    EXPECT_LT((numeric - warp.Jacobian(point)).norm(), 1e-4);
  }
}

TEST(Warp, IsInverted) {
  Random random(4);
  std::vector<Correspondence> pairs;
  for (int i = 0; i < 12; ++i) {
    const Eigen::Vector3d point = AnyPoint(&random);
    pairs.push_back({point, point + 0.05 * AnyPoint(&random)});
  }
  const Warp warp = FitWarp(pairs, {});
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d point = AnyPoint(&random);
    const std::optional<Eigen::Vector3d> back = Unwarped(warp, warp(point));
    ASSERT_TRUE(back.has_value());
    EXPECT_LT((*back - point).norm(), 1e-6);
  }
}

TEST(Warp, HasNoInverseWhereItIsFlat) {
  Warp flat;
  flat.affine.row(2).setZero();
  EXPECT_FALSE(Unwarped(flat, {1, 2, 3}).has_value());
}

TEST(FitWarp, RefusesUnsuitablePoints) {
  Random random(4);
  const auto refusal = [](const std::vector<Correspondence>& pairs) {
    return ErrorOf([&] { FitWarp(pairs, {}); });
  };
  std::vector<Correspondence> flat, three, many, twice;
  for (int i = 0; i < 6; ++i) {
    Eigen::Vector3d point = AnyPoint(&random);
    twice.push_back({point, point});
    point.y() = 0.5 * point.x();
    flat.push_back({point, point});
  }
  twice.push_back({twice[0].in_model, {0, 0, 0}});
  three.assign(twice.begin(), twice.begin() + 3);
  for (std::size_t i = 0; i <= kMaxWarpPoints; ++i) many.push_back({AnyPoint(&random), AnyPoint(&random)});
  EXPECT_THAT(refusal(three), HasSubstr("At least 4"));
  EXPECT_THAT(refusal(many), HasSubstr("at most 64"));
  EXPECT_THAT(refusal(flat), HasSubstr("lie in one plane"));
  EXPECT_THAT(refusal(twice), HasSubstr("Two points of the model coincide"));
  many.pop_back();
  EXPECT_EQ(refusal(many), "");
  many[3].in_map.x() = 1e300;
  EXPECT_THAT(refusal(many), HasSubstr("too far"));
  many[3].in_map.x() = std::nan("");
  EXPECT_THAT(refusal(many), HasSubstr("not finite"));
}

// A square in the plane z = 0 of a node that is shifted by (2, 0, 0) and scaled by 2 along x.
Model SquareOnANode() {
  Model model;
  Primitive primitive;
  for (const glm::vec3 corner :
       {glm::vec3(0, 0, 0), glm::vec3(1, 0, 0), glm::vec3(1, 1, 0), glm::vec3(0, 1, 0)}) {
    Vertex& vertex = primitive.vertices.emplace_back();
    vertex.position = corner;
    vertex.normal = {0, 0, 1};
    vertex.tangent = {1, 0, 0, -1};
  }
  primitive.indices = {0, 1, 2, 0, 2, 3};
  model.meshes.push_back({"square", {primitive}});
  Node& node = model.nodes.emplace_back();
  node.translation = {2, 0, 0};
  node.scale = {2, 1, 1};
  node.mesh = 0;
  model.roots = {0};
  model.animations.emplace_back();
  return model;
}

TEST(Warped, VerticesNormalsAndTangentsAreThoseOfTheDeformedSurface) {
  // z' = z + x / 2 (a shear), written as a warp without weights.
  Warp shear;
  shear.controls = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  shear.weights.assign(4, Eigen::Vector3d::Zero());
  shear.affine(2, 0) = 0.5;
  const auto warped = Warped(SquareOnANode(), shear);
  ASSERT_EQ(warped->nodes.size(), 1u);
  EXPECT_TRUE(warped->animations.empty());
  EXPECT_EQ(warped->nodes[0].translation, glm::vec3(0));
  const Primitive& primitive = warped->meshes[0].primitives[0];
  EXPECT_EQ(primitive.indices.size(), 6u);
  EXPECT_EQ(primitive.vertices[2].position, glm::vec3(4, 1, 2));
  EXPECT_EQ(warped->bounds_min, glm::vec3(2, 0, 1));
  EXPECT_EQ(warped->bounds_max, glm::vec3(4, 1, 2));
  const glm::vec3 normal = glm::normalize(glm::vec3(-0.5f, 0, 1)),
                  tangent = glm::normalize(glm::vec3(1, 0, 0.5f));
  for (const Vertex& vertex : primitive.vertices) {
    EXPECT_LT(glm::length(vertex.normal - normal), 1e-6f);
    EXPECT_LT(glm::length(glm::vec3(vertex.tangent) - tangent), 1e-6f);
    EXPECT_EQ(vertex.tangent.w, -1.0f);
  }
  // A bend: the normals are orthogonal to the deformed edges of a fine grid.
  Random random(6);
  std::vector<Correspondence> pairs;
  for (int i = 0; i < 10; ++i) {
    const Eigen::Vector3d point = 2 * AnyPoint(&random);
    pairs.push_back({point, point + 0.2 * AnyPoint(&random)});
  }
  const Warp bend = FitWarp(pairs, {});
  const auto bent = Warped(SquareOnANode(), bend);
  for (const Vertex& vertex : bent->meshes[0].primitives[0].vertices) {
    EXPECT_NEAR(glm::dot(vertex.normal, glm::vec3(vertex.tangent)), 0, 1e-5);
    EXPECT_NEAR(glm::length(vertex.normal), 1, 1e-5);
  }
  const Eigen::Vector3d corner = bend({2, 0, 0}), along = bend({2, 1e-4, 0}) - corner;
  const glm::vec3& n = bent->meshes[0].primitives[0].vertices[0].normal;
  EXPECT_NEAR(along.normalized().dot(Eigen::Vector3d(n.x, n.y, n.z)), 0, 1e-3);
}

TEST(Warped, TheFrontOfAMirroredPartStaysItsFront) {
  Warp mirror;
  mirror.controls = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mirror.weights.assign(4, Eigen::Vector3d::Zero());
  const Warp straight = mirror;
  mirror.affine(1, 1) = -1;
  for (const float scale : {1.0f, -1.0f}) {
    for (const Warp& warp : {straight, mirror}) {
      Model model = SquareOnANode();
      model.nodes[0].scale = {scale, 1, 1};
      const auto warped = Warped(model, warp);
      const Primitive& primitive = warped->meshes[0].primitives[0];
      const bool is_mirrored = (scale < 0) != (warp.affine(1, 1) < 0);
      ASSERT_EQ(primitive.indices.size(), 6u);
      for (std::size_t i = 0; i < 6; i += 3) {
        const Vertex& a = primitive.vertices[primitive.indices[i]];
        const glm::vec3 b = primitive.vertices[primitive.indices[i + 1]].position,
                        c = primitive.vertices[primitive.indices[i + 2]].position;
        EXPECT_GT(glm::dot(glm::cross(b - a.position, c - a.position), a.normal), 0.5f)
            << scale << " " << warp.affine(1, 1);
        EXPECT_EQ(a.tangent.w, is_mirrored ? 1.0f : -1.0f) << scale << " " << warp.affine(1, 1);
      }
    }
  }
}

TEST(BentModels, AShapeIsComputedOnceAndForgottenWhenItIsNotDrawn) {
  auto asset = std::make_shared<Asset>();
  asset->model = std::make_shared<Model>(SquareOnANode());
  PlacedModel straight{asset, {}, 0, nullptr}, bent = straight;
  auto warp = std::make_shared<Warp>();
  warp->affine(2, 3) = 5;
  bent.warp = warp;
  BentModels models;
  EXPECT_EQ(models.ShapeOf(PlacedModel()), nullptr);
  EXPECT_EQ(models.ShapeOf(straight), asset->model);
  const std::shared_ptr<const Model> shape = models.ShapeOf(bent);
  EXPECT_EQ(shape->bounds_min.z, 5.0f);
  EXPECT_EQ(models.ShapeOf(bent), shape);
  models.EndFrame();
  EXPECT_EQ(models.ShapeOf(bent), shape);
  models.EndFrame();
  models.EndFrame();
  EXPECT_EQ(shape.use_count(), 1) << "it is kept by this test only";
}

}  // namespace
}  // namespace docent::content
