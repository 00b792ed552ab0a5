// SPDX-License-Identifier: Apache-2.0
#include "ui/canvas.h"

#include <algorithm>
#include <cmath>

#include "ui/shaders.h"

namespace docent::ui {
namespace {

// Labels that were not drawn for this many frames are deleted.
constexpr std::uint64_t kLabelLifeFrames = 120;

// The texture is drawn at its own size and at whole pixels, so it needs no filter.
GlTexture MakeLabelTexture(const cv::Mat& image) {
  GlTexture texture;
  glBindTexture(GL_TEXTURE_2D, texture.name());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, static_cast<GLint>(image.step / 4));
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, image.cols, image.rows, 0, GL_BGRA, GL_UNSIGNED_BYTE, image.data);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
  for (const GLenum direction : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T})
    glTexParameteri(GL_TEXTURE_2D, direction, GL_CLAMP_TO_EDGE);
  for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
    glTexParameteri(GL_TEXTURE_2D, filter, GL_NEAREST);
  return texture;
}

}  // namespace

Canvas::Canvas()
    : shape_program_("canvas shapes", kCanvasVertexShader, kCanvasShapeFragmentShader),
      image_program_("canvas images", kCanvasVertexShader, kCanvasImageFragmentShader) {
  image_program_.AssignTextureUnits({"label"});
  glBindVertexArray(vertex_array_.name());
  glBindBuffer(GL_ARRAY_BUFFER, buffer_.name());
  const auto floats = [](GLuint location, GLint count, std::size_t offset) {
    glEnableVertexAttribArray(location);
    glVertexAttribPointer(location, count, GL_FLOAT, GL_FALSE, sizeof(Vertex),
                          reinterpret_cast<const void*>(offset));
  };
  floats(0, 2, offsetof(Vertex, x));
  floats(1, 2, offsetof(Vertex, local_x));
  floats(2, 4, offsetof(Vertex, half_width));
  floats(3, 4, offsetof(Vertex, color));
  glBindVertexArray(0);
}

void Canvas::Begin(int width_px, int height_px, bool to_window) {
  to_window_ = to_window;
  width_px_ = width_px;
  height_px_ = height_px;
  ++frame_;
  vertices_.clear();
  runs_.clear();
  std::erase_if(labels_,
                [&](const auto& label) { return label.second.last_frame + kLabelLifeFrames < frame_; });
}

void Canvas::End() {
  if (vertices_.empty()) return;
  glBindVertexArray(vertex_array_.name());
  glBindBuffer(GL_ARRAY_BUFFER, buffer_.name());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(vertices_.size() * sizeof(Vertex)), vertices_.data(),
               GL_STREAM_DRAW);
  for (GlProgram* const program : {&shape_program_, &image_program_}) {
    program->Use();
    glUniform2f(program->Uniform("target_size"), static_cast<float>(width_px_),
                static_cast<float>(height_px_));
    glUniform1f(program->Uniform("up"), to_window_ ? -1.0f : 1.0f);
  }
  glActiveTexture(GL_TEXTURE0);
  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    const std::size_t end = i + 1 < runs_.size() ? runs_[i + 1].first : vertices_.size();
    (runs_[i].texture == 0 ? shape_program_ : image_program_).Use();
    glBindTexture(GL_TEXTURE_2D, runs_[i].texture);
    glDrawArrays(GL_TRIANGLES, static_cast<GLint>(runs_[i].first),
                 static_cast<GLsizei>(end - runs_[i].first));
  }
  glDisable(GL_BLEND);
  glBindVertexArray(0);
}

void Canvas::Box(const Eigen::Vector2d& low, const Eigen::Vector2d& high, double corner_px,
                 const Color& color, double stroke_px) {
  const Eigen::Vector2d half = 0.5 * (high - low);
  if (half.minCoeff() <= 0) return;
  const double corner = std::clamp(corner_px, 0.0, half.minCoeff());
  AddShape(0.5 * (low + high), half, Eigen::Vector2d::UnitX(),
           {0, 0, 0, 0, 0, 0, static_cast<float>(corner), static_cast<float>(stroke_px), color});
}

void Canvas::Disk(const Eigen::Vector2d& center, double radius_px, const Color& color, double stroke_px) {
  const Eigen::Vector2d radius = Eigen::Vector2d::Constant(radius_px);
  Box(center - radius, center + radius, radius_px, color, stroke_px);
}

