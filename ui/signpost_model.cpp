// SPDX-License-Identifier: Apache-2.0
#include "ui/signpost_model.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "ui/text.h"
#include "ui/theme.h"

namespace docent::ui {
namespace {

// With padding and strip, the texture stays below 1024. At the smaller size of the text, five lines fit; a
// longer text ends with an ellipsis, and its card has all of it (content::CardOf).
constexpr int kMaxTextWidthPx = 900, kMaxTextHeightPx = 300;
constexpr int kPaddingPx = 28, kStripHeightPx = 84, kStripTextPx = 44;
constexpr double kWantedAspect = 1.9;
constexpr float kPoleHeight = static_cast<float>(content::kSignpostPole), kPoleRadius = 0.035f,
                kThickness = 0.07f, kCornerRadius = 0.09f;

// Of the arrow, in heights of the board. Above the board, so that it can point anywhere.
constexpr float kArrowLength = 0.8f, kArrowHead = 0.36f, kArrowHeadRadius = 0.2f, kArrowShaftRadius = 0.08f;
constexpr double kArrowAboveBoard = 0.45;

cv::Scalar BgraOf(const Color& color) {
  return 255 * cv::Scalar(color.blue, color.green, color.red, color.alpha);
}

// Renders the text at the largest size at which all of it fits, wrapped to a balanced aspect ratio. It does
// not become smaller than three quarters of the largest size: small texts are not read.
cv::Mat LayOutText(const std::string& text) {
  cv::Mat best;
  for (const double size_px : {64.0, 48.0}) {
    double best_misfit = 1e30;
    for (const int width : {300, 420, 580, 740, kMaxTextWidthPx}) {
      TextStyle style;
      style.size_px = size_px;
      style.bold = true;
      style.centered = true;
      style.max_width_px = width;
      style.max_height_px = kMaxTextHeightPx;
      style.color = theme::kSignText;
      bool is_cut = false;
      const cv::Mat image = DrawText(text, style, &is_cut);
      const double misfit = std::abs(std::log(static_cast<double>(image.cols) / image.rows / kWantedAspect)) +
                            (is_cut ? 100.0 : 0.0);
      if (misfit < best_misfit) {
        best_misfit = misfit;
        best = image;
      }
    }
    if (best_misfit < 100.0) break;
  }
  return best;
}

// Blends premultiplied BGRA over an opaque image with its top left corner at (x, y), clipped at the border.
void Lay(const cv::Mat& over, int x, int y, cv::Mat* image) {
  const cv::Rect inside = cv::Rect(x, y, over.cols, over.rows) & cv::Rect(0, 0, image->cols, image->rows);
  for (int row = inside.y; row < inside.y + inside.height; ++row) {
    for (int column = inside.x; column < inside.x + inside.width; ++column) {
      const cv::Vec4b& source = over.at<cv::Vec4b>(row - y, column - x);
      cv::Vec4b& target = image->at<cv::Vec4b>(row, column);
      for (int i = 0; i < 3; ++i)
        target[i] =
            static_cast<std::uint8_t>(std::min(255, source[i] + (target[i] * (255 - source[3]) + 127) / 255));
    }
  }
}

// The complete front of the board, BGRA, opaque.
cv::Mat DrawBoard(const std::string& words, const std::string& to_map) {
  const cv::Mat text = LayOutText(words.empty() ? " " : words);
  const bool points_on = !to_map.empty();
  cv::Mat target_name;
  if (points_on) {
    TextStyle style;
    style.size_px = kStripTextPx;
    style.max_width_px = kMaxTextWidthPx;
    style.max_height_px = kStripHeightPx - 8;
    style.color = theme::kSignStripText;
    target_name = DrawText(to_map, style);
  }
  const int strip = points_on ? kStripHeightPx : 0;
  const int height = text.rows + 2 * kPaddingPx + strip;
  const int width = std::max(
      {text.cols + 3 * kPaddingPx, height * 5 / 4, points_on ? target_name.cols + 2 * kPaddingPx : 0});
  cv::Mat board(height, width, CV_8UC4, BgraOf(theme::kSignBoard));
  Lay(text, (width - text.cols) / 2, (height - strip - text.rows) / 2, &board);
  if (points_on) {
    board.rowRange(height - strip, height) = BgraOf(theme::kSignStrip);
    Lay(target_name, (width - target_name.cols) / 2, height - strip + (strip - target_name.rows) / 2, &board);
  }
  return board;
}

void AddTriangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, content::Primitive* primitive) {
  primitive->indices.insert(primitive->indices.end(), {a, b, c});
}

content::Vertex MakeVertex(const glm::vec3& position, const glm::vec3& normal, const glm::vec2& uv = {}) {
  content::Vertex vertex;
  vertex.position = position;
  vertex.normal = normal;
  vertex.uv0 = uv;
  return vertex;
}

// The outline of a rounded rectangle around (0, 0), counter-clockwise.
std::vector<glm::vec2> RoundedOutline(const glm::vec2& half_size) {
  constexpr int kSteps = 6;
  std::vector<glm::vec2> outline;
  const glm::vec2 inner = half_size - kCornerRadius;
  for (int corner = 0; corner < 4; ++corner) {
    const glm::vec2 center(corner == 0 || corner == 3 ? inner.x : -inner.x, corner < 2 ? inner.y : -inner.y);
    for (int i = 0; i <= kSteps; ++i) {
      const float angle = static_cast<float>(std::numbers::pi / 2) *
                          (static_cast<float>(corner) + static_cast<float>(i) / kSteps);
      outline.push_back(center + kCornerRadius * glm::vec2(std::cos(angle), std::sin(angle)));
    }
  }
  return outline;
}

// One flat side of the board at this z: a triangle fan over the outline, visible from `facing` (+1 or -1
// along z).
content::Primitive BoardSide(const std::vector<glm::vec2>& outline, const glm::vec2& half_size,
                             float facing) {
  content::Primitive side;
  const float middle = kPoleHeight + half_size.y;
  for (const glm::vec2& point : outline) {
    const glm::vec2 uv((point.x / half_size.x + 1.0f) / 2.0f, (1.0f - point.y / half_size.y) / 2.0f);
    side.vertices.push_back(
        MakeVertex({point.x, middle + point.y, facing * kThickness / 2}, {0, 0, facing}, uv));
  }
  for (std::uint32_t i = 2; i < outline.size(); ++i) {
    if (facing > 0) {
      AddTriangle(0, i - 1, i, &side);
    } else {
      AddTriangle(0, i, i - 1, &side);
    }
  }
  return side;
}

void AddRim(const std::vector<glm::vec2>& outline, const glm::vec2& half_size, content::Primitive* body) {
  const float middle = kPoleHeight + half_size.y;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const glm::vec2 a = outline[i], b = outline[(i + 1) % outline.size()];
    if (glm::length(b - a) < 1e-6f) continue;
    const glm::vec2 along = glm::normalize(b - a);
    const glm::vec3 normal(along.y, -along.x, 0);
    const auto first = static_cast<std::uint32_t>(body->vertices.size());
    for (const glm::vec2& point : {a, b}) {
      for (const float z : {kThickness / 2, -kThickness / 2})
        body->vertices.push_back(MakeVertex({point.x, middle + point.y, z}, normal));
    }
    AddTriangle(first, first + 1, first + 2, body);
    AddTriangle(first + 2, first + 1, first + 3, body);
  }
}

