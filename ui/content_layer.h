// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "content/scene.h"
#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"
#include "ui/entity_shapes.h"
#include "ui/gl_objects.h"
#include "ui/hiding_surfaces.h"
#include "ui/image_degradation.h"
#include "ui/lens_warp.h"
#include "ui/mesh_drawer.h"
#include "ui/room_shadows.h"
#include "ui/surface_drawer.h"

namespace docent::ui {

// Draws a scene over an image as the camera's lens distorts it. The scene is first rendered undistorted, with
// depth and multisampling, into the faces of a LensWarp; then each image pixel fetches its colour through the
// warp's lookup table. Expensive resources (lens tables, models on the graphics card, signpost textures) are
// cached between calls. Single thread, single context.
class ContentLayer {
 public:
  // `language`: that of the reader (see EntityShapes).
  ContentLayer(int samples, int max_texture_px, const std::string& language);
  ~ContentLayer();

  // What is drawn of a scene, and how.
  struct What {
    double animation_seconds = 0;
    const std::map<std::string, double>* animation_starts = nullptr;  // See View.
    bool markers = false;                                             // Where sounds and occluders are.
    std::span<const std::string> faint =
        {};  // Hidden entities that are drawn all the same, faintly, by name.
    std::shared_ptr<const engine::SurfaceMesh> surfaces =
        {};                 // Content behind them is hidden; null: none is.
    bool occluders = true;  // Content behind those of the scene is hidden.
    ModelLight light = {};  // On models.
    bool shadows = true;    // Models and signposts cast them on the room.
    GLuint video = 0;       // The image that is drawn over, as a texture of any size; 0: none.
    ImageDegradation degradation = {};
    double camera_pixel = 1;  // The size of a pixel of the camera in the image, in pixels.
  };
  // Composites the scene over the contents of `image`, an image target of the camera's size whose row 0 is
  // the top. Pixels that no content covers keep their exact values. Labels are not drawn (see label_board.h).
  void Draw(const engine::CameraModel& camera, const engine::Rigid3& camera_from_map,
            const content::Scene& scene, const What& what, const RenderTarget& image);
  // From the next Draw on.
  void SetSamples(int samples);
  std::size_t cached_models() const { return mesh_drawer_.cached_models(); }

 private:
  // Of the size of an atlas.
  struct RoomTargets {
    RoomTargets(int width_px, int height_px)
        : content_depth(width_px, height_px),
          surface_depth(width_px, height_px),
          shadow(width_px, height_px, 1, false) {}
    DepthTarget content_depth, surface_depth;
    RenderTarget shadow;
  };
  struct Lens {
    engine::CameraModel camera;
    LensWarp warp;  // Its lookup table was moved to the texture `lookup`.
    GlTexture lookup;
    std::unique_ptr<RenderTarget> atlas;
    std::vector<PixelRectangle> drawn;  // Rectangles of the atlas that are not transparent.
    std::unique_ptr<RoomTargets> room;  // Null until it is needed.
  };
  // A face of the lens with what is drawn into it.
  struct Pass {
    const LensFace* face;
    PinholeView view;
    PixelRectangle content, all;  // The content; the same with its shadows. In the atlas.
  };
  // The prepared content in the faces that it or its shadows may be seen in.
  std::vector<Pass> PassesOf(const engine::Rigid3& camera_from_map, bool with_shadows,
                             const Lens& lens) const;
  // Draw the prepared content, and what hides it and where its shadows fall, into the lens's targets.
  void DrawAtlas(const std::vector<Pass>& passes, const MeshDrawer::DepthRange& range,
                 const ModelLight& light, Lens* lens);
  void DrawRoom(const std::vector<Pass>& passes, const MeshDrawer::DepthRange& range, bool with_shadows,
                Lens* lens);
  Lens& FindLens(const engine::CameraModel& camera);
  struct Drawn {
    std::vector<ModelInstance> plain, faint;
  };
  Drawn Instances(const content::Scene& scene, const Eigen::Vector3d& eye_in_map, const What& what);
  // `opacity` below 1 is for what only an author sees, which casts no shadows.
  void Composite(const engine::CameraModel& camera, const engine::Rigid3& camera_from_map,
                 const std::vector<ModelInstance>& instances, double opacity, const What& what,
                 const RenderTarget& image);
  void BindForComposite(const Lens& lens, const MeshDrawer::DepthRange& range, double opacity,
                        bool with_shadows, const What& what);

  int samples_;
  MeshDrawer mesh_drawer_;
  HidingSurfaces hiding_surfaces_;
  SurfaceDrawer surface_drawer_;
  RoomShadows shadows_;
  GlProgram warp_program_, room_warp_program_;
  GlVertexArray empty_vertex_array_;
  std::vector<std::unique_ptr<Lens>> lenses_;  // Ordered by use, the most recently used last.
  EntityShapes shapes_;
};

}  // namespace docent::ui
