// SPDX-License-Identifier: Apache-2.0
#include "ui/content_layer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "content/placement.h"
#include "ui/axes.h"
#include "ui/degradation_shader.h"
#include "ui/label_board.h"
#include "ui/room_shaders.h"
#include "ui/shaders.h"

namespace docent::ui {
namespace {

constexpr std::size_t kMaxLenses = 4;
constexpr int kMaxAtlasSidePx = 4096;
// A surface hides content that is farther from the camera by more than this, relative to its depth, because
// content stands on surfaces: nine tenths of the depths that maps measure are off by less
// (docs/decisions/dense-surfaces.md).
constexpr float kDepthBias = 0.02f;

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

// The time of an entity's animation.
double SecondsOf(const content::Entity& entity, const ContentLayer::What& what) {
  if (what.animation_starts == nullptr) return what.animation_seconds;
  const auto start = what.animation_starts->find(entity.name);
  return start == what.animation_starts->end() ? 0 : std::max(0.0, what.animation_seconds - start->second);
}

// Adds the depths of a box.
void AddDepths(const Box& box, const PinholeView& view, MeshDrawer::DepthRange* range) {
  if (MeshDrawer::CoverOf(box, view).empty()) return;
  const glm::mat4 eye_from_map = GlEyeFromMap(view.camera_from_map);
  for (int i = 0; i < 8; ++i)
    range->Include(static_cast<double>(-(eye_from_map * glm::vec4(box.Corner(i), 1.0f)).z), 0);
}

// Adds the pixels into which motion blur spreads what is in this rectangle.
void Widen(const glm::mat3x2& motion, double scale, const engine::CameraModel& camera,
           PixelRectangle* region) {
  float longest = 0;
  for (const int x : {0, camera.width_px()}) {
    for (const int y : {0, camera.height_px()}) {
      const glm::vec3 place(static_cast<double>(x) / scale, static_cast<double>(y) / scale, 1);
      longest = std::max(longest, glm::length(motion * place));
    }
  }
  if (longest * scale < 1) return;
  const int margin = std::min(camera.width_px(), 1 + static_cast<int>(0.5 * scale * longest));
  const int left = std::max(0, region->x - margin), top = std::max(0, region->y - margin);
  region->width = std::min(camera.width_px(), region->x + region->width + margin) - left;
  region->height = std::min(camera.height_px(), region->y + region->height + margin) - top;
  region->x = left;
  region->y = top;
}

// Where an entity stands, if it casts a shadow.
void SetStanding(const content::Entity& entity, ModelInstance* instance) {
  using Kind = content::Entity::Kind;
  instance->casts_shadow = entity.kind == Kind::kModel || entity.kind == Kind::kSignpost;
  instance->turns = entity.kind == Kind::kSignpost;
  instance->base = GlmFrom(content::BaseInMap(entity));
  instance->up = GlmFrom(entity.kind == Kind::kSignpost
                             ? entity.signpost.up
                             : entity.model.map_from_model.rotation * Eigen::Vector3d::UnitY());
}

}  // namespace

ContentLayer::ContentLayer(int samples, int max_texture_px, const std::string& language)
    : samples_(samples),
      mesh_drawer_(max_texture_px),
      warp_program_("lens warp", kFullScreenVertexShader, WarpFragmentShader()),
      room_warp_program_("lens warp in the room", kFullScreenVertexShader, RoomWarpFragmentShader()),
      shapes_(language) {
  warp_program_.AssignTextureUnits({"lookup", "atlas"});
  room_warp_program_.AssignTextureUnits(
      {"lookup", "atlas", "content_depth", "surface_depth", "shadow", "video"});
}

ContentLayer::~ContentLayer() = default;

void ContentLayer::SetSamples(int samples) {
  if (std::exchange(samples_, samples) != samples) lenses_.clear();  // They are made anew with it.
}

void ContentLayer::Draw(const engine::CameraModel& camera, const engine::Rigid3& camera_from_map,
                        const content::Scene& scene, const What& what, const RenderTarget& image) {
  const Drawn drawn = Instances(scene, camera_from_map.OriginInSource(), what);
  surface_drawer_.Prepare(hiding_surfaces_.Of(scene, what.occluders, what.surfaces));
  Composite(camera, camera_from_map, drawn.plain, 1, what, image);
  if (!drawn.faint.empty()) Composite(camera, camera_from_map, drawn.faint, kFaintOpacity, what, image);
}

void ContentLayer::Composite(const engine::CameraModel& camera, const engine::Rigid3& camera_from_map,
                             const std::vector<ModelInstance>& instances, double opacity, const What& what,
                             const RenderTarget& image) {
  mesh_drawer_.Prepare(instances, glm::vec3(0.0f, -1.0f, 0.0f));
  if (instances.empty()) return;
  Lens& lens = FindLens(camera);
  std::vector<PinholeView> views;
  for (const LensFace& face : lens.warp.faces)
    views.push_back(
        {engine::Rigid3(face.face_from_camera, Eigen::Vector3d::Zero()) * camera_from_map, face.bounds});
  bool with_shadows = what.shadows && opacity == 1;
  if (with_shadows) {
    shadows_.Prepare(mesh_drawer_, views, what.light.room);
    with_shadows = !shadows_.empty();
  }
  const std::vector<Pass> passes = PassesOf(camera_from_map, with_shadows, lens);
  MeshDrawer::DepthRange range;
  for (const Pass& pass : passes) {
    mesh_drawer_.AddDepths(pass.view, &range);
    if (with_shadows) AddDepths(shadows_.reach(), pass.view, &range);
  }
  DrawAtlas(passes, range, what.light, &lens);
  const bool with_room = !range.empty() && (with_shadows || !surface_drawer_.empty());
  if (with_room) DrawRoom(passes, range, with_shadows, &lens);
  std::vector<PixelRectangle> drawn;
  for (const Pass& pass : passes) drawn.push_back(pass.all);
  PixelRectangle region = ImageFromAtlas(lens.warp, lens.camera, drawn);
  if (region.empty()) return;
  Widen(what.degradation.motion, what.camera_pixel, lens.camera, &region);

  image.BindForDrawing();
  if (with_room) {
    BindForComposite(lens, range, opacity, with_shadows, what);
  } else {
    warp_program_.Use();
    glUniform1f(warp_program_.Uniform("opacity"), static_cast<float>(opacity));
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_2D, lens.lookup.name());
    glActiveTexture(GL_TEXTURE1);
    glBindTexture(GL_TEXTURE_2D, lens.atlas->texture());
    SetDegradation(warp_program_, what.degradation, what.camera_pixel);
  }
  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  glEnable(GL_SCISSOR_TEST);
  glScissor(region.x, region.y, region.width, region.height);
  glBindVertexArray(empty_vertex_array_.name());
  DrawFullScreenTriangle();
  glDisable(GL_SCISSOR_TEST);
  glDisable(GL_BLEND);
}

