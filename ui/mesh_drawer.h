// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "content/model.h"
#include "engine/dense/light_estimate.h"
#include "ui/axes.h"
#include "ui/gl_objects.h"
#include "ui/model_resources.h"

namespace docent::ui {

// A model with its pose in the map and its animation time.
struct ModelInstance {
  std::shared_ptr<const content::Model> model;
  glm::mat4 map_from_model{1.0f};
  int animation = -1;
  double seconds = 0;
  // Whether it casts shadows, and the plane that it stands on: a point and the direction of up in the map.
  bool casts_shadow = false;
  glm::vec3 base{0.0f}, up{0.0f, -1.0f, 0.0f};
  bool turns = false;  // Its pose follows the viewer.
};

// The light on the drawn models; by default that of a bright room, whose direction is not known.
struct ModelLight {
  const engine::LightEstimate* room = nullptr;  // Null where it is not known.
  glm::vec3 exposure{1.0f};  // Of the video, by colour, relative to that for which the light is given.
};

// A pinhole camera with its pose in the map.
struct PinholeView {
  engine::Rigid3 camera_from_map;
  TangentBounds bounds;
};

// Draws model instances with depth into the bound framebuffer: first opaque and masked primitives, then
// blended ones from far to near. The output is sRGB with premultiplied alpha. Single thread, single context.
class MeshDrawer {
 public:
  explicit MeshDrawer(int max_texture_px);

  // Computes the poses of the instances that Draw shows until the next call. Shares ownership of their models
  // until then.
  void Prepare(std::span<const ModelInstance> instances, const glm::vec3& up_in_map);
  // The part of the view that the prepared instances may cover, in texture coordinates (0..1, OpenGL's origin
  // at the bottom left). If it is empty, nothing is visible and drawing can be skipped.
  struct Cover {
    glm::vec2 low{1.0f}, high{0.0f};
    bool empty() const { return low.x >= high.x || low.y >= high.y; }
  };
  Cover Covered(const PinholeView& view) const;
  // The same of a box in the map.
  static Cover CoverOf(const Box& box, const PinholeView& view);
  // The depths between which the prepared instances lie; the nearest is not closer than the precision of a
  // depth buffer allows.
  struct DepthRange {
    double nearest = 1e30, farthest = 0;
    bool empty() const { return farthest <= 0; }
    void Include(double depth, double radius);
    glm::mat4 ClipFromMap(const PinholeView& view) const;
    double near_plane() const;
    double far_plane() const { return 1.01 * farthest; }
  };
  // Adds those that may be visible.
  void AddDepths(const PinholeView& view, DepthRange* range) const;
  // Draws the prepared instances into the current viewport.
  void Draw(const PinholeView& view, const DepthRange& range, const ModelLight& light);

  // An instance that casts a shadow.
  struct Caster {
    Box box;             // In the map.
    glm::vec3 base, up;  // The plane that it stands on.
    // From the unit sphere: the ellipsoid whose axes are those of the box around the model at rest.
    glm::mat4 map_from_sphere{1.0f};
  };
  // Those whose shadow may be visible in one of the views.
  void CastersIn(std::span<const PinholeView> views, std::vector<Caster>* casters) const;
  // Which of the prepared instances DrawDepth draws. Casters move that are animated or follow the viewer.
  enum class Part { kStillCasters, kMovingCasters, kSeenThrough };
  // What the depths of a caster depend on.
  struct CasterPose {
    std::weak_ptr<const content::Model> model;
    glm::mat4 map_from_model{1.0f};
    int animation = -1;
    double seconds = 0;  // 0 without an animation.
    bool operator==(const CasterPose& other) const;
  };
  // Those of all prepared casters that stand still, and of those that move.
  const std::vector<CasterPose>& still_poses() const { return still_poses_; }
  const std::vector<CasterPose>& moving_poses() const { return moving_poses_; }
  // Draws depths alone, from both sides.
  void DrawDepth(const glm::mat4& clip_from_map, Part part) const;
  // The number of models that hold graphics memory.
  std::size_t cached_models() const { return cache_.size(); }

 private:
  struct Item {
    std::shared_ptr<const content::Model> model;
    ModelResources* resources = nullptr;
    const GpuPrimitive* primitive = nullptr;
    const content::Material* material = nullptr;
    glm::mat4 map_from_mesh{1.0f};
    int first_joint = -1;
    bool mirrors = false;    // Whether the vertices are placed by a reflection.
    Box box;                 // In the map.
    glm::vec3 center{0.0f};  // Centre of the box's bounding sphere.
    float radius = 0;
    std::optional<Part> casting;  // As which part it casts shadows, if it does.
  };

  void AddInstance(const ModelInstance& instance);
  void AddNode(const ModelInstance& instance, const std::vector<glm::mat4>& nodes, int node_index);
  // The index in joints_ of the first joint of a skin of the instance that is being added; all its meshes
  // with that skin share them. -1 where there is no room for them.
  int FirstJoint(const ModelInstance& instance, const std::vector<glm::mat4>& nodes, int skin_index);
  int AddJoints(const ModelInstance& instance, const std::vector<glm::mat4>& nodes, int skin_index);
  void SetScene(const PinholeView& view, const glm::mat4& clip_from_map, const ModelLight& light);
  void SetLight(const ModelLight& light);
  void DrawItem(const Item& item);
  void SetMaterial(const Item& item);
  void SetTexture(const Item& item, int unit, const content::TextureUse& use);

  ModelCache cache_;
  GlProgram program_, depth_program_;
  GlTexture white_;
  GlBuffer joint_buffer_;
  GlTexture joint_texture_;
  std::vector<glm::mat4> joints_;
  std::vector<int> first_joints_;  // Of the instance that is being added, by skin; see FirstJoint.
  std::vector<Item> items_;
  std::vector<Caster> casters_;  // Of the prepared instances.
  std::vector<CasterPose> still_poses_, moving_poses_;
  glm::vec3 up_in_map_{0.0f, -1.0f, 0.0f};
};

}  // namespace docent::ui