// A truncated cone about the y axis, closed at the top.
void AddCone(float bottom, float top, float bottom_radius, float top_radius, content::Primitive* body) {
  constexpr int kSides = 16;
  const auto first = static_cast<std::uint32_t>(body->vertices.size());
  const float slope = (bottom_radius - top_radius) / (top - bottom);
  for (int i = 0; i <= kSides; ++i) {
    const float angle = static_cast<float>(2 * std::numbers::pi) * static_cast<float>(i) / kSides;
    const glm::vec3 out(std::sin(angle), 0, std::cos(angle));
    const glm::vec3 normal = glm::normalize(out + glm::vec3(0, slope, 0));
    body->vertices.push_back(MakeVertex(out * bottom_radius + glm::vec3(0, bottom, 0), normal));
    body->vertices.push_back(MakeVertex(out * top_radius + glm::vec3(0, top, 0), normal));
    body->vertices.push_back(MakeVertex(out * top_radius + glm::vec3(0, top, 0), {0, 1, 0}));
  }
  for (std::uint32_t i = 0; i < kSides; ++i) {
    const std::uint32_t at = first + 3 * i;
    AddTriangle(at, at + 3, at + 1, body);
    AddTriangle(at + 1, at + 3, at + 4, body);
    if (i > 0) AddTriangle(first + 2, at + 2, at + 5, body);
  }
}