void ContentLayer::BindForComposite(const Lens& lens, const MeshDrawer::DepthRange& range, double opacity,
                                    bool with_shadows, const What& what) {
  const GlProgram& program = room_warp_program_;
  program.Use();
  glUniform1f(program.Uniform("opacity"), static_cast<float>(opacity));
  glUniform1i(program.Uniform("has_surfaces"), !surface_drawer_.empty());
  glUniform1i(program.Uniform("has_shadows"), with_shadows);
  glUniform1f(program.Uniform("depth_bias"), kDepthBias);
  glUniform2f(program.Uniform("depth_range"), static_cast<float>(range.near_plane()),
              static_cast<float>(range.far_plane()));
  SetDegradation(program, what.degradation, what.camera_pixel);
  const GLuint textures[] = {lens.lookup.name(),
                             lens.atlas->texture(),
                             lens.room->content_depth.texture(),
                             lens.room->surface_depth.texture(),
                             lens.room->shadow.texture(),
                             what.video};
  GLenum unit = GL_TEXTURE0;
  for (const GLuint texture : textures) {
    glActiveTexture(unit++);
    glBindTexture(GL_TEXTURE_2D, texture);
  }
}

std::vector<ContentLayer::Pass> ContentLayer::PassesOf(const engine::Rigid3& camera_from_map,
                                                       bool with_shadows, const Lens& lens) const {
  std::vector<Pass> passes;
  for (const LensFace& face : lens.warp.faces) {
    const engine::Rigid3 face_from_camera(face.face_from_camera, Eigen::Vector3d::Zero());
    const PinholeView view{face_from_camera * camera_from_map, face.bounds};
    Pass pass{&face, view, {}, {}};
    const MeshDrawer::Cover cover = mesh_drawer_.Covered(view);
    if (!cover.empty()) pass.content = pass.all = RectangleOf(face, cover);
    if (with_shadows) {
      const MeshDrawer::Cover reach = MeshDrawer::CoverOf(shadows_.reach(), view);
      if (!reach.empty()) pass.all.Include(RectangleOf(face, reach));
    }
    if (!pass.all.empty()) passes.push_back(pass);
  }
  return passes;
}

