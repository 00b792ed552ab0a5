// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "content/scene.h"
#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"
#include "ui/gl_objects.h"
#include "ui/lens_warp.h"
#include "ui/mesh_drawer.h"

namespace docent::ui {

// Draws a scene through a camera's own lens over an image: undistorted with depth and multisampling into the
// faces of a LensWarp, then pixel by pixel through its lookup. Keeps what is dear to make (lens tables,
// models on the graphics card, lettered signposts) from one call to the next. One thread, one context.
class ContentLayer {
 public:
  ContentLayer(int samples, int max_texture_px);
  ~ContentLayer();

  // Composites over what `image` (an image target of the camera's size: row 0 is the top) holds. Pixels
  // that no content covers keep their exact values.
  void Draw(const engine::CameraModel& camera, const engine::Rigid3& camera_from_map,
            const content::Scene& scene, double animation_seconds, const RenderTarget& image);
  std::size_t cached_models() const { return mesh_drawer_.cached_models(); }

 private:
  struct Lens {
    engine::CameraModel camera;
    LensWarp warp;  // its lookup has moved to the texture
    GlTexture lookup;
    std::unique_ptr<RenderTarget> atlas;
    std::vector<PixelRectangle> drawn;  // parts of the atlas that are not transparent
  };
  struct Sign {
    std::shared_ptr<const content::Model> model;
    std::uint64_t last_frame = 0;
  };
  // Draws the prepared content into the lens's atlas; what of the image it may cover.
  PixelRectangle DrawAtlas(const engine::Rigid3& camera_from_map, Lens* lens);
  Lens& FindLens(const engine::CameraModel& camera);
  std::vector<ModelInstance> Instances(const content::Scene& scene, const Eigen::Vector3d& eye_in_map,
                                       double animation_seconds);

  int samples_;
  MeshDrawer mesh_drawer_;
  GlProgram warp_program_;
  GlVertexArray empty_vertex_array_;
  std::vector<std::unique_ptr<Lens>> lenses_;                  // the last used one comes last
  std::map<std::pair<std::string, std::string>, Sign> signs_;  // by text and target map
  std::uint64_t frame_ = 0;
};

}  // namespace docent::ui
