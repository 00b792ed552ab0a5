// SPDX-License-Identifier: Apache-2.0
#include "ui/room_shadows.h"

#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "tests/ui/ui_testing.h"

namespace docent::ui {
namespace {

// A cube of 1 m that stands in the middle of a floor, y = 1 in the map, 4 m before the camera, which looks
// down on it from 2 m above the floor.
class RoomShadowsTest : public OffscreenTest {
 protected:
  RoomShadowsTest() {
    light_.brightness[0] = 0.5;
    light_.to_light = Eigen::Vector3d(-1, -1, 0).normalized();  // From the left above.
    light_.direct = 0.6;
    auto asset = std::make_shared<content::Asset>();
    asset->model = Cube();
    cube_.kind = content::Entity::Kind::kModel;
    cube_.model.asset = asset;
    cube_.model.map_from_model.rotation = engine::Rotation3::Exp({std::acos(-1.0), 0, 0});
    cube_.model.map_from_model.translation = {0, 1, 4};
  }

  // A closed cube with its base in the middle of y = 0, y up.
  static std::shared_ptr<content::Model> Cube() {
    auto model = std::make_shared<content::Model>();
    content::Material material;
    material.base_color = {0, 1, 0, 1};
    material.unlit = true;
    material.double_sided = true;
    model->materials.push_back(material);
    content::Primitive primitive;
    primitive.material = 0;
    for (int i = 0; i < 8; ++i) {
      content::Vertex vertex;
      vertex.position = {i & 1 ? 0.5f : -0.5f, i & 2 ? 1.0f : 0.0f, i & 4 ? 0.5f : -0.5f};
      primitive.vertices.push_back(vertex);
    }
    primitive.indices = {0, 1, 3, 0, 3, 2, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                         2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 3, 7, 1, 7, 5};
    model->meshes.push_back({"cube", {primitive}});
    content::Node node;
    node.mesh = 0;
    model->nodes.push_back(node);
    model->roots.push_back(0);
    model->bounds_min = {-0.5f, 0, -0.5f};
    model->bounds_max = {0.5f, 1, 0.5f};
    return model;
  }

  static std::shared_ptr<const engine::SurfaceMesh> Floor(float height) {
    auto mesh = std::make_shared<engine::SurfaceMesh>();
    mesh->vertices = {{-20, height, -5}, {20, height, -5}, {20, height, 40}, {-20, height, 40}};
    mesh->triangles = {{0, 1, 2}, {0, 2, 3}};
    return mesh;
  }

  // Over a video of one grey.
  cv::Mat Draw(std::shared_ptr<const engine::SurfaceMesh> surfaces, bool shadows = true, bool light = true) {
    if (renderer_ == nullptr) renderer_ = std::make_unique<Renderer>();
    content::Scene scene;
    scene.entities = {cube_};
    scene.entities.insert(scene.entities.end(), others_.begin(), others_.end());
    engine::TrackedFrame tracked = Tracked(cv::Mat(480, 640, CV_8UC3, cv::Scalar::all(kGrey)));
    tracked.camera_from_map = CameraFromMap();
    const engine::CameraModel camera = StronglyDistorted();
    View view;
    view.tracked = &tracked;
    view.camera = &camera;
    view.scene = &scene;
    view.surfaces = std::move(surfaces);
    view.shadows = shadows;
    view.light = light ? &light_ : nullptr;
    view.overlay.hud = false;
    view.animation_seconds = seconds_;
    GlQuery triangles;
    renderer_->Draw(view);
    triangles_ = triangles.End();
    cv::Mat image;
    renderer_->ReadBack(&image);
    return image;
  }

  static engine::Rigid3 CameraFromMap() {
    // 30 degrees down, from a metre above the map's origin.
    const engine::Rotation3 rotation = engine::Rotation3::Exp({std::acos(-1.0) / 6, 0, 0});
    return engine::Rigid3(rotation, -(rotation * Eigen::Vector3d(0, -1, 0)));
  }
  // The red channel at a point of the map.
  static int At(const cv::Mat& image, const Eigen::Vector3d& point) {
    const auto pixel = StronglyDistorted().Project(CameraFromMap() * point);
    return image.at<cv::Vec3b>(static_cast<int>(std::lround(pixel->y())),
                               static_cast<int>(std::lround(pixel->x())))[2];
  }

