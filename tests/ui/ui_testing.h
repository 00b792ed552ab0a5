// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <opencv2/imgproc.hpp>
#include <string>

#include "content/scene.h"
#include "engine/base/error.h"
#include "engine/base/random.h"
#include "tests/support/must_run.h"
#include "ui/context.h"
#include "ui/renderer.h"

// Shared by the tests of ui/: a fixture with an offscreen context, which skips the test if there is none, and
// small generated models.
namespace docent::ui {

class OffscreenTest : public ::testing::Test {
 protected:
  void SetUp() override {
    try {
      context_ = std::make_unique<OffscreenContext>();
    } catch (const Error& error) {
      SKIP_OR_FAIL(error.what());
    }
  }
  std::unique_ptr<OffscreenContext> context_;
};

inline engine::CameraModel StronglyDistorted() {
  return {engine::LensModel::kRadialTangential,
          {640, 480, 404.243, 405.456, 318.7, 241.9},
          {-0.31, 0.09, 0.0016, -0.0011, 0}};
}

inline cv::Mat NoiseImage(int width_px, int height_px, int type) {
  cv::Mat image(height_px, width_px, type);
  Random random(7);
  for (int y = 0; y < image.rows; ++y) {
    for (std::size_t x = 0; x < image.cols * image.elemSize(); ++x)
      image.ptr(y)[x] = static_cast<std::uint8_t>(random.Below(256));
  }
  return image;
}

// A square of this side length in the model's xy plane, visible from both sides, in one unlit colour (linear
// RGB).
inline std::shared_ptr<content::Model> SquareModel(float side, const glm::vec4& color) {
  auto model = std::make_shared<content::Model>();
  content::Material material;
  material.base_color = color;
  material.unlit = true;
  material.double_sided = true;
  if (color.a < 1) material.alpha = content::Material::Alpha::kBlend;
  model->materials.push_back(material);
  content::Primitive primitive;
  for (const glm::vec2& corner : {glm::vec2(-1, -1), glm::vec2(1, -1), glm::vec2(1, 1), glm::vec2(-1, 1)}) {
    content::Vertex vertex;
    vertex.position = glm::vec3(corner * (0.5f * side), 0);
    primitive.vertices.push_back(vertex);
  }
  primitive.indices = {0, 1, 2, 0, 2, 3};
  primitive.material = 0;
  model->meshes.push_back({"square", {primitive}});
  content::Node node;
  node.mesh = 0;
  model->nodes.push_back(node);
  model->roots.push_back(0);
  model->bounds_min = glm::vec3(-side, -side, 0);
  model->bounds_max = glm::vec3(side, side, 0);
  return model;
}

// A model at a point of the map whose +z axis faces a camera at the map's origin.
inline content::Entity Facing(std::shared_ptr<const content::Model> model, const Eigen::Vector3d& place) {
  auto asset = std::make_shared<content::Asset>();
  asset->model = std::move(model);
  content::Entity entity;
  entity.kind = content::Entity::Kind::kModel;
  entity.model.asset = asset;
  entity.model.map_from_model.rotation =
      engine::Rotation3(Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), -place));
  entity.model.map_from_model.translation = place;
  return entity;
}

// A tracked frame of this image with its pose at the map's origin.
inline engine::TrackedFrame Tracked(const cv::Mat& image) {
  engine::TrackedFrame tracked;
  tracked.frame.image = image;
  tracked.state = engine::TrackingState::kSixDof;
  return tracked;
}

inline cv::Mat DrawImage(Renderer* renderer, const engine::TrackedFrame& tracked,
                         const engine::CameraModel& camera, const content::Scene& scene) {
  View view;
  view.tracked = &tracked;
  view.camera = &camera;
  view.scene = &scene;
  view.overlay.hud = false;
  view.follows_degradation = false;  // Videos of noise would give content the same noise.
  renderer->Draw(view);
  cv::Mat image;
  renderer->ReadBack(&image);
  return image;
}

// The centroid of the image weighted by its green channel, in pixels; (-1, -1) if the image is black.
inline Eigen::Vector2d Centroid(const cv::Mat& image) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double weight = 0;
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const double green = image.at<cv::Vec3b>(y, x)[1];
      sum += green * Eigen::Vector2d(x, y);
      weight += green;
    }
  }
  return weight > 0 ? Eigen::Vector2d(sum / weight) : Eigen::Vector2d(-1, -1);
}

}  // namespace docent::ui