void ContentLayer::DrawAtlas(const std::vector<Pass>& passes, const MeshDrawer::DepthRange& range,
                             const ModelLight& light, Lens* lens) {
  std::vector<PixelRectangle> drawn;
  for (const Pass& pass : passes) drawn.push_back(pass.all);
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
    if (pass.content.empty()) continue;
    glViewport(pass.face->x_px, pass.face->y_px, pass.face->width_px, pass.face->height_px);
    glScissor(pass.content.x, pass.content.y, pass.content.width, pass.content.height);
    mesh_drawer_.Draw(pass.view, range, light);
  }
  glDisable(GL_SCISSOR_TEST);
  for (const PixelRectangle& rectangle : changed)
    lens->atlas->Resolve(rectangle.x, rectangle.y, rectangle.width, rectangle.height);
  lens->drawn = drawn;
}

void ContentLayer::DrawRoom(const std::vector<Pass>& passes, const MeshDrawer::DepthRange& range,
                            bool with_shadows, Lens* lens) {
  if (lens->room == nullptr)
    lens->room = std::make_unique<RoomTargets>(lens->warp.atlas_width_px, lens->warp.atlas_height_px);
  RoomTargets& room = *lens->room;
  glDepthMask(GL_TRUE);
  glEnable(GL_SCISSOR_TEST);
  const auto begin = [](const Pass& pass) {
    const LensFace& face = *pass.face;
    glViewport(face.x_px, face.y_px, face.width_px, face.height_px);
    // The filter of the composite reads some pixels around the content.
    constexpr int kAround = 10;
    const int left = std::max(face.x_px, pass.all.x - kAround),
              low = std::max(face.y_px, pass.all.y - kAround);
    const int right = std::min(face.x_px + face.width_px, pass.all.x + pass.all.width + kAround);
    const int high = std::min(face.y_px + face.height_px, pass.all.y + pass.all.height + kAround);
    glScissor(left, low, right - left, high - low);
  };
  for (const Pass& pass : passes) {
    room.content_depth.BindForDrawing();
    begin(pass);
    glClear(GL_DEPTH_BUFFER_BIT);
    lens->atlas->CopyDepth(pass.all.x, pass.all.y, pass.all.width, pass.all.height, room.content_depth);
    room.content_depth.BindForDrawing();
    begin(pass);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LESS);
    mesh_drawer_.DrawDepth(range.ClipFromMap(pass.view), MeshDrawer::Part::kSeenThrough);
    room.surface_depth.BindForDrawing();
    begin(pass);
    glClear(GL_DEPTH_BUFFER_BIT);
    surface_drawer_.Draw(range.ClipFromMap(pass.view));
  }
  glDisable(GL_DEPTH_TEST);
  for (const Pass& pass : passes) {
    if (!with_shadows) break;
    room.shadow.BindForDrawing();
    begin(pass);
    glClear(GL_COLOR_BUFFER_BIT);
    shadows_.Draw(range.ClipFromMap(pass.view),
                  {pass.face->x_px, pass.face->y_px, pass.face->width_px, pass.face->height_px},
                  room.surface_depth.texture());
  }
  glDisable(GL_SCISSOR_TEST);
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
      instance.seconds = SecondsOf(entity, what);
      SetStanding(entity, &instance);
      (faint ? drawn.faint : drawn.plain).push_back(std::move(instance));
    }
  }
  shapes_.EndFrame();
  return drawn;
}

}  // namespace docent::ui
