// SPDX-License-Identifier: Apache-2.0
#include "ui/renderer.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/ui/ui_testing.h"
#include "ui/content_layer.h"
#include "ui/gl_objects.h"
#include "ui/inset.h"
#include "ui/model_resources.h"

namespace docent::ui {
namespace {

using RendererTest = OffscreenTest;

int CountDifferent(const cv::Mat& a, const cv::Mat& b) {
  cv::Mat difference;
  cv::absdiff(a, b, difference);
  return cv::countNonZero(difference.reshape(1));
}

TEST_F(RendererTest, KeepsVideoPixelsExactWhereThereIsNoContent) {
  Renderer renderer;
  const engine::CameraModel camera = StronglyDistorted();
  const cv::Mat video = NoiseImage(640, 480, CV_8UC3);
  const engine::TrackedFrame tracked = Tracked(video);
  EXPECT_EQ(CountDifferent(DrawImage(&renderer, tracked, camera, {}), video), 0);

  content::Scene scene;
  scene.entities.push_back(Facing(SquareModel(0.4f, glm::vec4(1, 0, 0, 1)), {0, 0, 2}));
  const cv::Mat drawn = DrawImage(&renderer, tracked, camera, scene);
  EXPECT_EQ(drawn.at<cv::Vec3b>(242, 319), cv::Vec3b(0, 0, 255));
  // The square spans 81 pixels around the middle; the video beside it is unchanged.
  const cv::Rect around(319 - 50, 242 - 50, 100, 100);
  cv::Mat rest = drawn.clone(), expected = video.clone();
  rest(around).setTo(0);
  expected(around).setTo(0);
  EXPECT_EQ(CountDifferent(rest, expected), 0);
  EXPECT_GT(CountDifferent(drawn, video), 3 * 70 * 70);
}

TEST_F(RendererTest, ShowsGreyVideoAndSubImages) {
  Renderer renderer;
  const engine::CameraModel camera = StronglyDistorted();
  const cv::Mat gray = NoiseImage(640, 480, CV_8UC1);
  cv::Mat colored;
  cv::cvtColor(gray, colored, cv::COLOR_GRAY2BGR);
  EXPECT_EQ(CountDifferent(DrawImage(&renderer, Tracked(gray), camera, {}), colored), 0);
  const cv::Mat large = NoiseImage(701, 500, CV_8UC3);
  const cv::Mat part = large(cv::Rect(13, 7, 640, 480));
  EXPECT_EQ(CountDifferent(DrawImage(&renderer, Tracked(part), camera, {}), part), 0);
}

TEST_F(RendererTest, ShowsAnotherCameraOnlyInTheInset) {
  Renderer renderer;
  const engine::CameraModel camera = StronglyDistorted();
  const engine::TrackedFrame tracked = Tracked(cv::Mat(480, 640, CV_8UC3, cv::Scalar(10, 20, 30)));
  engine::TrackedFrame other = Tracked(cv::Mat(200, 400, CV_8UC3, cv::Scalar(200, 100, 50)));
  View view;
  view.tracked = &tracked;
  view.camera = &camera;
  view.overlay.hud = false;
  view.overlay.inset = &other;
  renderer.Draw(view);
  cv::Mat drawn;
  renderer.ReadBack(&drawn);
  const Inset inset = PlaceInset(640, 480, 400, 200);
  EXPECT_NEAR(static_cast<double>(inset.width) / inset.height, 2, 0.05);
  EXPECT_TRUE(inset.Contains({inset.x + 1, inset.y + 1}));
  EXPECT_FALSE(inset.Contains({inset.x - 1, inset.y + 1}));
  const cv::Mat inside = drawn(cv::Rect(inset.x + 5, inset.y + 5, inset.width - 10, inset.height - 10));
  EXPECT_EQ(CountDifferent(inside, cv::Mat(inside.size(), CV_8UC3, cv::Scalar(200, 100, 50))), 0);
  // The border of the inset is six pixels wide.
  drawn(cv::Rect(inset.x - 6, std::max(0, inset.y - 6), inset.width + 12, inset.height + 12))
      .setTo(cv::Scalar(10, 20, 30));
  EXPECT_EQ(CountDifferent(drawn, cv::Mat(480, 640, CV_8UC3, cv::Scalar(10, 20, 30))), 0);
}

TEST_F(RendererTest, HidesOccludedContentInAnyPlacingOrder) {
  Renderer renderer;
  const engine::CameraModel camera = StronglyDistorted();
  const engine::TrackedFrame tracked = Tracked(cv::Mat::zeros(480, 640, CV_8UC3));
  const content::Entity near = Facing(SquareModel(0.2f, glm::vec4(1, 0, 0, 1)), {0, 0, 1.0});
  const content::Entity far = Facing(SquareModel(1.0f, glm::vec4(0, 1, 0, 1)), {0, 0, 1.02});
  for (const bool near_first : {true, false}) {
    content::Scene scene;
    scene.entities = near_first ? std::vector{near, far} : std::vector{far, near};
    const cv::Mat drawn = DrawImage(&renderer, tracked, camera, scene);
    EXPECT_EQ(drawn.at<cv::Vec3b>(242, 319), cv::Vec3b(0, 0, 255));
    EXPECT_EQ(drawn.at<cv::Vec3b>(242, 419), cv::Vec3b(0, 255, 0));
  }
}

TEST_F(RendererTest, BlendsTransparentContentOverTheVideoAndOverEachOther) {
  Renderer renderer;
  const engine::CameraModel camera = StronglyDistorted();
  const engine::TrackedFrame tracked = Tracked(cv::Mat(480, 640, CV_8UC3, cv::Scalar(200, 100, 40)));
  content::Scene scene;
  scene.entities.push_back(Facing(SquareModel(0.2f, glm::vec4(1, 0, 0, 0.25f)), {0, 0, 1.0}));
  scene.entities.push_back(Facing(SquareModel(1.0f, glm::vec4(0, 1, 0, 0.5f)), {0, 0, 1.5}));
  const cv::Mat drawn = DrawImage(&renderer, tracked, camera, scene);
  const cv::Vec3b once = drawn.at<cv::Vec3b>(242, 419), twice = drawn.at<cv::Vec3b>(242, 319);
  EXPECT_NEAR(once[0], 0.5 * 200, 2);
  EXPECT_NEAR(once[1], 0.5 * 255 + 0.5 * 100, 2);
  EXPECT_NEAR(twice[1], 0.75 * (0.5 * 255 + 0.5 * 100), 2);
  EXPECT_NEAR(twice[2], 0.25 * 255 + 0.75 * 0.5 * 40, 2);
}

TEST_F(RendererTest, DrawsEachImageWithItsOwnPoseOnly) {
  Renderer renderer;
  const engine::CameraModel camera = StronglyDistorted();
  content::Scene scene;
  const Eigen::Vector3d place(0.1, -0.05, 2);
  scene.entities.push_back(Facing(SquareModel(0.05f, glm::vec4(1)), place));
  Random random(3);
  for (int i = 0; i < 6; ++i) {
    engine::TrackedFrame tracked = Tracked(cv::Mat::zeros(480, 640, CV_8UC3));
    tracked.camera_from_map = {
        engine::Rotation3::Exp({random.Uniform(-0.2, 0.2), random.Uniform(-0.2, 0.2), random.Uniform(-1, 1)}),
        {random.Uniform(-0.3, 0.3), random.Uniform(-0.3, 0.3), random.Uniform(-0.3, 0.3)}};
    const Eigen::Vector2d seen = Centroid(DrawImage(&renderer, tracked, camera, scene));
    const std::optional<Eigen::Vector2d> expected =
        camera.Project(Eigen::Vector3d(tracked.camera_from_map * place));
    ASSERT_TRUE(expected.has_value());
    EXPECT_LT((seen - *expected).norm(), 0.5) << "frame " << i;
  }
}

TEST_F(RendererTest, DrawsHiddenContentFaintlyOnlyWhereAnAuthorSelectedIt) {
  Renderer renderer;
  const engine::CameraModel camera = StronglyDistorted();
  const engine::TrackedFrame tracked = Tracked(cv::Mat(480, 640, CV_8UC3, cv::Scalar(200, 100, 40)));
  content::Scene scene;
  scene.entities.push_back(Facing(SquareModel(0.4f, glm::vec4(1, 0, 0, 1)), {0, 0, 2}));
  scene.entities.push_back(Facing(SquareModel(0.2f, glm::vec4(0, 1, 0, 1)), {0.5, 0, 2}));
  scene.entities[0].name = "hidden";
  scene.entities[0].hidden = true;
  scene.entities[1].name = "shown";
  const std::vector<std::string> selected = {"hidden", "shown"};
  View view;
  view.tracked = &tracked;
  view.camera = &camera;
  view.scene = &scene;
  view.overlay.hud = false;
  cv::Mat without, with;
  renderer.Draw(view);
  renderer.ReadBack(&without);
  view.faint = selected;
  renderer.Draw(view);
  renderer.ReadBack(&with);
  const Eigen::Vector2d beside = *camera.Project(Eigen::Vector3d(0.5, 0, 2));
  const cv::Point shown(static_cast<int>(beside.x()), static_cast<int>(beside.y()));
  EXPECT_EQ(without.at<cv::Vec3b>(242, 319), cv::Vec3b(200, 100, 40));
  const cv::Vec3b faint = with.at<cv::Vec3b>(242, 319);
  EXPECT_NEAR(faint[0], 0.65 * 200, 2);
  EXPECT_NEAR(faint[1], 0.65 * 100, 2);
  EXPECT_NEAR(faint[2], 0.65 * 40 + 0.35 * 255, 2);
  EXPECT_EQ(with.at<cv::Vec3b>(shown), cv::Vec3b(0, 255, 0)) << "what is not hidden is drawn as ever";
  EXPECT_EQ(without.at<cv::Vec3b>(shown), cv::Vec3b(0, 255, 0));
}

TEST_F(RendererTest, DrawsNoContentWithoutAPose) {
  Renderer renderer;
  const engine::CameraModel camera = StronglyDistorted();
  content::Scene scene;
  scene.entities.push_back(Facing(SquareModel(1, glm::vec4(1)), {0, 0, 1}));
  engine::TrackedFrame tracked = Tracked(NoiseImage(640, 480, CV_8UC3));
  tracked.state = engine::TrackingState::kLost;
  EXPECT_EQ(CountDifferent(DrawImage(&renderer, tracked, camera, scene), tracked.frame.image), 0);
}

// A square with a joint that moves it by 0.3 to the right.
std::shared_ptr<content::Model> SquareOnAJoint() {
  auto model = SquareModel(0.05f, glm::vec4(1));
  for (content::Vertex& vertex : model->meshes[0].primitives[0].vertices)
    vertex.weights = glm::vec4(1, 0, 0, 0);
  content::Node joint;
  joint.translation = glm::vec3(0.3f, 0, 0);
  model->nodes.push_back(joint);
  model->roots.push_back(1);
  model->skins.push_back({{1}, {glm::mat4(1.0f)}});
  model->nodes[0].skin = 0;
  return model;
}

// Two metres before the camera, with the axes of the map.
cv::Mat DrawnBefore(const engine::CameraModel& camera, std::shared_ptr<const content::Model> model) {
  Renderer renderer;
  content::Entity entity = Facing(std::move(model), {0, 0, 2});
  entity.model.map_from_model.rotation = {};
  content::Scene scene;
  scene.entities.push_back(entity);
  return DrawImage(&renderer, Tracked(cv::Mat::zeros(480, 640, CV_8UC3)), camera, scene);
}

TEST_F(RendererTest, MovesASkinnedMeshWithItsJoint) {
  const engine::CameraModel camera = StronglyDistorted();
  const Eigen::Vector2d expected = *camera.Project(Eigen::Vector3d(0.3, 0, 2));
  EXPECT_LT((Centroid(DrawnBefore(camera, SquareOnAJoint())) - expected).norm(), 0.5);
}

TEST_F(RendererTest, DrawsTheFrontOfASkinnedMeshThatItsJointMirrors) {
  const engine::CameraModel camera = StronglyDistorted();
  auto model = SquareOnAJoint();
  model->materials[0].double_sided = false;
  const auto brightest = [&] { return cv::norm(DrawnBefore(camera, model), cv::NORM_INF); };
  const glm::quat half_turn(0, 0, 1, 0);  // About y, so that the front faces the camera.
  model->nodes[1].rotation = half_turn;
  EXPECT_GT(brightest(), 100);
  model->nodes[1].scale = glm::vec3(-1, 1, 1);
  EXPECT_GT(brightest(), 100) << "the joint mirrors it";
  model->nodes[1].rotation = glm::quat(1, 0, 0, 0);
  EXPECT_EQ(brightest(), 0) << "the back";
}

TEST_F(RendererTest, MovesManyMeshesOfOneSkinWithTheirJoint) {
  const engine::CameraModel camera = StronglyDistorted();
  auto model = SquareOnAJoint();
  model->skins[0].joints.resize(60, 1);
  model->skins[0].inverse_bind.resize(60, glm::mat4(1.0f));
  for (int i = 1; i < 300; ++i) {
    model->roots.push_back(static_cast<int>(model->nodes.size()));
    model->nodes.push_back(model->nodes[0]);
  }
  // A square whose joints found no room would be in the middle of the image.
  const Eigen::Vector2d expected = *camera.Project(Eigen::Vector3d(0.3, 0, 2));
  EXPECT_LT((Centroid(DrawnBefore(camera, model)) - expected).norm(), 0.5);
}

TEST_F(RendererTest, FreesGraphicsMemoryOfDeletedModels) {
  ContentLayer layer(4, 256, "");
  const RenderTarget target(640, 480, 1, false);
  const engine::CameraModel camera = StronglyDistorted();
  content::Scene scene;
  scene.entities.push_back(Facing(SquareModel(1, glm::vec4(1)), {0, 0, 1}));
  scene.entities.push_back(Facing(SquareModel(1, glm::vec4(1)), {0, 0, 2}));
  layer.Draw(camera, {}, scene, {}, target);
  EXPECT_EQ(layer.cached_models(), 2u);
  scene.entities.pop_back();
  layer.Draw(camera, {}, scene, {}, target);
  layer.Draw(camera, {}, scene, {}, target);
  EXPECT_EQ(layer.cached_models(), 1u);
}

TEST_F(RendererTest, UploadsAnImageOnceForAllTexturesThatShowItInTheSameWay) {
  content::Model model;
  content::Image image;
  image.width_px = image.height_px = 1;
  image.rgba = {255, 255, 255, 255};
  model.images.push_back(image);
  content::Texture texture;
  texture.image = 0;
  model.textures.assign(3, texture);
  model.textures[2].repeat_u = false;
  ModelResources resources(model, 256);
  const GLuint color = resources.Texture(model, 0, true);
  ASSERT_NE(color, 0u);
  EXPECT_EQ(resources.Texture(model, 1, true), color);
  EXPECT_NE(resources.Texture(model, 2, true), color) << "it is sampled in another way";
  EXPECT_NE(resources.Texture(model, 0, false), color) << "it is not decoded as a colour";
}

TEST_F(RendererTest, AnimatesTheSearchFigureWhileLost) {
  Renderer renderer;
  const engine::CameraModel camera = StronglyDistorted();
  engine::TrackedFrame tracked = Tracked(cv::Mat(480, 640, CV_8UC3, cv::Scalar(90, 90, 90)));
  tracked.state = engine::TrackingState::kLost;
  View view;
  view.tracked = &tracked;
  view.camera = &camera;
  cv::Mat early, late;
  view.animation_seconds = 0.5;
  renderer.Draw(view);
  renderer.ReadBack(&early);
  view.animation_seconds = 1.0;
  renderer.Draw(view);
  renderer.ReadBack(&late);
  const cv::Rect middle(220, 140, 200, 200);
  EXPECT_GT(CountDifferent(early(middle), late(middle)), 1000);
}

TEST_F(RendererTest, ShowsADifferentTextForEachMappingStatus) {
  Renderer renderer;
  const engine::CameraModel camera = StronglyDistorted();
  engine::TrackedFrame tracked = Tracked(cv::Mat(480, 640, CV_8UC3, cv::Scalar(90, 90, 90)));
  View view;
  view.tracked = &tracked;
  view.camera = &camera;
  std::vector<cv::Mat> images;
  for (const char* word : {"", "limited", "extending", "mapped"}) {
    view.overlay.mapping = word;
    renderer.Draw(view);
    renderer.ReadBack(&images.emplace_back());
    for (std::size_t i = 0; i + 1 < images.size(); ++i)
      EXPECT_GT(CountDifferent(images[i], images.back()), 20) << word;
  }
}

TEST_F(RendererTest, SurvivesAnyTextInItsLabels) {
  Renderer renderer;
  const engine::CameraModel camera = StronglyDistorted();
  engine::TrackedFrame tracked = Tracked(cv::Mat::zeros(480, 640, CV_8UC3));
  View view;
  view.tracked = &tracked;
  view.camera = &camera;
  view.overlay.hint = std::string(100000, 'W');
  view.overlay.map_name = "\xff\xfe\x80 broken \xc3";
  view.overlay.message = std::string("nul\0inside", 10) + "\x01\x02";
  renderer.Draw(view);
  cv::Mat image;
  renderer.ReadBack(&image);
  EXPECT_EQ(image.size(), cv::Size(640, 480));
}

TEST(Renderer, ReadsBackWithTheHeadsUpDisplayWhatWasDrawnWithoutIt) {
  OffscreenContext context;
  Renderer renderer;
  const engine::CameraModel camera = StronglyDistorted();
  const engine::TrackedFrame tracked = Tracked(cv::Mat(480, 640, CV_8UC3, cv::Scalar(30, 60, 90)));
  View view;
  view.tracked = &tracked;
  view.camera = &camera;
  view.overlay.map_name = "Hall";
  view.overlay.message = "Point the camera at the elephants.";
  cv::Mat with, plain, read;
  renderer.Draw(view);
  renderer.ReadBack(&with);
  view.overlay.hud = false;
  renderer.Draw(view);
  renderer.ReadBack(&plain);
  view.overlay.hud = true;
  renderer.ReadBackWithHeadsUp(view, &read);
  EXPECT_GT(cv::norm(with, plain, cv::NORM_INF), 50) << "the display is seen";
  EXPECT_EQ(cv::norm(with, read, cv::NORM_INF), 0);
  renderer.ReadBack(&read);
  EXPECT_EQ(cv::norm(plain, read, cv::NORM_INF), 0) << "the drawn image stays";
}

}  // namespace
}  // namespace docent::ui
