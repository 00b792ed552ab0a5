// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "engine/dense/light_estimate.h"
#include "ui/gl_objects.h"
#include "ui/mesh_drawer.h"

namespace docent::ui {

// The shadows that content casts on the room: one from the main light, where it is known, the contact shadow
// on the surface that the content stands on, and ambient occlusion by its body, which take light from
// all sides away. They fall on the surfaces of the map; where none is known, on the plane that each model
// stands on. Single thread, single context. The depths of casters that stand still are kept from view to
// view.
class RoomShadows {
 public:
  RoomShadows();

  // Computes the shadows of the casters that may be seen in one of these views, until the next call. `light`:
  // null where it is not known.
  void Prepare(const MeshDrawer& meshes, std::span<const PinholeView> views,
               const engine::LightEstimate* light);
  bool empty() const { return casters_.empty(); }
  // A box in the map around everything that the shadows may darken.
  const Box& reach() const { return reach_; }
  // Draws how much of the light of each pixel is taken away (0 none, 1 all) into the red channel of the
  // current viewport, whose surfaces have these depths.
  void Draw(const glm::mat4& clip_from_map, const glm::ivec4& viewport, GLuint surface_depth) const;

 private:
  // A square image of depths along a direction, around the casters.
  struct DepthImage {
    explicit DepthImage(int side_px) : still(side_px, side_px), all(side_px, side_px) {}
    DepthTarget still, all;  // `all` is drawn only while casters move.
    glm::mat4 clip_from_map{0.0f};
    // What was drawn; the moving ones are empty while `all` holds nothing of use.
    std::vector<MeshDrawer::CasterPose> still_poses, moving_poses;
    GLuint texture() const { return moving_poses.empty() ? still.texture() : all.texture(); }
  };
  // Draws what has changed.
  void DrawCasters(const MeshDrawer& meshes, const glm::vec3& along, DepthImage* image) const;
  // Chooses the sphere that the depths are drawn for.
  void Frame(const glm::vec3& middle, float radius);
  void SetBodies(const GlProgram& program) const;
  void SetUniforms(const GlProgram& program, const glm::mat4& clip_from_map, GLuint surface_depth) const;

  GlProgram surface_program_, plane_program_;
  GlVertexArray empty_vertex_array_;
  DepthImage main_, contact_;
  std::vector<MeshDrawer::Caster> casters_;
  Box reach_;
  glm::vec3 middle_{0.0f}, up_{0.0f, -1.0f, 0.0f}, to_light_{0.0f};
  float radius_ = 0, contact_reach_ = 0, main_strength_ = 0;
};

}  // namespace docent::ui
