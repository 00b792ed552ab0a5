// SPDX-License-Identifier: Apache-2.0
#include "ui/mesh_drawer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>

#include "ui/shaders.h"

namespace docent::ui {
namespace {

// The illumination of a bright room. It is scaled so that a white diffuse surface that faces the light is
// slightly darker than white.
constexpr glm::vec3 kLightRadiance(2.1f, 2.03f, 1.9f);
constexpr glm::vec3 kSkyRadiance(0.46f, 0.48f, 0.52f);
constexpr glm::vec3 kFloorRadiance(0.2f, 0.18f, 0.16f);
// The largest ratio of the far plane's depth to the near plane's depth.
constexpr double kMaxDepthRatio = 20000.0;
// For all skins in view together. Skins beyond this limit keep their bind pose.
constexpr int kMaxJoints = 16384;
constexpr int kNotAdded = -2;  // Of a skin of the instance, instead of its first joint.

const content::Material& DefaultMaterial() {
  static const content::Material kMaterial;
  return kMaterial;
}

// Whether what is behind the surface is seen through it. Unlit materials transmit nothing (§ Limitations of
// KHR_materials_unlit).
bool IsSeenThrough(const content::Material& material) {
  return material.alpha == content::Material::Alpha::kBlend || (material.transmission > 0 && !material.unlit);
}

struct TextureSlot {
  const char* sampler;
  const char* used;
  const char* uv_set;
  const char* uv_transform;
  bool is_color;
};
constexpr std::array<TextureSlot, 6> kSlots = {{
    {"base_color_map", "base_color_use.used", "base_color_use.uv_set", "base_color_use.uv_transform", true},
    {"metallic_roughness_map", "metallic_roughness_use.used", "metallic_roughness_use.uv_set",
     "metallic_roughness_use.uv_transform", false},
    {"normal_map", "normal_use.used", "normal_use.uv_set", "normal_use.uv_transform", false},
    {"occlusion_map", "occlusion_use.used", "occlusion_use.uv_set", "occlusion_use.uv_transform", false},
    {"emissive_map", "emissive_use.used", "emissive_use.uv_set", "emissive_use.uv_transform", true},
    {"transmission_map", "transmission_use.used", "transmission_use.uv_set", "transmission_use.uv_transform",
     false},
}};
constexpr int kJointUnit = static_cast<int>(kSlots.size());

// The light comes from above, from the side of the map's first camera and slightly from its right, so that it
// lights the side of the content that a person there sees.
glm::vec3 DirectionToLight(const glm::vec3& up) {
  const glm::vec3 towards_viewer = glm::vec3(0.45f, 0.0f, -0.75f);
  const glm::vec3 level = towards_viewer - up * glm::dot(up, towards_viewer);
  return glm::normalize(up + level);
}

// What a light from one direction adds to the brightness of surfaces by their normal, 1 where they face it:
// the harmonics of max(0, cosine) up to order 2, which the shader takes away again where it wants other light
// only.
Eigen::Matrix<double, 9, 1> LightOfOneDirection(const Eigen::Vector3d& to_light) {
  constexpr double kMean = 0.25, kFirst = 0.5, kSecond = 0.15625;
  const double x = to_light.x(), y = to_light.y(), z = to_light.z();
  Eigen::Matrix<double, 9, 1> brightness;
  brightness << kMean, kFirst * y, kFirst * z, kFirst * x, kSecond * 6 * x * y, kSecond * 6 * y * z,
      kSecond * 0.5 * (3 * z * z - 1), kSecond * 6 * x * z, kSecond * 1.5 * (x * x - y * y);
  return brightness;
}

// The light of a room whose main direction is not known, with a part of it from a fixed direction: in light
// from all sides alone, shapes can hardly be seen. The mean stays, and surfaces that face up are about as
// bright as before. Both constants were chosen by eye, on a bust in a kitchen.
engine::LightEstimate WithFixedDirection(engine::LightEstimate room, const Eigen::Vector3d& to_light) {
  constexpr double kDirect = 0.35;    // of the mean
  constexpr double kGradient = 0.35;  // what is left of the gradient of the light from all sides
  room.to_light = to_light;
  room.direct = kDirect * room.brightness[0];
  room.brightness[0] *= 1 - kDirect / 4;
  room.brightness.tail<8>() *= kGradient;
  room.brightness += room.direct * LightOfOneDirection(to_light);
  return room;
}

void Extend(const Box& box, const glm::mat4& transform, Box* result) {
  if (box.empty()) return;
  for (int i = 0; i < 8; ++i) result->Include(glm::vec3(transform * glm::vec4(box.Corner(i), 1.0f)));
}

// The ellipsoid about as large as a model, which is a little thick even where the model is flat.
glm::mat4 ModelFromSphere(const content::Model& model) {
  constexpr float kThinnest = 0.1f;  // Relative to the longest axis.
  const glm::vec3 half = 0.5f * (model.bounds_max - model.bounds_min);
  const float longest = std::max({half.x, half.y, half.z, 1e-6f});
  glm::mat4 transform(1.0f);
  for (int i = 0; i < 3; ++i) transform[i][i] = std::max(half[i], kThinnest * longest);
  transform[3] = glm::vec4(0.5f * (model.bounds_min + model.bounds_max), 1.0f);
  return transform;
}

// Whether a sphere in the map may be visible in a view: it is not behind the camera and not outside a side of
// the frustum.
bool IsVisible(const glm::vec3& center, float radius, const TangentBounds& bounds,
               const glm::mat4& eye_from_map) {
  const glm::vec3 eye(eye_from_map * glm::vec4(center, 1.0f));
  const double x = eye.x, y = -eye.y, z = -eye.z;
  const auto beyond = [&](double across, double tangent, double sign) {
    return sign * (across - tangent * z) > radius * std::sqrt(1.0 + tangent * tangent);
  };
  return z + radius > 0 && !beyond(x, bounds.right, 1) && !beyond(x, bounds.left, -1) &&
         !beyond(y, bounds.bottom, 1) && !beyond(y, bounds.top, -1);
}

}  // namespace

MeshDrawer::MeshDrawer(int max_texture_px)
    : cache_(max_texture_px),
      program_("mesh", kMeshVertexShader, kMeshFragmentShader),
      depth_program_("mesh depth", kMeshVertexShader, kSurfaceFragmentShader) {
  depth_program_.Use();
  glUniform1i(depth_program_.Uniform("joint_columns"), kJointUnit);
  program_.AssignTextureUnits({kSlots[0].sampler, kSlots[1].sampler, kSlots[2].sampler, kSlots[3].sampler,
                               kSlots[4].sampler, kSlots[5].sampler, "joint_columns"});
  const std::uint32_t white = 0xFFFFFFFFu;
  white_ = MakeTexture(1, 1, GL_RGBA, &white, false);
}

void MeshDrawer::Prepare(std::span<const ModelInstance> instances, const glm::vec3& up_in_map) {
  up_in_map_ = up_in_map;
  items_.clear();
  joints_.clear();
  casters_.clear();
  still_poses_.clear();
  moving_poses_.clear();
  cache_.Sweep();
  for (const ModelInstance& instance : instances) AddInstance(instance);
  if (joints_.empty()) joints_.emplace_back(1.0f);  // A sampler needs a non-empty buffer.
  glBindBuffer(GL_TEXTURE_BUFFER, joint_buffer_.name());
  glBufferData(GL_TEXTURE_BUFFER, static_cast<GLsizeiptr>(joints_.size() * sizeof(glm::mat4)), joints_.data(),
               GL_STREAM_DRAW);
  glBindTexture(GL_TEXTURE_BUFFER, joint_texture_.name());
  glTexBuffer(GL_TEXTURE_BUFFER, GL_RGBA32F, joint_buffer_.name());
}

void MeshDrawer::AddInstance(const ModelInstance& instance) {
  if (instance.model == nullptr) return;
  const content::Model& model = *instance.model;
  const int animation =
      instance.animation < static_cast<int>(model.animations.size()) ? std::max(instance.animation, -1) : -1;
  const std::vector<glm::mat4> nodes = content::NodeMatrices(model, animation, instance.seconds);
  std::vector<int> open(model.roots.begin(), model.roots.end());
  const std::size_t first_item = items_.size();
  first_joints_.assign(model.skins.size(), kNotAdded);
  while (!open.empty()) {
    const int node = open.back();
    open.pop_back();
    open.insert(open.end(), model.nodes[node].children.begin(), model.nodes[node].children.end());
    if (model.nodes[node].mesh >= 0) AddNode(instance, nodes, node);
  }
  if (!instance.casts_shadow || items_.size() == first_item) return;
  const bool moves = instance.turns || animation >= 0;
  (moves ? moving_poses_ : still_poses_)
      .push_back({instance.model, instance.map_from_model, animation, animation >= 0 ? instance.seconds : 0});
  Caster caster{{}, instance.base, instance.up, instance.map_from_model * ModelFromSphere(model)};
  for (std::size_t i = first_item; i < items_.size(); ++i) {
    items_[i].casting = moves ? Part::kMovingCasters : Part::kStillCasters;
    caster.box.Include(items_[i].box.low);
    caster.box.Include(items_[i].box.high);
  }
  casters_.push_back(caster);
}

void MeshDrawer::AddNode(const ModelInstance& instance, const std::vector<glm::mat4>& nodes, int node_index) {
  const content::Model& model = *instance.model;
  const content::Node& node = model.nodes[node_index];
  ModelResources& resources = cache_.Get(instance.model);
  const int first_joint = node.skin >= 0 ? FirstJoint(instance, nodes, node.skin) : -1;
  for (const GpuPrimitive& primitive : resources.primitives(node.mesh)) {
    if (primitive.index_count == 0) continue;
    Item item;
    item.model = instance.model;
    item.resources = &resources;
    item.primitive = &primitive;
    item.material = primitive.material >= 0 ? &model.materials[primitive.material] : &DefaultMaterial();
    const bool skinned = first_joint >= 0 && !primitive.joint_boxes.empty();
    item.first_joint = skinned ? first_joint : -1;
    // glTF 2.0 §3.7.3.3: a skinned mesh's own node does not move it.
    item.map_from_mesh = skinned ? instance.map_from_model : instance.map_from_model * nodes[node_index];
    Box box;
    glm::mat4 map_from_vertex = item.map_from_mesh;
    if (skinned) {
      const std::size_t joint_count =
          std::min(primitive.joint_boxes.size(), model.skins[node.skin].joints.size());
      bool is_first = true;
      for (std::size_t i = 0; i < joint_count; ++i) {
        if (primitive.joint_boxes[i].empty()) continue;
        const glm::mat4 map_from_bind = item.map_from_mesh * joints_[first_joint + i];
        // A mirrored root mirrors all joints, so the first one that moves vertices tells.
        if (std::exchange(is_first, false)) map_from_vertex = map_from_bind;
        Extend(primitive.joint_boxes[i], map_from_bind, &box);
      }
    } else {
      Extend(primitive.box, item.map_from_mesh, &box);
    }
    item.mirrors = glm::determinant(glm::mat3(map_from_vertex)) < 0.0f;
    item.box = box;
    item.center = 0.5f * (box.low + box.high);
    item.radius = 0.5f * glm::length(box.high - box.low);
    // An instance whose pose is not finite is left out, because it would make the depth range invalid.
    if (std::isfinite(item.radius) && std::isfinite(glm::dot(item.center, item.center)))
      items_.push_back(std::move(item));
  }
}

int MeshDrawer::FirstJoint(const ModelInstance& instance, const std::vector<glm::mat4>& nodes,
                           int skin_index) {
  int& first = first_joints_[skin_index];
  if (first == kNotAdded) first = AddJoints(instance, nodes, skin_index);
  return first;
}

int MeshDrawer::AddJoints(const ModelInstance& instance, const std::vector<glm::mat4>& nodes,
                          int skin_index) {
  const content::Skin& skin = instance.model->skins[skin_index];
  if (joints_.size() + skin.joints.size() > kMaxJoints) return -1;
  const int first = static_cast<int>(joints_.size());
  for (std::size_t i = 0; i < skin.joints.size(); ++i)
    joints_.push_back(nodes[skin.joints[i]] *
                      (i < skin.inverse_bind.size() ? skin.inverse_bind[i] : glm::mat4(1.0f)));
  return first;
}

MeshDrawer::Cover MeshDrawer::Covered(const PinholeView& view) const {
  const glm::mat4 eye_from_map = GlEyeFromMap(view.camera_from_map);
  Cover cover;
  for (const Item& item : items_) {
    if (!IsVisible(item.center, item.radius, view.bounds, eye_from_map)) continue;
    const Cover one = CoverOf(item.box, view);
    cover.low = glm::min(cover.low, one.low);
    cover.high = glm::max(cover.high, one.high);
  }
  return cover;
}

MeshDrawer::Cover MeshDrawer::CoverOf(const Box& box, const PinholeView& view) {
  const glm::mat4 eye_from_map = GlEyeFromMap(view.camera_from_map);
  const float radius = 0.5f * glm::length(box.high - box.low);
  if (!IsVisible(0.5f * (box.low + box.high), radius, view.bounds, eye_from_map)) return {};
  Cover cover;
  for (int i = 0; i < 8; ++i) {
    const glm::vec3 eye(eye_from_map * glm::vec4(box.Corner(i), 1.0f));
    // A box that reaches behind the camera may cover the whole view.
    if (-eye.z <= 0.01f * radius) return {glm::vec2(0.0f), glm::vec2(1.0f)};
    const glm::vec2 place = GlTextureFromTangent(view.bounds, eye.x / -eye.z, -eye.y / -eye.z);
    cover.low = glm::min(cover.low, place);
    cover.high = glm::max(cover.high, place);
  }
  cover.low = glm::max(cover.low, glm::vec2(0.0f));
  cover.high = glm::min(cover.high, glm::vec2(1.0f));
  return cover;
}

void MeshDrawer::DepthRange::Include(double depth, double radius) {
  nearest = std::min(nearest, depth - radius);
  farthest = std::max(farthest, depth + radius);
}

double MeshDrawer::DepthRange::near_plane() const {
  // Surfaces of the room that are nearer are drawn at this plane. It is before all content by more than they
  // have to be to hide it (kDepthBias of the content layer).
  return std::max(nearest * 0.97, far_plane() / kMaxDepthRatio);
}

glm::mat4 MeshDrawer::DepthRange::ClipFromMap(const PinholeView& view) const {
  return GlClipFromGlEye(view.bounds, near_plane(), far_plane()) * GlEyeFromMap(view.camera_from_map);
}

void MeshDrawer::AddDepths(const PinholeView& view, DepthRange* range) const {
  const glm::mat4 eye_from_map = GlEyeFromMap(view.camera_from_map);
  for (const Item& item : items_) {
    if (!IsVisible(item.center, item.radius, view.bounds, eye_from_map)) continue;
    const auto depth = static_cast<double>(-(eye_from_map * glm::vec4(item.center, 1.0f)).z);
    range->Include(depth, static_cast<double>(item.radius));
  }
}

bool MeshDrawer::CasterPose::operator==(const CasterPose& other) const {
  // By owner, because a later model may lie at the address of one that is gone.
  return !model.owner_before(other.model) && !other.model.owner_before(model) &&
         map_from_model == other.map_from_model && animation == other.animation && seconds == other.seconds;
}

void MeshDrawer::CastersIn(std::span<const PinholeView> views, std::vector<Caster>* casters) const {
  // A shadow reaches about this far, in radii of its caster.
  constexpr float kReach = 4.0f;
  casters->clear();
  for (const Caster& caster : casters_) {
    const float radius = 0.5f * glm::length(caster.box.high - caster.box.low);
    const bool is_seen = std::any_of(views.begin(), views.end(), [&](const PinholeView& view) {
      return IsVisible(0.5f * (caster.box.low + caster.box.high), kReach * radius, view.bounds,
                       GlEyeFromMap(view.camera_from_map));
    });
    if (is_seen) casters->push_back(caster);
  }
}

void MeshDrawer::DrawDepth(const glm::mat4& clip_from_map, Part part) const {
  depth_program_.Use();
  glUniformMatrix4fv(depth_program_.Uniform("clip_from_map"), 1, GL_FALSE, &clip_from_map[0][0]);
  glActiveTexture(GL_TEXTURE0 + kJointUnit);
  glBindTexture(GL_TEXTURE_BUFFER, joint_texture_.name());
  for (const Item& item : items_) {
    if (part == Part::kSeenThrough ? !IsSeenThrough(*item.material) : item.casting != part) continue;
    glUniformMatrix4fv(depth_program_.Uniform("map_from_mesh"), 1, GL_FALSE, &item.map_from_mesh[0][0]);
    glUniform1i(depth_program_.Uniform("first_joint"), item.first_joint);
    glBindVertexArray(item.primitive->vertex_array.name());
    glDrawElements(GL_TRIANGLES, item.primitive->index_count, GL_UNSIGNED_INT, nullptr);
  }
  glBindVertexArray(0);
}

void MeshDrawer::Draw(const PinholeView& view, const DepthRange& range, const ModelLight& light) {
  const glm::mat4 eye_from_map = GlEyeFromMap(view.camera_from_map);
  struct Visible {
    const Item* item;
    float depth;  // Depth of the bounding sphere's centre.
  };
  std::vector<Visible> opaque, blended;
  for (const Item& item : items_) {
    if (!IsVisible(item.center, item.radius, view.bounds, eye_from_map)) continue;
    const float depth = -(eye_from_map * glm::vec4(item.center, 1.0f)).z;
    (IsSeenThrough(*item.material) ? blended : opaque).push_back({&item, depth});
  }
  if (opaque.empty() && blended.empty()) return;
  SetScene(view, range.ClipFromMap(view), light);

  const auto nearer = [](const Visible& a, const Visible& b) { return a.depth < b.depth; };
  std::stable_sort(opaque.begin(), opaque.end(),
                   nearer);  // Front to back, so that the depth test rejects hidden fragments early.
  std::stable_sort(blended.begin(), blended.end(), nearer);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LEQUAL);
  glDepthMask(GL_TRUE);
  glDisable(GL_BLEND);
  for (const Visible& visible : opaque) DrawItem(*visible.item);
  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  glDepthMask(GL_FALSE);
  for (auto visible = blended.rbegin(); visible != blended.rend(); ++visible) DrawItem(*visible->item);
  glDepthMask(GL_TRUE);
  glDisable(GL_BLEND);
  glDisable(GL_CULL_FACE);
  glDisable(GL_DEPTH_TEST);
  glBindVertexArray(0);
}

