// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <memory>
#include <string>
#include <vector>

// A loaded 3D model as plain data for a renderer: the validated contents of a glTF 2.0 file with all indices
// in range. glTF axes (y up, metres). Immutable once loaded and shared by all instances.
namespace docent::content {

struct Image {
  int width_px = 0, height_px = 0;
  std::vector<std::uint8_t> rgba;  // width * height * 4 bytes.
};

struct Texture {
  int image = -1;  // Index into Model::images, -1 for none.
  bool repeat_u = true, repeat_v = true, mirror_u = false, mirror_v = false;
  bool nearest = false;
};

struct TextureUse {
  int texture = -1;              // Index into Model::textures, -1 for none.
  int uv_set = 0;                // 0 or 1.
  glm::mat3 uv_transform{1.0f};  // KHR_texture_transform.
};

// Metallic-roughness material (glTF 2.0 §3.9).
struct Material {
  std::string name;
  glm::vec4 base_color{1.0f};
  float metallic = 1.0f, roughness = 1.0f;
  glm::vec3 emissive{0.0f};
  float normal_scale = 1.0f, occlusion_strength = 1.0f;
  // The part of the light behind the surface that passes it (KHR_materials_transmission), 0..1. It is neither
  // bent nor tinted. The texture's red channel scales it.
  float transmission = 0.0f;
  TextureUse base_color_texture, metallic_roughness_texture, normal_texture, occlusion_texture,
      emissive_texture, transmission_texture;
  enum class Alpha { kOpaque, kMask, kBlend } alpha = Alpha::kOpaque;
  float alpha_cutoff = 0.5f;
  bool double_sided = false;
  bool unlit = false;
};

struct Vertex {
  glm::vec3 position{0.0f};
  glm::vec3 normal{0.0f, 1.0f, 0.0f};
  glm::vec4 tangent{1.0f, 0.0f, 0.0f, 1.0f};
  glm::vec2 uv0{0.0f}, uv1{0.0f};
  glm::vec4 color{1.0f};
  glm::u16vec4 joints{0};
  glm::vec4 weights{0.0f};  // All zero if not skinned.
};

// Triangles. Points and lines of the file are left out; strips and fans are unrolled.
struct Primitive {
  std::vector<Vertex> vertices;
  std::vector<std::uint32_t> indices;  // Three per triangle.
  int material = -1;                   // -1 for the default material.
};

struct Mesh {
  std::string name;
  std::vector<Primitive> primitives;
};

struct Node {
  std::string name;
  int parent = -1;
  std::vector<int> children;
  glm::vec3 translation{0.0f};
  glm::quat rotation{1.0f, 0.0f, 0.0f, 0.0f};  // Order w x y z.
  glm::vec3 scale{1.0f};
  int mesh = -1, skin = -1;
};

struct Skin {
  std::vector<int> joints;              // Node indices.
  std::vector<glm::mat4> inverse_bind;  // One per joint.
};

// One property of one node over time.
struct AnimationChannel {
  enum class Target { kTranslation, kRotation, kScale } target = Target::kTranslation;
  enum class Interpolation { kStep, kLinear, kCubicSpline } interpolation = Interpolation::kLinear;
  int node = -1;
  std::vector<float> times;       // Seconds, ascending.
  std::vector<glm::vec4> values;  // One per time (three for cubic splines: in-tangent, value, out-tangent).
};

struct Animation {
  std::string name;
  float duration = 0;  // Seconds.
  std::vector<AnimationChannel> channels;
};

struct Model {
  std::string name;
  std::vector<Image> images;
  std::vector<Texture> textures;
  std::vector<Material> materials;
  std::vector<Mesh> meshes;
  std::vector<Node> nodes;  // Parents precede children.
  std::vector<int> roots;   // Roots of the visible scene.
  std::vector<Skin> skins;
  std::vector<Animation> animations;
  glm::vec3 bounds_min{0.0f}, bounds_max{0.0f};  // Bounding box of the rest pose in model axes, metres.
  std::vector<std::string> warnings;  // One sentence for each feature that was left out or repaired.
};

// Returns the model_from_node matrices of all nodes at a time of an animation (seconds; the animation
// repeats). Animation -1 is the rest pose.
std::vector<glm::mat4> NodeMatrices(const Model& model, int animation, double seconds);

}  // namespace docent::content