// A flat disk about the y axis at this height, visible from below.
void AddDiskBelow(float height, float radius, content::Primitive* body) {
  constexpr std::uint32_t kSides = 16;
  const auto first = static_cast<std::uint32_t>(body->vertices.size());
  for (std::uint32_t i = 0; i < kSides; ++i) {
    const float angle = static_cast<float>(2 * std::numbers::pi) * static_cast<float>(i) / kSides;
    body->vertices.push_back(
        MakeVertex({std::sin(angle) * radius, height, std::cos(angle) * radius}, {0, -1, 0}));
  }
  for (std::uint32_t i = 2; i < kSides; ++i) AddTriangle(first, first + i, first + i - 1, body);
}

// Rotates what was made along y so that it lies along z.
void LayDown(content::Primitive* part) {
  for (content::Vertex& vertex : part->vertices) {
    for (glm::vec3* const vector : {&vertex.position, &vertex.normal})
      *vector = glm::vec3(vector->x, -vector->z, vector->y);
  }
}

content::Material PlainMaterial(const glm::vec3& color) {
  content::Material material;
  material.base_color = glm::vec4(color, 1.0f);
  material.metallic = 0.0f;
  material.roughness = 0.6f;
  return material;
}

std::shared_ptr<const content::Model> MakeArrowModel() {
  constexpr float kEnd = kArrowLength / 2, kNeck = kEnd - kArrowHead;
  content::Primitive head, shaft, back;
  AddCone(kNeck, kEnd, kArrowHeadRadius, 0.0f, &head);
  AddCone(-kEnd, kNeck, kArrowShaftRadius, kArrowShaftRadius, &shaft);
  AddDiskBelow(kNeck, kArrowHeadRadius, &back);
  AddDiskBelow(-kEnd, kArrowShaftRadius, &back);
  auto model = std::make_shared<content::Model>();
  model->name = "signpost arrow";
  model->materials = {PlainMaterial({0.81f, 0.19f, 0.02f}), PlainMaterial({0.9f, 0.84f, 0.75f}),
                      PlainMaterial({0.01f, 0.025f, 0.06f})};
  int material = 0;
  for (content::Primitive* const part : {&head, &shaft, &back}) {
    LayDown(part);
    part->material = material++;
  }
  model->meshes.push_back({"arrow", {std::move(head), std::move(shaft), std::move(back)}});
  content::Node node;
  node.mesh = 0;
  model->nodes.push_back(node);
  model->roots.push_back(0);
  model->bounds_max = glm::vec3(kArrowHeadRadius, kArrowHeadRadius, kEnd);
  model->bounds_min = -model->bounds_max;
  return model;
}

