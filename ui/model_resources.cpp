// SPDX-License-Identifier: Apache-2.0
#include "ui/model_resources.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace docent::ui {
namespace {

void DescribeVertices() {
  using content::Vertex;
  const auto floats = [](GLuint location, GLint count, std::size_t offset) {
    glEnableVertexAttribArray(location);
    glVertexAttribPointer(location, count, GL_FLOAT, GL_FALSE, sizeof(Vertex),
                          reinterpret_cast<const void*>(offset));
  };
  floats(0, 3, offsetof(Vertex, position));
  floats(1, 3, offsetof(Vertex, normal));
  floats(2, 4, offsetof(Vertex, tangent));
  floats(3, 2, offsetof(Vertex, uv0));
  floats(4, 2, offsetof(Vertex, uv1));
  floats(5, 4, offsetof(Vertex, color));
  glEnableVertexAttribArray(6);
  glVertexAttribIPointer(6, 4, GL_UNSIGNED_SHORT, sizeof(Vertex),
                         reinterpret_cast<const void*>(offsetof(Vertex, joints)));
  floats(7, 4, offsetof(Vertex, weights));
}

void MeasureBoxes(const content::Primitive& primitive, GpuPrimitive* result) {
  for (const content::Vertex& vertex : primitive.vertices) {
    result->box.Include(vertex.position);
    for (int i = 0; i < 4; ++i) {
      if (vertex.weights[i] <= 0.0f) continue;
      const std::size_t joint = vertex.joints[i];
      if (joint >= result->joint_boxes.size()) result->joint_boxes.resize(joint + 1);
      result->joint_boxes[joint].Include(vertex.position);
    }
  }
}

GpuPrimitive Upload(const content::Primitive& primitive) {
  GpuPrimitive result;
  result.material = primitive.material;
  result.index_count = static_cast<GLsizei>(primitive.indices.size());
  MeasureBoxes(primitive, &result);
  glBindVertexArray(result.vertex_array.name());
  glBindBuffer(GL_ARRAY_BUFFER, result.vertices.name());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(primitive.vertices.size() * sizeof(content::Vertex)),
               primitive.vertices.data(), GL_STATIC_DRAW);
  DescribeVertices();
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, result.indices.name());
  glBufferData(GL_ELEMENT_ARRAY_BUFFER,
               static_cast<GLsizeiptr>(primitive.indices.size() * sizeof(std::uint32_t)),
               primitive.indices.data(), GL_STATIC_DRAW);
  glBindVertexArray(0);
  return result;
}

GLint WrapMode(bool repeat, bool mirror) {
  if (!repeat) return GL_CLAMP_TO_EDGE;
  return mirror ? GL_MIRRORED_REPEAT : GL_REPEAT;
}

}  // namespace

GlTexture MakeTexture(int width_px, int height_px, GLenum format, const void* bytes, bool is_srgb) {
  GlTexture texture;
  glBindTexture(GL_TEXTURE_2D, texture.name());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
  glTexImage2D(GL_TEXTURE_2D, 0, is_srgb ? GL_SRGB8_ALPHA8 : GL_RGBA8, width_px, height_px, 0, format,
               GL_UNSIGNED_BYTE, bytes);
  glGenerateMipmap(GL_TEXTURE_2D);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  return texture;
}

ModelResources::ModelResources(const content::Model& model, int max_texture_px)
    : max_texture_px_(max_texture_px) {
  meshes_.reserve(model.meshes.size());
  for (const content::Mesh& mesh : model.meshes) {
    std::vector<GpuPrimitive>& primitives = meshes_.emplace_back();
    for (const content::Primitive& primitive : mesh.primitives) primitives.push_back(Upload(primitive));
  }
}

GLuint ModelResources::Texture(const content::Model& model, int texture, bool is_color) {
  if (texture < 0 || texture >= static_cast<int>(model.textures.size())) return 0;
  const content::Texture& description = model.textures[texture];
  const TextureKey key = {description.image,
                          description.repeat_u,
                          description.repeat_v,
                          description.mirror_u,
                          description.mirror_v,
                          description.nearest,
                          is_color};
  const auto found = textures_.find(key);
  if (found != textures_.end()) return found->second.name();
  if (description.image < 0 || description.image >= static_cast<int>(model.images.size())) return 0;
  const content::Image& image = model.images[description.image];
  const std::size_t bytes = std::size_t{4} * image.width_px * image.height_px;
  if (image.width_px < 1 || image.height_px < 1 || image.rgba.size() != bytes) return 0;

  cv::Mat pixels(image.height_px, image.width_px, CV_8UC4, const_cast<std::uint8_t*>(image.rgba.data()));
  const int longest = std::max(image.width_px, image.height_px);
  if (longest > max_texture_px_) {
    const double factor = static_cast<double>(max_texture_px_) / longest;
    cv::Mat smaller;  // cv::resize must not write through `pixels` into the model.
    cv::resize(pixels, smaller,
               cv::Size(std::max(1, static_cast<int>(image.width_px * factor)),
                        std::max(1, static_cast<int>(image.height_px * factor))),
               0, 0, cv::INTER_AREA);
    pixels = smaller;
  }
  GlTexture uploaded = MakeTexture(pixels.cols, pixels.rows, GL_RGBA, pixels.data, is_color);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, WrapMode(description.repeat_u, description.mirror_u));
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, WrapMode(description.repeat_v, description.mirror_v));
  if (description.nearest) {
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST_MIPMAP_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  }
  return textures_.emplace(key, std::move(uploaded)).first->second.name();
}

ModelResources& ModelCache::Get(const std::shared_ptr<const content::Model>& model) {
  Entry& entry = entries_[model.get()];
  // A new model may have the address of a deleted one.
  if (entry.resources == nullptr || entry.model.lock() != model) {
    entry.resources = std::make_unique<ModelResources>(*model, max_texture_px_);
    entry.model = model;
  }
  return *entry.resources;
}

void ModelCache::Sweep() {
  std::erase_if(entries_, [](const auto& entry) { return entry.second.model.expired(); });
}

}  // namespace docent::ui