void Canvas::Line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double width_px,
                  const Color& color) {
  const Eigen::Vector2d along = to - from;
  const double length = along.norm();
  const Eigen::Vector2d axis = length > 0 ? Eigen::Vector2d(along / length) : Eigen::Vector2d::UnitX();
  const Eigen::Vector2d half(0.5 * (length + width_px), 0.5 * width_px);
  AddShape(0.5 * (from + to), half, axis, {0, 0, 0, 0, 0, 0, static_cast<float>(0.5 * width_px), 0, color});
}

Eigen::Vector2d Canvas::Text(const std::string& text, const TextStyle& style, const Eigen::Vector2d& position,
                             double align, double alpha) {
  if (text.empty()) return Eigen::Vector2d::Zero();
  Label& label = FindLabel(text, style);
  // The position is rounded to whole pixels, so that the text stays sharp.
  const Eigen::Vector2d low(std::round(position.x() - align * label.size.x()) - 0.5,
                            std::round(position.y()) - 0.5);
  const Eigen::Vector2d high = low + label.size;
  UseTexture(label.texture.name());
  const Eigen::Vector2d corners[4] = {low, {high.x(), low.y()}, high, {low.x(), high.y()}};
  const Eigen::Vector2d locals[4] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  AddQuad(corners, locals, {0, 0, 0, 0, 0, 0, 0, 0, {1, 1, 1, static_cast<float>(alpha)}});
  return label.size;
}

Eigen::Vector2d Canvas::Measure(const std::string& text, const TextStyle& style) {
  return text.empty() ? Eigen::Vector2d(Eigen::Vector2d::Zero()) : FindLabel(text, style).size;
}

void Canvas::Image(GLuint texture, const Eigen::Vector2d& low, const Eigen::Vector2d& high) {
  UseTexture(texture);
  const Eigen::Vector2d corners[4] = {low, {high.x(), low.y()}, high, {low.x(), high.y()}};
  const Eigen::Vector2d locals[4] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  AddQuad(corners, locals, {0, 0, 0, 0, 0, 0, 0, 0, {1, 1, 1, 1}});
}

void Canvas::AddShape(const Eigen::Vector2d& center, const Eigen::Vector2d& half_size,
                      const Eigen::Vector2d& axis, const Vertex& shape) {
  if (!center.allFinite() || !half_size.allFinite()) return;
  const Eigen::Vector2d across(-axis.y(), axis.x());
  const Eigen::Vector2d reach = half_size.array() + 1.0;  // Adds the outer half of the anti-aliased edge.
  Eigen::Vector2d corners[4], locals[4];
  for (int i = 0; i < 4; ++i) {
    locals[i] = {(i == 1 || i == 2 ? 1 : -1) * reach.x(), (i >= 2 ? 1 : -1) * reach.y()};
    corners[i] = center + locals[i].x() * axis + locals[i].y() * across;
  }
  Vertex complete = shape;
  complete.half_width = static_cast<float>(half_size.x());
  complete.half_height = static_cast<float>(half_size.y());
  UseTexture(0);
  AddQuad(corners, locals, complete);
}

void Canvas::AddQuad(const Eigen::Vector2d corners[4], const Eigen::Vector2d locals[4], const Vertex& shape) {
  for (const int i : {0, 1, 2, 0, 2, 3}) {
    Vertex vertex = shape;
    vertex.x = static_cast<float>(corners[i].x());
    vertex.y = static_cast<float>(corners[i].y());
    vertex.local_x = static_cast<float>(locals[i].x());
    vertex.local_y = static_cast<float>(locals[i].y());
    vertices_.push_back(vertex);
  }
}

void Canvas::UseTexture(GLuint texture) {
  if (runs_.empty() || runs_.back().texture != texture) runs_.push_back({vertices_.size(), texture});
}

Canvas::Label& Canvas::FindLabel(const std::string& text, const TextStyle& style) {
  const auto [begin, end] = labels_.equal_range(text);
  for (auto at = begin; at != end; ++at) {
    if (at->second.style == style) {
      at->second.last_frame = frame_;
      return at->second;
    }
  }
  const cv::Mat image = DrawText(text, style);
  glActiveTexture(GL_TEXTURE0);
  Label label;
  label.style = style;
  label.texture = MakeLabelTexture(image);
  label.size = Eigen::Vector2d(image.cols, image.rows);
  label.last_frame = frame_;
  return labels_.emplace(text, std::move(label))->second;
}

}  // namespace docent::ui