content::Image ImageFrom(const cv::Mat& bgra) {
  content::Image image;
  image.width_px = bgra.cols;
  image.height_px = bgra.rows;
  image.rgba.resize(std::size_t{4} * bgra.cols * bgra.rows);
  cv::Mat rgba(bgra.rows, bgra.cols, CV_8UC4, image.rgba.data());
  cv::cvtColor(bgra, rgba, cv::COLOR_BGRA2RGBA);
  return image;
}

}  // namespace

std::shared_ptr<const content::Model> MakeSignpostModel(const std::string& text, const std::string& to_map) {
  const cv::Mat board = DrawBoard(text, to_map);
  const glm::vec2 half_size(0.5f * static_cast<float>(board.cols) / static_cast<float>(board.rows), 0.5f);
  const std::vector<glm::vec2> outline = RoundedOutline(half_size);

  auto model = std::make_shared<content::Model>();
  model->name = "signpost";
  model->images.push_back(ImageFrom(board));
  content::Texture texture;
  texture.image = 0;
  texture.repeat_u = texture.repeat_v = false;
  model->textures.push_back(texture);
  content::Material front;
  front.base_color_texture.texture = 0;
  front.unlit = true;  // The text must be readable in any light.
  model->materials = {front, PlainMaterial({0.55f, 0.47f, 0.38f})};

  content::Primitive front_side = BoardSide(outline, half_size, 1.0f);
  front_side.material = 0;
  content::Primitive body = BoardSide(outline, half_size, -1.0f);
  body.material = 1;
  AddRim(outline, half_size, &body);
  AddCone(0.0f, 0.05f, 0.2f, 0.15f, &body);
  AddCone(0.05f, kPoleHeight, kPoleRadius, kPoleRadius, &body);
  model->meshes.push_back({"signpost", {std::move(front_side), std::move(body)}});
  content::Node node;
  node.mesh = 0;
  model->nodes.push_back(node);
  model->roots.push_back(0);
  const float half_width = std::max(half_size.x, 0.2f);
  model->bounds_min = glm::vec3(-half_width, 0, -0.2f);
  model->bounds_max = glm::vec3(half_width, kPoleHeight + 1.0f, 0.2f);
  return model;
}

std::shared_ptr<const content::Model> SignpostArrowModel() {
  static const std::shared_ptr<const content::Model> model = MakeArrowModel();
  return model;
}

engine::Sim3 SignpostArrowPose(const content::Signpost& signpost) {
  const Eigen::Vector3d up = signpost.up.normalized(), ahead = signpost.direction.value().normalized();
  Eigen::Vector3d aside = up.cross(ahead);
  if (aside.norm() < 1e-9) aside = ahead.unitOrthogonal();
  aside.normalize();
  Eigen::Matrix3d axes;
  axes << aside, ahead.cross(aside), ahead;
  engine::Sim3 pose;
  pose.rotation = engine::Rotation3(axes);
  pose.translation =
      content::BoardMiddle(signpost) + (0.5 + kArrowAboveBoard) * signpost.height * signpost.up;
  pose.scale = signpost.height;
  return pose;
}

engine::Sim3 SignpostPose(const content::Signpost& signpost, const Eigen::Vector3d& eye_in_map) {
  const double up_length = signpost.up.norm();
  const Eigen::Vector3d up =
      up_length > 0 ? Eigen::Vector3d(signpost.up / up_length) : -Eigen::Vector3d::UnitY();
  const Eigen::Vector3d to_reader = eye_in_map - signpost.anchor;
  Eigen::Vector3d front = to_reader - up * up.dot(to_reader);
  if (front.norm() <= 1e-9 * (1.0 + to_reader.norm())) front = up.unitOrthogonal();
  front.normalize();
  Eigen::Matrix3d rotation;
  rotation << up.cross(front), up, front;
  engine::Sim3 pose;
  pose.rotation = engine::Rotation3(rotation);
  pose.translation = signpost.anchor;
  pose.scale = signpost.height;
  return pose;
}

}  // namespace docent::ui
