// SPDX-License-Identifier: Apache-2.0
#include "ui/surface_drawer.h"

#include <utility>

#include "ui/shaders.h"

namespace docent::ui {
namespace {

// A visitor who goes back and forth between two maps has both on the graphics card.
constexpr std::uint64_t kSurfaceLifeFrames = 300;

}  // namespace

SurfaceDrawer::SurfaceDrawer() : program_("surface", kSurfaceVertexShader, kSurfaceFragmentShader) {}

const SurfaceDrawer::Resources* SurfaceDrawer::Select(
    const std::shared_ptr<const engine::SurfaceMesh>& mesh) {
  if (mesh == nullptr || mesh->empty()) return nullptr;
  Resources& resources = cache_[mesh.get()];
  if (resources.mesh == nullptr) {
    resources.mesh = mesh;
    Upload(&resources);
  }
  resources.last_frame = frame_;
  return &resources;
}

void SurfaceDrawer::Prepare(const HidingSurfaces::Surfaces& surfaces) {
  ++frame_;
  measured_ = Select(surfaces.measured);
  placed_ = Select(surfaces.placed);
  // What only the cache still holds, as while an author drags an occluder, does not come back.
  std::erase_if(cache_, [&](const auto& entry) {
    const bool is_held = entry.second.mesh.use_count() > 1;
    return entry.second.last_frame < frame_ &&
           (!is_held || entry.second.last_frame + kSurfaceLifeFrames < frame_);
  });
}

void SurfaceDrawer::Upload(Resources* resources) {
  const engine::SurfaceMesh& mesh = *resources->mesh;
  static_assert(sizeof(Eigen::Vector3f) == 3 * sizeof(float));
  glBindVertexArray(resources->vertex_array.name());
  glBindBuffer(GL_ARRAY_BUFFER, resources->vertices.name());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(mesh.vertices.size() * sizeof(Eigen::Vector3f)),
               mesh.vertices.data(), GL_STATIC_DRAW);
  glEnableVertexAttribArray(0);
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(Eigen::Vector3f), nullptr);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, resources->triangles.name());
  glBufferData(GL_ELEMENT_ARRAY_BUFFER,
               static_cast<GLsizeiptr>(mesh.triangles.size() * sizeof(mesh.triangles[0])),
               mesh.triangles.data(), GL_STATIC_DRAW);
  glBindVertexArray(0);
}

void SurfaceDrawer::Draw(const glm::mat4& clip_from_map) const {
  if (empty()) return;
  program_.Use();
  glUniformMatrix4fv(program_.Uniform("clip_from_map"), 1, GL_FALSE, &clip_from_map[0][0]);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LEQUAL);
  glDepthMask(GL_TRUE);
  glDisable(GL_BLEND);
  glDisable(GL_CULL_FACE);
  glEnable(GL_DEPTH_CLAMP);
  for (const Resources* const surfaces : {measured_, placed_}) {
    if (surfaces == nullptr) continue;
    glBindVertexArray(surfaces->vertex_array.name());
    glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(3 * surfaces->mesh->triangles.size()), GL_UNSIGNED_INT,
                   nullptr);
  }
  glBindVertexArray(0);
  glDisable(GL_DEPTH_CLAMP);
  glDisable(GL_DEPTH_TEST);
}

}  // namespace docent::ui
