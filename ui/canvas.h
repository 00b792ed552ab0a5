// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>

#include "ui/gl_objects.h"
#include "ui/text.h"

namespace docent::ui {

// Draws anti-aliased 2D shapes (boxes, disks, lines and text) over an image, in the order of the calls.
// Coordinates are image pixels: the centre of the top-left pixel is (0, 0) and y points down. The calls only
// collect vertices; End draws them into the bound framebuffer, whose row 0 is the top of the image. Single
// thread, single context.
class Canvas {
 public:
  Canvas();

  // `to_window`: End draws into the current viewport of the default framebuffer, whose row 0 is at the
  // bottom.
  void Begin(int width_px, int height_px, bool to_window = false);
  void End();

  // A stroke_px of 0 fills the shape; otherwise an outline of that width is drawn just inside its edge.
  void Box(const Eigen::Vector2d& low, const Eigen::Vector2d& high, double corner_px, const Color& color,
           double stroke_px = 0);
  void Disk(const Eigen::Vector2d& center, double radius_px, const Color& color, double stroke_px = 0);
  void Line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double width_px, const Color& color);
  // Draws text whose top is at position.y. With align 0, 0.5 or 1, position.x is the left end, the middle or
  // the right end of the text. Returns the size of the text in pixels.
  Eigen::Vector2d Text(const std::string& text, const TextStyle& style, const Eigen::Vector2d& position,
                       double align = 0, double alpha = 1);
  Eigen::Vector2d Measure(const std::string& text, const TextStyle& style);
  // Draws a texture (premultiplied, row 0 at the top), which must exist until End.
  void Image(GLuint texture, const Eigen::Vector2d& low, const Eigen::Vector2d& high);

  int width_px() const { return width_px_; }
  int height_px() const { return height_px_; }

 private:
  struct Vertex {
    float x, y, local_x, local_y;
    float half_width, half_height, corner, stroke;
    Color color;
  };
  struct Run {  // Vertices that are drawn with one call, because they use the same texture.
    std::size_t first = 0;
    GLuint texture = 0;  // 0: shapes, which have none.
  };
  struct Label {
    TextStyle style;
    GlTexture texture;
    Eigen::Vector2d size = Eigen::Vector2d::Zero();
    std::uint64_t last_frame = 0;
  };
  void AddQuad(const Eigen::Vector2d corners[4], const Eigen::Vector2d locals[4], const Vertex& shape);
  void AddShape(const Eigen::Vector2d& center, const Eigen::Vector2d& half_size, const Eigen::Vector2d& axis,
                const Vertex& shape);
  void UseTexture(GLuint texture);
  Label& FindLabel(const std::string& text, const TextStyle& style);

  GlProgram shape_program_, image_program_;
  GlVertexArray vertex_array_;
  GlBuffer buffer_;
  int width_px_ = 1, height_px_ = 1;
  bool to_window_ = false;
  std::uint64_t frame_ = 0;
  std::vector<Vertex> vertices_;
  std::vector<Run> runs_;
  std::unordered_multimap<std::string, Label> labels_;
};

}  // namespace docent::ui
