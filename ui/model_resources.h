// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <compare>
#include <cstddef>
#include <glm/glm.hpp>
#include <map>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "content/model.h"
#include "ui/gl_objects.h"

namespace docent::ui {

// An axis-aligned box. It is empty while low > high.
struct Box {
  glm::vec3 low{1e30f}, high{-1e30f};
  bool empty() const { return low.x > high.x; }
  void Include(const glm::vec3& point) {
    low = glm::min(low, point);
    high = glm::max(high, point);
  }
  glm::vec3 Corner(int index) const {
    return glm::vec3(index & 1 ? high.x : low.x, index & 2 ? high.y : low.y, index & 4 ? high.z : low.z);
  }
};

// A content::Primitive on the graphics card, with the properties that must be known without reading it back.
struct GpuPrimitive {
  GlVertexArray vertex_array;
  GlBuffer vertices, indices;
  GLsizei index_count = 0;
  int material = -1;
  Box box;  // Bounding box of the stored vertices.
  // For a skinned primitive, the bounding box of the vertices that each joint moves. A posed vertex is a
  // weighted mean of its positions under its joints, so the union of the transformed boxes contains the posed
  // primitive.
  std::vector<Box> joint_boxes;
};

// The graphics memory of one content::Model. Textures are uploaded on first use.
class ModelResources {
 public:
  // Images wider or higher than max_texture_px are downscaled.
  ModelResources(const content::Model& model, int max_texture_px);

  const std::vector<GpuPrimitive>& primitives(int mesh) const { return meshes_[mesh]; }
  // Returns 0 when the model has no such texture. Colour textures are sRGB, the others linear. Textures that
  // show one image in the same way share their memory.
  GLuint Texture(const content::Model& model, int texture, bool is_color);

 private:
  // An image and how it is sampled. Files often have a texture of their own for each material that uses an
  // image, so the index of the texture would upload the image several times.
  struct TextureKey {
    int image;
    bool repeat_u, repeat_v, mirror_u, mirror_v, nearest, is_color;
    auto operator<=>(const TextureKey&) const = default;
  };

  int max_texture_px_;
  std::vector<std::vector<GpuPrimitive>> meshes_;
  std::map<TextureKey, GlTexture> textures_;
};

// The resources of all models in use. Sweep frees those of models that no longer exist.
class ModelCache {
 public:
  explicit ModelCache(int max_texture_px) : max_texture_px_(max_texture_px) {}
  ModelResources& Get(const std::shared_ptr<const content::Model>& model);
  void Sweep();
  std::size_t size() const { return entries_.size(); }

 private:
  struct Entry {
    std::weak_ptr<const content::Model> model;
    std::unique_ptr<ModelResources> resources;
  };
  int max_texture_px_;
  std::unordered_map<const content::Model*, Entry> entries_;
};

// Makes a texture with mipmaps from an image in memory. `format` is GL_RGBA or GL_BGRA; the rows are packed.
GlTexture MakeTexture(int width_px, int height_px, GLenum format, const void* bytes, bool is_srgb);

}  // namespace docent::ui
