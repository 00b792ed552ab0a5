// SPDX-License-Identifier: Apache-2.0
#include "ui/room_shadows.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "ui/axes.h"
#include "ui/room_shaders.h"
#include "ui/shaders.h"

namespace docent::ui {
namespace {

// A caster that fills the view is seen with about this many pixels; a shadow is softer than its caster.
constexpr int kMainSide_px = 512, kContactSide_px = 256;
// How far from the ground a caster takes light away from it, relative to the caster's size. At a distance of
// a seventh of its size, a disk covers less than a twentieth of the sky seen from beside its rim.
constexpr float kContactReach = 0.15f;
// The longest shadow, relative to the height of its caster: that of a light 18 degrees above the ground.
constexpr float kLongestShadow = 3.0f;
// Of more casters than this, the farther ones from the eye have no ambient occlusion. The shader has
// as many.
constexpr int kMostBodies = 16;
// How far that shadow reaches from the middle of its caster, in halves of its size; as kBodyReach2 of the
// shader.
constexpr float kBodyReach = 2.0f;
// The sphere of the casters is this much larger than they need, and stays until it is too small or larger by
// kLargestSphere than they need: casters that turn with the viewer would change it with every view.
constexpr float kSphere = 1.1f, kLargestSphere = 1.4f;

glm::vec3 AnyAcross(const glm::vec3& direction) {
  const glm::vec3 axis = std::abs(direction.x) < 0.6f ? glm::vec3(1, 0, 0) : glm::vec3(0, 1, 0);
  return glm::normalize(glm::cross(direction, axis));
}

// An orthographic view along a unit direction of a sphere, whose depth is 0 on its near side and 1 on its far
// side.
glm::mat4 ClipOfSphere(const glm::vec3& middle, float radius, const glm::vec3& along) {
  const glm::vec3 right = AnyAcross(along), above = glm::cross(right, along);
  glm::mat4 clip(0.0f);
  for (int i = 0; i < 3; ++i) {
    clip[i][0] = right[i] / radius;
    clip[i][1] = above[i] / radius;
    clip[i][2] = along[i] / radius;
  }
  clip[3] = glm::vec4(-glm::dot(right, middle) / radius, -glm::dot(above, middle) / radius,
                      -glm::dot(along, middle) / radius, 1.0f);
  return clip;
}

}  // namespace

RoomShadows::RoomShadows()
    : surface_program_("shadow on surfaces", kFullScreenVertexShader, ShadowOnSurfacesShader().c_str()),
      plane_program_("shadow on a plane", kPlaneVertexShader, ShadowOnPlaneShader().c_str()),
      main_(kMainSide_px),
      contact_(kContactSide_px) {
  for (const GlProgram* const program : {&surface_program_, &plane_program_})
    program->AssignTextureUnits({"surface_depth", "main_depth", "contact_depth"});
}

void RoomShadows::Prepare(const MeshDrawer& meshes, std::span<const PinholeView> views,
                          const engine::LightEstimate* light) {
  meshes.CastersIn(views, &casters_);
  if (casters_.empty()) return;
  if (casters_.size() > kMostBodies) {
    const glm::vec3 eye = GlmFrom(views.front().camera_from_map.OriginInSource());
    const auto distance = [&](const MeshDrawer::Caster& caster) {
      return glm::distance(eye, glm::vec3(caster.map_from_sphere[3]));
    };
    std::nth_element(casters_.begin(), casters_.begin() + kMostBodies, casters_.end(),
                     [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
  }
  Box all;
  glm::vec3 up(0.0f);
  float size = 0;
  for (const MeshDrawer::Caster& caster : casters_) {
    all.Include(caster.box.low);
    all.Include(caster.box.high);
    up += caster.up;
    size += glm::length(caster.box.high - caster.box.low) / static_cast<float>(casters_.size());
  }
  up_ = glm::dot(up, up) > 1e-6f ? glm::normalize(up) : casters_.front().up;
  contact_reach_ = kContactReach * size;
  Frame(0.5f * (all.low + all.high), 0.5f * glm::length(all.high - all.low) + contact_reach_);
  main_strength_ = 0;
  if (light != nullptr) {
    to_light_ = GlmFrom(light->to_light);
    const float slope = glm::dot(up_, to_light_);
    const auto all_light = static_cast<float>(light->BrightnessOf(Eigen::Vector3d(up_.x, up_.y, up_.z)));
    if (slope > 0 && all_light > 0)
      main_strength_ = std::clamp(static_cast<float>(light->direct) * slope / all_light, 0.0f, 1.0f);
  }
  reach_ = {};
  for (const MeshDrawer::Caster& caster : casters_) {
    for (int i = 0; i < 8; ++i) {
      const glm::vec3 corner = caster.box.Corner(i);
      reach_.Include(corner - glm::vec3(contact_reach_));
      reach_.Include(corner + glm::vec3(contact_reach_));
      const glm::vec3 from_middle = corner - 0.5f * (caster.box.low + caster.box.high);
      reach_.Include(corner +
                     (kBodyReach - 1.0f) * (from_middle - caster.up * glm::dot(caster.up, from_middle)));
      if (main_strength_ == 0) continue;
      const float height = std::max(0.0f, glm::dot(corner - caster.base, up_));
      const float slope = std::max(glm::dot(to_light_, up_), 1.0f / kLongestShadow);
      reach_.Include(corner - to_light_ * (height / slope));
    }
  }
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glDepthMask(GL_TRUE);
  glDisable(GL_CULL_FACE);
  DrawCasters(meshes, up_, &contact_);
  if (main_strength_ > 0) DrawCasters(meshes, -to_light_, &main_);
  glDisable(GL_DEPTH_TEST);
}

void RoomShadows::Frame(const glm::vec3& middle, float radius) {
  const bool fits = glm::length(middle - middle_) + radius <= radius_;
  if (fits && radius_ <= kLargestSphere * radius) return;
  middle_ = middle;
  radius_ = kSphere * radius;
}

void RoomShadows::DrawCasters(const MeshDrawer& meshes, const glm::vec3& along, DepthImage* image) const {
  using Part = MeshDrawer::Part;
  const glm::mat4 clip_from_map = ClipOfSphere(middle_, radius_, along);
  const bool still_changed =
      clip_from_map != image->clip_from_map || meshes.still_poses() != image->still_poses;
  image->clip_from_map = clip_from_map;
  if (still_changed) {
    image->still_poses = meshes.still_poses();
    image->still.BindForDrawing();
    glClear(GL_DEPTH_BUFFER_BIT);
    meshes.DrawDepth(clip_from_map, Part::kStillCasters);
  }
  if (!still_changed && meshes.moving_poses() == image->moving_poses) return;
  image->moving_poses = meshes.moving_poses();
  if (image->moving_poses.empty()) return;
  image->still.CopyTo(image->all);
  image->all.BindForDrawing();
  meshes.DrawDepth(clip_from_map, Part::kMovingCasters);
}

void RoomShadows::SetBodies(const GlProgram& program) const {
  const int count = std::min(static_cast<int>(casters_.size()), kMostBodies);
  std::array<glm::mat4, kMostBodies> sphere_from_map;
  std::array<glm::vec3, kMostBodies> middles, ups;
  for (int i = 0; i < count; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const MeshDrawer::Caster& caster = casters_[k];
    sphere_from_map[k] = glm::inverse(caster.map_from_sphere);
    middles[k] = glm::vec3(caster.map_from_sphere[3]);
    ups[k] = caster.up;
  }
  glUniform1i(program.Uniform("body_count"), count);
  glUniformMatrix4fv(program.Uniform("sphere_from_map"), count, GL_FALSE, &sphere_from_map[0][0][0]);
  glUniform3fv(program.Uniform("body_middle"), count, &middles[0][0]);
  glUniform3fv(program.Uniform("body_up"), count, &ups[0][0]);
}

void RoomShadows::SetUniforms(const GlProgram& program, const glm::mat4& clip_from_map,
                              GLuint surface_depth) const {
  program.Use();
  const auto set_matrix = [&](const char* name, const glm::mat4& m) {
    glUniformMatrix4fv(program.Uniform(name), 1, GL_FALSE, &m[0][0]);
  };
  set_matrix("clip_from_map", clip_from_map);
  set_matrix("map_from_clip", glm::inverse(clip_from_map));
  SetBodies(program);
  set_matrix("main_from_map", main_.clip_from_map);
  set_matrix("contact_from_map", contact_.clip_from_map);
  glUniform1f(program.Uniform("main_strength"), main_strength_);
  glUniform1f(program.Uniform("contact_reach"), contact_reach_ / (2.0f * radius_));
  const GLuint textures[] = {surface_depth, main_.texture(), contact_.texture()};
  for (int unit = 0; unit < 3; ++unit) {
    glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
    glBindTexture(GL_TEXTURE_2D, textures[unit]);
  }
}

void RoomShadows::Draw(const glm::mat4& clip_from_map, const glm::ivec4& viewport,
                       GLuint surface_depth) const {
  glEnable(GL_BLEND);
  glBlendEquation(GL_MAX);
  glBindVertexArray(empty_vertex_array_.name());
  SetUniforms(surface_program_, clip_from_map, surface_depth);
  glUniform4iv(surface_program_.Uniform("viewport"), 1, &viewport[0]);
  DrawFullScreenTriangle();
  SetUniforms(plane_program_, clip_from_map, surface_depth);
  for (const MeshDrawer::Caster& caster : casters_) {
    const glm::vec3 right = AnyAcross(caster.up);
    const float side =
        glm::length(caster.box.high - caster.box.low) * (main_strength_ > 0 ? 0.5f + kLongestShadow : 1.0f) +
        contact_reach_;
    const glm::vec3 half_u = side * right, half_v = side * glm::cross(caster.up, right);
    glUniform3fv(plane_program_.Uniform("middle"), 1, &caster.base[0]);
    glUniform3fv(plane_program_.Uniform("half_u"), 1, &half_u[0]);
    glUniform3fv(plane_program_.Uniform("half_v"), 1, &half_v[0]);
    glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
  }
  glBlendEquation(GL_FUNC_ADD);
  glDisable(GL_BLEND);
  glBindVertexArray(0);
}

}  // namespace docent::ui