void MeshDrawer::SetLight(const ModelLight& light) {
  glUniform1i(program_.Uniform("light_is_known"), light.room != nullptr);
  glUniform3fv(program_.Uniform("exposure"), 1, &light.exposure[0]);
  glm::vec3 to_light = DirectionToLight(up_in_map_), radiance = kLightRadiance;
  if (light.room != nullptr) {
    engine::LightEstimate room = *light.room;
    if (room.direct > 0) {
      to_light = GlmFrom(room.to_light);
    } else {
      room = WithFixedDirection(room, Eigen::Vector3d(to_light.x, to_light.y, to_light.z));
    }
    // A white surface that faces the light is as bright as the light's radiance over pi.
    radiance = glm::vec3(static_cast<float>(room.direct * std::numbers::pi));
    const Eigen::Matrix<float, 9, 1> brightness = room.brightness.cast<float>();
    glUniform1fv(program_.Uniform("room_brightness"), 9, brightness.data());
    glUniform1f(program_.Uniform("direct"), static_cast<float>(room.direct));
  }
  glUniform3fv(program_.Uniform("direction_to_light"), 1, &to_light[0]);
  glUniform3fv(program_.Uniform("light_radiance"), 1, &radiance[0]);
}

void MeshDrawer::SetScene(const PinholeView& view, const glm::mat4& clip_from_map, const ModelLight& light) {
  program_.Use();
  const auto set_vector = [&](const char* name, const glm::vec3& v) {
    glUniform3fv(program_.Uniform(name), 1, &v[0]);
  };
  glUniformMatrix4fv(program_.Uniform("clip_from_map"), 1, GL_FALSE, &clip_from_map[0][0]);
  set_vector("eye_in_map", GlmFrom(view.camera_from_map.OriginInSource()));
  set_vector("up_in_map", up_in_map_);
  set_vector("sky_radiance", kSkyRadiance);
  set_vector("floor_radiance", kFloorRadiance);
  SetLight(light);
  glActiveTexture(GL_TEXTURE0 + kJointUnit);
  glBindTexture(GL_TEXTURE_BUFFER, joint_texture_.name());
}