  // Forgets what earlier images have left.
  void StartAnew() { renderer_.reset(); }

  static constexpr int kGrey = 180;
  engine::LightEstimate light_;
  content::Entity cube_;
  std::vector<content::Entity> others_;
  double seconds_ = 0;
  unsigned triangles_ = 0;  // That the last Draw sent to the graphics card.

 private:
  struct GlQuery {
    GlQuery() {
      glGenQueries(1, &name);
      glBeginQuery(GL_PRIMITIVES_GENERATED, name);
    }
    unsigned End() const {
      glEndQuery(GL_PRIMITIVES_GENERATED);
      GLuint count = 0;
      glGetQueryObjectuiv(name, GL_QUERY_RESULT, &count);
      glDeleteQueries(1, &name);
      return count;
    }
    GLuint name = 0;
  };
  std::unique_ptr<Renderer> renderer_;  // Needs the context of the fixture.
};

TEST_F(RoomShadowsTest, FallAwayFromTheLightAsFarAsTheCasterIsHigh) {
  // The light stands 45 degrees high, so that the shadow of the cube of 1 m reaches 1 m beyond its right
  // side.
  const cv::Mat image = Draw(Floor(1));
  EXPECT_LT(At(image, {1.3, 1, 4}), kGrey - 40) << "in the shadow";
  EXPECT_NEAR(At(image, {1.7, 1, 4}), kGrey, 1) << "beyond it";
  EXPECT_NEAR(At(image, {-1.0, 1, 4}), kGrey, 1) << "towards the light";
  EXPECT_NEAR(At(image, {1.3, 1, 3}), kGrey, 1) << "beside it";
}

TEST_F(RoomShadowsTest, TakeTheShareOfTheMainLight) {
  // A floor gets 0.6 cos 45° of its brightness of 0.5 + nothing else from the main light; the rest remains.
  const double left = 1 - 0.6 * std::sqrt(0.5) / 0.5;
  const cv::Mat image = Draw(Floor(1));
  EXPECT_NEAR(At(image, {1.3, 1, 4}), kGrey * std::pow(left, 1 / 2.2), 6);
}

TEST_F(RoomShadowsTest, FallOnTheSurfaceWhereItIsAndNotOnThePlaneOfTheModel) {
  // The floor is half a metre lower, so that the shadow moves away from the light by as much.
  const cv::Mat image = Draw(Floor(1.5));
  EXPECT_LT(At(image, {1.8, 1.5, 4}), kGrey - 40);
  EXPECT_NEAR(At(image, {2.2, 1.5, 4}), kGrey, 1);
}

TEST_F(RoomShadowsTest, FallOnThePlaneOfTheModelWhereNoSurfaceIsKnown) {
  const cv::Mat on_plane = Draw(nullptr), on_floor = Draw(Floor(1));
  EXPECT_LT(At(on_plane, {1.3, 1, 4}), kGrey - 40);
  EXPECT_NEAR(At(on_plane, {1.7, 1, 4}), kGrey, 1);
  cv::Mat difference;
  cv::absdiff(on_plane, on_floor, difference);
  EXPECT_LT(cv::mean(difference)[2], 0.2);
}

TEST_F(RoomShadowsTest, OfContactAreDarkestAtTheContactAndNeedNoKnownLight) {
  const cv::Mat image = Draw(Floor(1), true, false);
  const int near = At(image, {0.1, 1, 3.46}), far = At(image, {0.1, 1, 3.25});
  EXPECT_LT(near, kGrey - 15);
  EXPECT_GT(far, near + 10);
  EXPECT_NEAR(At(image, {1.3, 1, 4}), kGrey, 1) << "no shadow of a light whose direction is not known";
}

TEST_F(RoomShadowsTest, AreLeftOutOnDemand) {
  const cv::Mat image = Draw(Floor(1), false);
  EXPECT_EQ(At(image, {1.3, 1, 4}), kGrey);
  EXPECT_EQ(At(image, {0.1, 1, 3.46}), kGrey);
}

TEST_F(RoomShadowsTest, DarkenNothingThatIsAboveTheCaster) {
  // A wall between the light and the cube stays as it is.
  auto wall = std::make_shared<engine::SurfaceMesh>();
  wall->vertices = {{-1.2F, 1, 2}, {-1.2F, 1, 6}, {-1.2F, -1, 6}, {-1.2F, -1, 2}};
  wall->triangles = {{0, 1, 2}, {0, 2, 3}};
  const cv::Mat image = Draw(wall);
  EXPECT_NEAR(At(image, {-1.2, 0.3, 4.3}), kGrey, 1);
}

TEST_F(RoomShadowsTest, OfTheBodyLieUnderWhatStandsOnThinLegs) {
  // A board half a metre above the floor, on a leg at one side: there is little contact, and yet the sky is
  // covered in the middle below it.
  auto asset = std::make_shared<content::Asset>();
  auto table = Cube();
  for (std::size_t i = 0; i < 8; ++i) table->meshes[0].primitives[0].vertices[i].position.y *= 0.2f;
  for (std::size_t i = 0; i < 8; ++i) table->meshes[0].primitives[0].vertices[i].position.y += 0.5f;
  table->bounds_min.y = 0;
  table->bounds_max.y = 0.7f;
  asset->model = table;
  cube_.model.asset = asset;
  const cv::Mat image = Draw(Floor(1), true, false);
  EXPECT_LT(At(image, {0.0, 1, 3.6}), kGrey - 10) << "below it";
  EXPECT_NEAR(At(image, {2.2, 1, 4}), kGrey, 1) << "beside it";
}

TEST_F(RoomShadowsTest, AreDrawnAgainOnlyForWhatMoves) {
  constexpr unsigned kCubeTriangles = 12;
  const cv::Mat first = Draw(Floor(1));
  const unsigned with_depths = triangles_;
  const cv::Mat again = Draw(Floor(1));
  EXPECT_EQ(triangles_, with_depths - 2 * kCubeTriangles)
      << "one image of depths for the light, one for the contact";
  EXPECT_EQ(cv::norm(first, again, cv::NORM_INF), 0);
  // A signpost turns with the viewer; the cube is drawn once more, for the sphere that holds both.
  content::Entity sign;
  sign.name = "sign-1";
  sign.signpost.text = "A";
  sign.signpost.anchor = {1.2, 1, 4};
  sign.signpost.height = 0.3;
  others_ = {sign};
  Draw(Floor(1));
  const unsigned with_both = triangles_;
  others_[0].signpost.anchor.x() += 0.01;  // As if it had turned.
  Draw(Floor(1));
  EXPECT_EQ(triangles_, with_both - 2 * kCubeTriangles);
}

TEST_F(RoomShadowsTest, EqualNewlyDrawnOnesAfterAnyChange) {
  const auto is_as_if_new = [this](const char* what) {
    const cv::Mat kept = Draw(Floor(1));
    StartAnew();
    const cv::Mat fresh = Draw(Floor(1));
    cv::Mat difference;
    cv::absdiff(kept, fresh, difference);
    // The resolution of the depths may differ by the size of their sphere.
    EXPECT_LT(cv::mean(difference)[2], 0.2) << what;
  };
  Draw(Floor(1));
  cube_.model.map_from_model.translation.x() = -0.7;
  is_as_if_new("another place");
  light_.to_light = Eigen::Vector3d(1, -1, 0.3).normalized();
  is_as_if_new("another light");
  auto asset = std::make_shared<content::Asset>();
  auto board = Cube();
  for (content::Vertex& vertex : board->meshes[0].primitives[0].vertices) vertex.position.z *= 0.1f;
  asset->model = board;
  cube_.model.asset = asset;
  is_as_if_new("another model");
  asset = std::make_shared<content::Asset>();
  auto moving = Cube();
  content::AnimationChannel channel;
  channel.times = {0, 2};
  channel.values = {{0, 0, 0, 0}, {2, 0, 0, 0}};
  channel.node = 0;
  moving->animations.push_back({"walk", 2, {channel}});
  asset->model = moving;
  cube_.model.asset = asset;
  cube_.model.animation = 0;
  is_as_if_new("an animation");
  seconds_ = 1;
  is_as_if_new("its next moment");
}

}  // namespace
}  // namespace docent::ui
