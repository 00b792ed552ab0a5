// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <map>
#include <memory>

#include "engine/dense/surface_mesh.h"
#include "ui/gl_objects.h"
#include "ui/hiding_surfaces.h"

namespace docent::ui {

// Draws the surfaces of a map into the depth buffer alone, so that they hide content behind them. Meshes stay
// on the graphics card while they are drawn. Single thread, single context.
class SurfaceDrawer {
 public:
  // Surfaces are drawn this much farther from the camera than they are, relative to their distance, because
  // content stands on them: nine tenths of the depths that maps measure are off by less
  // (docs/decisions/dense-surfaces.md).
  static constexpr float kDepthBias = 0.02F;

  SurfaceDrawer();

  // The same for what authors placed, which is exact but for rounding.
  static constexpr float kPlacedDepthBias = 0.002F;

  // Selects the surfaces of this frame.
  void Prepare(const HidingSurfaces::Surfaces& surfaces);
  // Draws the selected surfaces. They hide content however near they are, because they are not cut off at the
  // near plane.
  void Draw(const glm::mat4& clip_from_map, const glm::vec3& eye_in_map) const;

 private:
  struct Resources {
    std::shared_ptr<const engine::SurfaceMesh> mesh;  // Keeps the address, which is the key, in use.
    GlVertexArray vertex_array;
    GlBuffer vertices, triangles;
    std::uint64_t last_frame = 0;
  };
  const Resources* Select(const std::shared_ptr<const engine::SurfaceMesh>& mesh);
  static void Upload(Resources* resources);

  GlProgram program_;
  std::map<const engine::SurfaceMesh*, Resources> cache_;
  const Resources *measured_ = nullptr, *placed_ = nullptr;  // Null for none.
  std::uint64_t frame_ = 0;
};

}  // namespace docent::ui
