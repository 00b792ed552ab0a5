// SPDX-License-Identifier: Apache-2.0
#include "ui/content_layer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "ui/label_board.h"
#include "ui/shaders.h"

namespace docent::ui {
namespace {

constexpr std::size_t kMaxLenses = 4;
constexpr int kMaxAtlasSidePx = 4096;

int MaxAtlasSide() {
  GLint side = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &side);
  return std::clamp(static_cast<int>(side), 256, kMaxAtlasSidePx);
}

// The rectangle of the atlas that a covered part of a face's view occupies, with a border for anti-aliased
// edges.
PixelRectangle RectangleOf(const LensFace& face, const MeshDrawer::Cover& cover) {
  const auto pixels = [](float low, float high, int size) {
    const int first = std::max(0, static_cast<int>(std::floor(low * static_cast<float>(size))) - 1);
    const int end = std::min(size, static_cast<int>(std::ceil(high * static_cast<float>(size))) + 1);
    return std::pair(first, end - first);
  };
  const auto [x, width] = pixels(cover.low.x, cover.high.x, face.width_px);
  const auto [y, height] = pixels(cover.low.y, cover.high.y, face.height_px);
  return {face.x_px + x, face.y_px + y, width, height};
}

}  // namespace

ContentLayer::ContentLayer(int samples, int max_texture_px, const std::string& language)
    : samples_(samples),
      mesh_drawer_(max_texture_px),
      warp_program_("lens warp", kFullScreenVertexShader, kWarpFragmentShader),
      shapes_(language) {
  warp_program_.AssignTextureUnits({"lookup", "atlas"});
}

ContentLayer::~ContentLayer() = default;

void ContentLayer::Draw(const engine::CameraModel& camera, const engine::Rigid3& camera_from_map,
                        const content::Scene& scene, const What& what, const RenderTarget& image) {
  const Drawn drawn = Instances(scene, camera_from_map.OriginInSource(), what);
  surface_drawer_.Prepare(hiding_surfaces_.Of(scene, what.occluders, what.surfaces));
  Composite(camera, camera_from_map, drawn.plain, 1, image);
  if (!drawn.faint.empty()) Composite(camera, camera_from_map, drawn.faint, kFaintOpacity, image);
}

void ContentLayer::Composite(const engine::CameraModel& camera, const engine::Rigid3& camera_from_map,
                             const std::vector<ModelInstance>& instances, double opacity,
                             const RenderTarget& image) {
  mesh_drawer_.Prepare(instances, glm::vec3(0.0f, -1.0f, 0.0f));
  if (instances.empty()) return;
  Lens& lens = FindLens(camera);
  const PixelRectangle region = DrawAtlas(camera_from_map, &lens);
  if (region.empty()) return;

  image.BindForDrawing();
  warp_program_.Use();
  glUniform1f(warp_program_.Uniform("opacity"), static_cast<float>(opacity));
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D, lens.lookup.name());
  glActiveTexture(GL_TEXTURE1);
  glBindTexture(GL_TEXTURE_2D, lens.atlas->texture());
  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  glEnable(GL_SCISSOR_TEST);
  glScissor(region.x, region.y, region.width, region.height);
  glBindVertexArray(empty_vertex_array_.name());
  DrawFullScreenTriangle();
  glDisable(GL_SCISSOR_TEST);
  glDisable(GL_BLEND);
}

