// SPDX-License-Identifier: Apache-2.0
#include "content/flat_image.h"

#include <algorithm>
#include <utility>

#include "content/gltf/images.h"
#include "content/gltf/json.h"

namespace docent::content {
namespace {

// A side of the rectangle, seen from +z or, with facing -1, from -z.
Primitive FlatSide(const glm::vec2& half, float facing, int material) {
  Primitive side;
  side.material = material;
  for (const glm::vec2& corner : {glm::vec2(-1, -1), glm::vec2(1, -1), glm::vec2(1, 1), glm::vec2(-1, 1)}) {
    Vertex vertex;
    vertex.position = glm::vec3(corner * half, 0.0f);
    vertex.normal = glm::vec3(0, 0, facing);
    vertex.uv0 = glm::vec2((corner.x + 1) / 2, (1 - corner.y) / 2);
    side.vertices.push_back(vertex);
  }
  side.indices = {0, 1, 2, 0, 2, 3};
  if (facing < 0) std::reverse(side.indices.begin(), side.indices.end());
  return side;
}

bool HasTransparency(const Image& image) {
  for (std::size_t i = 3; i < image.rgba.size(); i += 4) {
    if (image.rgba[i] != 255) return true;
  }
  return false;
}

}  // namespace

bool IsImageFile(std::span<const std::uint8_t> bytes) {
  const bool is_png = bytes.size() >= 4 && bytes[0] == 0x89 && bytes[1] == 'P' && bytes[2] == 'N';
  return is_png || (bytes.size() >= 3 && bytes[0] == 0xFF && bytes[1] == 0xD8 && bytes[2] == 0xFF);
}

std::shared_ptr<Model> FlatImageModel(const std::string& file, std::span<const std::uint8_t> bytes) {
  if (bytes.size() > kMaxImageFileBytes)
    Refuse(file, "", "the image has more than " + std::to_string(kMaxImageFileBytes >> 20) + " MiB.");
  LoadLimits limits;
  limits.max_image_side_px = kMaxImageSidePx;
  limits.max_image_pixels = kMaxImagePixels;
  std::uint64_t pixels_left = kMaxImagePixels;
  std::optional<Image> image = DecodeImage(file, "the file", bytes, limits, &pixels_left);
  if (!image) Refuse(file, "", "the image " + ImageFault(bytes).value_or("cannot be decoded") + ".");
  return FlatModel(std::move(*image));
}

std::shared_ptr<Model> FlatModel(Image image) {
  const glm::vec2 size(image.width_px, image.height_px);
  const glm::vec2 half = 0.5f * size / std::max(size.x, size.y);

  auto model = std::make_shared<Model>();
  model->name = "image";
  Material front;
  front.base_color_texture.texture = 0;
  front.unlit = true;
  if (HasTransparency(image)) front.alpha = Material::Alpha::kBlend;
  Material back;
  back.base_color = glm::vec4(0.35f, 0.33f, 0.3f, 1.0f);
  back.metallic = 0.0f;
  model->materials = {front, back};
  model->images.push_back(std::move(image));
  Texture texture;
  texture.image = 0;
  texture.repeat_u = texture.repeat_v = false;
  model->textures.push_back(texture);
  model->meshes.push_back({"image", {FlatSide(half, 1, 0), FlatSide(half, -1, 1)}});
  Node node;
  node.mesh = 0;
  model->nodes.push_back(node);
  model->roots.push_back(0);
  model->bounds_min = glm::vec3(-half, 0.0f);
  model->bounds_max = glm::vec3(half, 0.0f);
  return model;
}

}  // namespace docent::content