void MeshDrawer::DrawItem(const Item& item) {
  SetMaterial(item);
  glUniformMatrix4fv(program_.Uniform("map_from_mesh"), 1, GL_FALSE, &item.map_from_mesh[0][0]);
  glUniform1i(program_.Uniform("first_joint"), item.first_joint);
  glUniform1i(program_.Uniform("flip_normals"), item.mirrors);
  glFrontFace(item.mirrors ? GL_CW : GL_CCW);
  glBindVertexArray(item.primitive->vertex_array.name());
  const auto draw = [&] {
    glDrawElements(GL_TRIANGLES, item.primitive->index_count, GL_UNSIGNED_INT, nullptr);
  };
  if (!item.material->double_sided) {
    glEnable(GL_CULL_FACE);
    glCullFace(GL_BACK);
    draw();
  } else if (IsSeenThrough(*item.material)) {
    glEnable(GL_CULL_FACE);  // Back faces are drawn first, so that the front faces blend over them.
    glCullFace(GL_FRONT);
    draw();
    glCullFace(GL_BACK);
    draw();
  } else {
    glDisable(GL_CULL_FACE);
    draw();
  }
  glFrontFace(GL_CCW);
}

void MeshDrawer::SetMaterial(const Item& item) {
  const content::Material& material = *item.material;
  SetTexture(item, 0, material.base_color_texture);
  SetTexture(item, 1, material.metallic_roughness_texture);
  SetTexture(item, 2, material.normal_texture);
  SetTexture(item, 3, material.occlusion_texture);
  SetTexture(item, 4, material.emissive_texture);
  SetTexture(item, 5, material.transmission_texture);
  glUniform4fv(program_.Uniform("base_color"), 1, &material.base_color[0]);
  glUniform3fv(program_.Uniform("emissive"), 1, &material.emissive[0]);
  glUniform1f(program_.Uniform("metallic"), material.metallic);
  glUniform1f(program_.Uniform("roughness"), material.roughness);
  glUniform1f(program_.Uniform("normal_scale"), material.normal_scale);
  glUniform1f(program_.Uniform("occlusion_strength"), material.occlusion_strength);
  glUniform1f(program_.Uniform("transmission"), material.transmission);
  glUniform1i(program_.Uniform("alpha_mode"), static_cast<int>(material.alpha));
  glUniform1f(program_.Uniform("alpha_cutoff"), material.alpha_cutoff);
  glUniform1i(program_.Uniform("unlit"), material.unlit);
}

void MeshDrawer::SetTexture(const Item& item, int unit, const content::TextureUse& use) {
  const TextureSlot& slot = kSlots[unit];
  glActiveTexture(GL_TEXTURE0 +
                  unit);  // Must come first, because an upload binds its texture to the active unit.
  const GLuint texture = item.resources->Texture(*item.model, use.texture, slot.is_color);
  glBindTexture(GL_TEXTURE_2D, texture != 0 ? texture : white_.name());
  glUniform1i(program_.Uniform(slot.used), texture != 0);
  glUniform1i(program_.Uniform(slot.uv_set), use.uv_set);
  glUniformMatrix3fv(program_.Uniform(slot.uv_transform), 1, GL_FALSE, &use.uv_transform[0][0]);
}

}  // namespace docent::ui
