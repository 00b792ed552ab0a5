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

// Draws the surfaces that hide content into the bound depth buffer. Meshes stay
// on the graphics card while they are drawn. Single thread, single context.
class SurfaceDrawer {
 public:
  SurfaceDrawer();

  // Selects the surfaces of this frame.
  void Prepare(const HidingSurfaces::Surfaces& surfaces);
  bool empty() const { return measured_ == nullptr && placed_ == nullptr; }
  // Draws the depths of the selected surfaces. They are not cut off at the near plane, because they hide
  // content however near they are.
  void Draw(const glm::mat4& clip_from_map) const;

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
