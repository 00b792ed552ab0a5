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

// Flat drawing over an image: boxes, disks, lines and text with smooth edges, in the order of the calls.
// Coordinates are the image's pixels (the centre of the top-left pixel is (0, 0), y down). Calls only
// collect; End draws into the bound framebuffer, an image target (row 0 is the top). One thread, one
// context.
class Canvas {
 public:
  Canvas();

  void Begin(int width_px, int height_px);
  void End();

  // stroke_px 0 fills; otherwise a line of that width just inside the edge.
  void Box(const Eigen::Vector2d& low, const Eigen::Vector2d& high, double corner_px, const Color& color,
           double stroke_px = 0);
  void Disk(const Eigen::Vector2d& center, double radius_px, const Color& color, double stroke_px = 0);
  void Line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double width_px, const Color& color);
  // Text with its top at y; align 0, 0.5, 1: `position.x` is its left end, middle, right end. Returns its
  // size.
  Eigen::Vector2d Text(const std::string& text, const TextStyle& style, const Eigen::Vector2d& position,
                       double align = 0, double alpha = 1);
  Eigen::Vector2d Measure(const std::string& text, const TextStyle& style);

  int width_px() const { return width_px_; }
  int height_px() const { return height_px_; }

 private:
  struct Vertex {
    float x, y, local_x, local_y;
    float half_width, half_height, corner, stroke;
    Color color;
  };
  struct Run {  // vertices drawn together
    std::size_t first = 0;
    GLuint texture = 0;
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

  GlProgram program_;
  GlVertexArray vertex_array_;
  GlBuffer buffer_;
  int width_px_ = 1, height_px_ = 1;
  std::uint64_t frame_ = 0;
  std::vector<Vertex> vertices_;
  std::vector<Run> runs_;
  std::unordered_multimap<std::string, Label> labels_;
};

}  // namespace docent::ui
