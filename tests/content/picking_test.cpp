// SPDX-License-Identifier: Apache-2.0
#include "content/picking.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace docent::content {
namespace {

// A model of one triangle in the plane z = 0 with corners (0,0), (2,0), (0,2), on a node of its own.
std::shared_ptr<Model> TriangleModel() {
  auto model = std::make_shared<Model>();
  Primitive primitive;
  for (const glm::vec3& corner : {glm::vec3(0, 0, 0), glm::vec3(2, 0, 0), glm::vec3(0, 2, 0)}) {
    Vertex vertex;
    vertex.position = corner;
    primitive.vertices.push_back(vertex);
  }
  primitive.indices = {0, 1, 2};
  model->meshes.push_back({"triangle", {primitive}});
  Node node;
  node.mesh = 0;
  model->nodes.push_back(node);
  model->roots = {0};
  model->bounds_max = glm::vec3(2, 2, 0);
  return model;
}

Entity PickableModel(const std::string& name, const engine::Sim3& map_from_model) {
  auto asset = std::make_shared<Asset>();
  asset->model = TriangleModel();
  Entity entity;
  entity.name = name;
  entity.kind = Entity::Kind::kModel;
  entity.model.asset = asset;
  entity.model.map_from_model = map_from_model;
  entity.model.animation = -1;
  return entity;
}

engine::Sim3 At(double x, double y, double z, double scale = 1) {
  engine::Sim3 pose;
  pose.translation = {x, y, z};
  pose.scale = scale;
  return pose;
}

Ray Ahead(double x, double y) {
  return {{x, y, -5}, {0, 0, 1}};
}

TEST(Picking, MeetsABoxWhereItsSlabsOverlap) {
  const Eigen::Vector3d low(-1, -2, 3), high(1, 2, 5);
  EXPECT_EQ(IntersectBox({{0, 0, 0}, {0, 0, 1}}, low, high), 3.0);
  EXPECT_EQ(IntersectBox({{0, 0, 0}, {0, 0, 2}}, low, high), 1.5) << "multiples of the direction";
  EXPECT_EQ(IntersectBox({{0, 0, 4}, {1, 0, 0}}, low, high), 0.0) << "from inside";
  EXPECT_FALSE(IntersectBox({{0, 0, 6}, {0, 0, 1}}, low, high)) << "behind the origin";
  EXPECT_FALSE(IntersectBox({{1.01, 0, 0}, {0, 0, 1}}, low, high)) << "beside it, parallel to a side";
  // Enters the side x = -1 at t = 4, where z = 4.
  EXPECT_EQ(IntersectBox({{-5, 0, 0}, {1, 0, 1}}, low, high), 4.0);
  EXPECT_FALSE(IntersectBox({{-7, 0, 0}, {1, 0, 1}}, low, high)) << "at x = -1 it is above z = 5";
}

TEST(Picking, MeetsATriangleInsideItsEdgesFromBothSides) {
  const Eigen::Vector3d a(0, 0, 0), b(2, 0, 0), c(0, 2, 0);
  const auto hit = [&](double x, double y) { return IntersectTriangle(Ahead(x, y), a, b, c); };
  EXPECT_EQ(hit(0.5, 0.5), 5.0);
  EXPECT_EQ(hit(0.99, 0.99), 5.0);
  EXPECT_FALSE(hit(1.01, 1.01)) << "beyond the hypotenuse";
  EXPECT_FALSE(hit(-0.01, 0.5));
  EXPECT_FALSE(hit(0.5, -0.01));
  EXPECT_EQ(IntersectTriangle({{0.5, 0.5, 3}, {0, 0, -1}}, a, b, c), 3.0) << "from the back";
  EXPECT_FALSE(IntersectTriangle({{0.5, 0.5, 3}, {0, 0, 1}}, a, b, c)) << "behind the origin";
  EXPECT_FALSE(IntersectTriangle({{-1, 0.5, 0}, {1, 0, 0}}, a, b, c)) << "from its edge";
}

TEST(Picking, AgreesWithRandomPointsOfATriangle) {
  // Points with known barycentric coordinates are hit, and those outside are not.
  const Eigen::Vector3d a(1, 2, 7), b(-2, 1, 6), c(0.5, -3, 9);
  for (const double u : {-0.2, 0.1, 0.4, 0.8}) {
    for (const double v : {-0.1, 0.15, 0.5, 0.85}) {
      const Eigen::Vector3d point = a + u * (b - a) + v * (c - a);
      const Eigen::Vector3d origin(0.3, -0.2, 0.1);
      const auto hit = IntersectTriangle({origin, point - origin}, a, b, c);
      EXPECT_EQ(hit.has_value(), u >= 0 && v >= 0 && u + v <= 1) << u << " " << v;
      EXPECT_NEAR(hit.value_or(1), 1, 1e-12);
    }
  }
}

TEST(Picking, FollowsThePoseOfAModel) {
  engine::Sim3 pose = At(10, 0, 4, 3);
  // A quarter turn about z: the corner (2, 0) goes to (0, 2), and (0, 2) to (-2, 0).
  pose.rotation = engine::Rotation3::Exp({0, 0, std::numbers::pi / 2});
  const auto hit = IntersectModel({{8.5, 1.5, 0}, {0, 0, 1}}, *TriangleModel(), pose, -1, 0);
  ASSERT_TRUE(hit);
  EXPECT_NEAR(*hit, 4, 1e-5) << "the model's transforms are single precision";
  EXPECT_FALSE(IntersectModel({{11.5, 1.5, 0}, {0, 0, 1}}, *TriangleModel(), pose, -1, 0));
}

TEST(Picking, HitsAnAnimatedModelWhereItIsShown) {
  const auto model = TriangleModel();
  AnimationChannel channel;
  channel.node = 0;
  channel.times = {0, 1};
  channel.values = {glm::vec4(0), glm::vec4(10, 0, 0, 0)};
  model->animations.push_back({"move", 1.0f, {channel}});
  EXPECT_TRUE(IntersectModel(Ahead(0.5, 0.5), *model, {}, 0, 0));
  EXPECT_FALSE(IntersectModel(Ahead(0.5, 0.5), *model, {}, 0, 0.5));
  EXPECT_TRUE(IntersectModel(Ahead(5.5, 0.5), *model, {}, 0, 0.5)) << "outside the box of the rest pose";
  EXPECT_TRUE(IntersectModel(Ahead(0.5, 0.5), *model, {}, -1, 0.5));
}

TEST(Picking, FollowsTheJointsOfASkin) {
  const auto model = TriangleModel();
  for (Vertex& vertex : model->meshes[0].primitives[0].vertices) vertex.weights = {1, 0, 0, 0};
  Node joint;
  joint.translation = {1.5f, 0, 0};
  model->nodes.push_back(joint);
  model->roots.push_back(1);
  Skin skin;
  skin.joints = {1};
  skin.inverse_bind = {glm::mat4(1.0f)};
  model->skins.push_back(skin);
  model->nodes[0].skin = 0;
  model->bounds_min = {1.5f, 0, 0};
  model->bounds_max = {3.5f, 2, 0};
  EXPECT_TRUE(IntersectModel(Ahead(3.3, 0.1), *model, {}, -1, 0));
  EXPECT_FALSE(IntersectModel(Ahead(0.5, 0.5), *model, {}, -1, 0));
}

TEST(Picking, TakesTheNearestEntity) {
  Scene scene;
  scene.entities = {PickableModel("far", At(0, 0, 6)), PickableModel("near", At(0, 0, 2)),
                    PickableModel("beside", At(5, 0, 1))};
  const auto pick = PickEntity(Ahead(0.5, 0.5), scene, {});
  ASSERT_TRUE(pick);
  EXPECT_EQ(scene.entities[pick->entity].name, "near");
  EXPECT_NEAR(pick->distance, 7, 1e-5);
  EXPECT_FALSE(PickEntity(Ahead(-1, -1), scene, {}));
}

TEST(Picking, TakesTheShapeThatIsShownInsteadOfTheAssets) {
  Scene scene;
  scene.entities = {PickableModel("bent", At(0, 0, 2))};
  const auto bent = TriangleModel();
  for (Vertex& vertex : bent->meshes[0].primitives[0].vertices) vertex.position.x += 4;
  bent->bounds_min.x += 4;
  bent->bounds_max.x += 4;
  PickOptions options;
  options.shape = [&](const Entity& entity, const Eigen::Vector3d&) {
    EXPECT_EQ(entity.name, "bent");
    return EntityShape{bent, entity.model.map_from_model};
  };
  EXPECT_TRUE(PickEntity(Ahead(4.5, 0.5), scene, options));
  EXPECT_FALSE(PickEntity(Ahead(0.5, 0.5), scene, options));
  EXPECT_TRUE(PickEntity(Ahead(0.5, 0.5), scene, {}));
}

TEST(Picking, HitsSignpostsAsTheModelThatTheReaderSees) {
  Scene scene;
  scene.entities.resize(1);
  scene.entities[0].kind = Entity::Kind::kSignpost;
  scene.entities[0].signpost.anchor = {1, 0, 3};
  PickOptions options;
  options.shape = [](const Entity& entity, const Eigen::Vector3d& eye) {
    EXPECT_EQ(eye, Eigen::Vector3d(1.5, 0.5, -5));
    const Eigen::Vector3d& anchor = entity.signpost.anchor;
    return EntityShape{TriangleModel(), At(anchor.x(), anchor.y(), anchor.z())};
  };
  const auto pick = PickEntity(Ahead(1.5, 0.5), scene, options);
  ASSERT_TRUE(pick);
  EXPECT_NEAR(pick->distance, 8, 1e-5);
  EXPECT_FALSE(PickEntity(Ahead(1.5, 0.5), scene, {})) << "its shape is unknown";
}

}  // namespace
}  // namespace docent::content