PixelRectangle ContentLayer::DrawAtlas(const engine::Rigid3& camera_from_map, Lens* lens) {
  struct Pass {
    const LensFace* face;
    PinholeView view;
    PixelRectangle rectangle;
  };
  std::vector<Pass> passes;
  std::vector<PixelRectangle> drawn;
  for (const LensFace& face : lens->warp.faces) {
    const engine::Rigid3 face_from_camera(face.face_from_camera, Eigen::Vector3d::Zero());
    const PinholeView view{face_from_camera * camera_from_map, face.bounds};
    const MeshDrawer::Cover cover = mesh_drawer_.Covered(view);
    if (cover.empty()) continue;
    drawn.push_back(RectangleOf(face, cover));
    passes.push_back({&face, view, drawn.back()});
  }
  // Only the rectangles drawn now or in the previous frame are cleared. Clearing and resolving the whole
  // atlas would cost more than the content itself when there is little of it.
  std::vector<PixelRectangle> changed = lens->drawn;
  changed.insert(changed.end(), drawn.begin(), drawn.end());
  lens->atlas->BindForDrawing();
  glEnable(GL_SCISSOR_TEST);
  glClearColor(0.0f, 0.0f, 0.0f, 0.0f);
  for (const PixelRectangle& rectangle : changed) {
    glScissor(rectangle.x, rectangle.y, rectangle.width, rectangle.height);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  }
  for (const Pass& pass : passes) {
    glViewport(pass.face->x_px, pass.face->y_px, pass.face->width_px, pass.face->height_px);
    glScissor(pass.rectangle.x, pass.rectangle.y, pass.rectangle.width, pass.rectangle.height);
    mesh_drawer_.Draw(pass.view, surface_drawer_);
  }
  glDisable(GL_SCISSOR_TEST);
  for (const PixelRectangle& rectangle : changed)
    lens->atlas->Resolve(rectangle.x, rectangle.y, rectangle.width, rectangle.height);
  lens->drawn = drawn;
  return ImageFromAtlas(lens->warp, lens->camera, drawn);
}

ContentLayer::Lens& ContentLayer::FindLens(const engine::CameraModel& camera) {
  const auto found = std::find_if(lenses_.begin(), lenses_.end(),
                                  [&](const std::unique_ptr<Lens>& lens) { return lens->camera == camera; });
  if (found != lenses_.end()) {
    std::rotate(found, found + 1, lenses_.end());
    return *lenses_.back();
  }
  if (lenses_.size() >= kMaxLenses) lenses_.erase(lenses_.begin());
  LensWarp warp = MakeLensWarp(camera, MaxAtlasSide());
  auto lens = std::make_unique<Lens>();
  lens->camera = camera;
  lens->atlas = std::make_unique<RenderTarget>(warp.atlas_width_px, warp.atlas_height_px, samples_, true);
  // The contents of new graphics memory are undefined, so the whole atlas counts as drawn until it has been
  // cleared once.
  lens->drawn = {{0, 0, warp.atlas_width_px, warp.atlas_height_px}};
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D, lens->lookup.name());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RG32F, camera.width_px(), camera.height_px(), 0, GL_RG, GL_FLOAT,
               warp.lookup.data());
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  warp.lookup = {};
  lens->warp = std::move(warp);
  lenses_.push_back(std::move(lens));
  return *lenses_.back();
}

ContentLayer::Drawn ContentLayer::Instances(const content::Scene& scene, const Eigen::Vector3d& eye_in_map,
                                            const What& what) {
  Drawn drawn;
  drawn.plain.reserve(scene.entities.size());
  for (const content::Entity& entity : scene.entities) {
    const bool faint =
        entity.hidden && std::find(what.faint.begin(), what.faint.end(), entity.name) != what.faint.end();
    if ((entity.hidden && !faint) || entity.kind == content::Entity::Kind::kLabel) continue;
    const bool is_marker =
        entity.kind == content::Entity::Kind::kSound || entity.kind == content::Entity::Kind::kOccluder;
    if (is_marker && !what.markers) continue;
    for (content::EntityShape& shape :
         std::array{shapes_.ShapeOf(entity, eye_in_map), shapes_.ArrowOf(entity)}) {
      if (shape.model == nullptr) continue;
      ModelInstance instance;
      instance.model = std::move(shape.model);
      instance.map_from_model = GlmFrom(shape.map_from_model);
      if (entity.kind == content::Entity::Kind::kModel) instance.animation = entity.model.animation;
      instance.seconds = what.animation_seconds;
      (faint ? drawn.faint : drawn.plain).push_back(std::move(instance));
    }
  }
  shapes_.EndFrame();
  return drawn;
}

}  // namespace docent::ui
