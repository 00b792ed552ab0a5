// SPDX-License-Identifier: Apache-2.0
#include "ui/label_board.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "ui/label_layout.h"
#include "ui/signpost_model.h"
#include "ui/theme.h"

namespace docent::ui {
namespace {

// Ratios of the distance: 12 pixels in an image of 640 pixels and 65 degrees, and a fifth of its width for a
// word of four letters.
constexpr double kLeastTextAngle = 1.0 / 40, kMostTextAngle = 1.0 / 8;
// A board that has to be magnified more is not drawn, only the point that it is about: from afar, many boards
// would cover each other and the room.
constexpr double kMostMagnification = 4;
// In lines of text.
constexpr double kMaxLineWidth = 18, kMaxTextHeight = 8, kPaddingX = 0.55, kPaddingY = 0.3;
constexpr double kMinTextPx = 8, kMaxTextPx = 120;
// Texts are laid out anew for each size, which changes with every step of the reader: sizes go in steps.
constexpr double kSizeStep = 1.12;

TextStyle LabelStyle(double size_px) {
  TextStyle style;
  style.size_px = size_px;
  style.centered = true;
  style.max_width_px = static_cast<int>(kMaxLineWidth * size_px);
  style.max_height_px = static_cast<int>(kMaxTextHeight * size_px);
  style.color = theme::kText;
  return style;
}

double SteppedSize(double size_px) {
  const double steps =
      std::round(std::log(std::clamp(size_px, kMinTextPx, kMaxTextPx)) / std::log(kSizeStep));
  return std::pow(kSizeStep, steps);
}

// A label as it is drawn, in pixels of the canvas.
struct DrawnLabel {
  Eigen::Vector2d foot;                   // The middle of the board's lower edge.
  std::optional<Eigen::Vector2d> anchor;  // Empty where the lens does not see it.
  double text_px = 0;
};

std::optional<DrawnLabel> Projected(const content::Label& label, const engine::CameraModel& camera,
                                    const engine::Rigid3& camera_from_map, const Letterbox& box) {
  const engine::Sim3 pose = LabelPose(label, camera_from_map.OriginInSource());
  const Eigen::Vector3d foot = camera_from_map * pose.translation;
  const auto pixel = camera.Project(foot);
  if (!pixel || !camera.IsInside(*pixel)) return std::nullopt;
  const auto above = camera.Project(foot - pose.scale * Eigen::Vector3d::UnitY());
  if (!above) return std::nullopt;
  const auto in_canvas = [&](const Eigen::Vector2d& image) -> Eigen::Vector2d {
    return box.WindowFromImage(image) - Eigen::Vector2d(0.5, 0.5);
  };
  DrawnLabel drawn;
  drawn.foot = in_canvas(*pixel);
  drawn.text_px = SteppedSize(box.scale * (*above - *pixel).norm());
  const auto anchor = camera.Project(camera_from_map * label.anchor);
  // The line may leave the image, but not reach far beyond it.
  if (anchor && camera.IsInside(*anchor, -0.5 * camera.width_px())) drawn.anchor = in_canvas(*anchor);
  return drawn;
}

Color Dimmed(Color color, double opacity) {
  color.alpha *= static_cast<float>(opacity);
  return color;
}

// From the anchor to the board, wherever that is.
void DrawLeader(const DrawnLabel& label, const Eigen::AlignedBox2d& board, double opacity, Canvas* canvas) {
  if (!label.anchor) return;
  const double width = std::max(1.5, 0.09 * label.text_px);
  const Color dark = Dimmed({0, 0, 0, 0.5f}, opacity), bright = Dimmed(theme::kText, opacity);
  if (!board.isEmpty()) {
    const bool is_moved =
        std::abs(board.max().y() - label.foot.y()) > 1 || std::abs(board.center().x() - label.foot.x()) > 1;
    const Eigen::Vector2d end =
        is_moved ? Eigen::Vector2d(label.anchor->cwiseMax(board.min()).cwiseMin(board.max())) : label.foot;
    canvas->Line(*label.anchor, end, 2 * width, dark);
    canvas->Line(*label.anchor, end, width, bright);
  }
  canvas->Disk(*label.anchor, 2.6 * width, dark);
  canvas->Disk(*label.anchor, 2 * width, bright);
}

// A label that is drawn, with its text and the place of its board; the board is empty where the label is too
// far away to be read.
struct PlacedLabel {
  DrawnLabel drawn;
  const std::string *entity = nullptr, *text = nullptr;
  TextStyle style;
  double opacity = 1;
  Eigen::AlignedBox2d board;
};

std::vector<PlacedLabel> LabelsInView(const content::Scene& scene, const LabelView& view, Canvas* canvas) {
  std::vector<PlacedLabel> labels;
  const Eigen::Vector3d eye = view.camera_from_map.OriginInSource();
  for (const content::Entity& entity : scene.entities) {
    if (entity.kind != content::Entity::Kind::kLabel) continue;
    if (entity.hidden && std::find(view.faint.begin(), view.faint.end(), entity.name) == view.faint.end())
      continue;
    const auto drawn = Projected(entity.label, view.camera, view.camera_from_map, view.image_in_canvas);
    if (!drawn) continue;
    PlacedLabel label;
    label.drawn = *drawn;
    label.entity = &entity.name;
    label.text = &content::ShownText(entity, view.language);
    label.drawn.text_px = std::max(label.drawn.text_px, view.least_text_px);
    label.style = LabelStyle(label.drawn.text_px);
    label.opacity = entity.hidden ? kFaintOpacity : 1;
    if (!IsLabelFar(entity.label, eye)) {
      const Eigen::Vector2d size = canvas->Measure(*label.text, label.style);
      const Eigen::Vector2d padding = label.drawn.text_px * Eigen::Vector2d(kPaddingX, kPaddingY);
      label.board.min() =
          drawn->foot - Eigen::Vector2d(0.5 * size.x() + padding.x(), size.y() + 2 * padding.y());
      label.board.max() = Eigen::Vector2d(drawn->foot.x() + 0.5 * size.x() + padding.x(), drawn->foot.y());
    }
    labels.push_back(label);
  }
  return labels;
}

// The board as far inside as it fits, so that its text can be read to the end.
Eigen::AlignedBox2d MovedInside(const Eigen::AlignedBox2d& board, const Eigen::AlignedBox2d& bounds) {
  const Eigen::Vector2d low = board.min().cwiseMin(bounds.max() - board.sizes()).cwiseMax(bounds.min());
  return {low, low + board.sizes()};
}

// So that no board covers another one, or one of these, or is cut off at the edge.
void MoveApart(const Canvas& canvas, std::vector<Eigen::AlignedBox2d> boards,
               std::vector<PlacedLabel>* labels) {
  constexpr double kGap = 4;  // Pixels: an edge is seen between two boards.
  std::size_t next = boards.size();
  const Eigen::AlignedBox2d bounds(Eigen::Vector2d::Zero(),
                                   Eigen::Vector2d(canvas.width_px(), canvas.height_px()));
  for (const PlacedLabel& label : *labels) {
    if (!label.board.isEmpty()) boards.push_back(MovedInside(label.board, bounds));
  }
  const auto placed = LayOutApart(boards, bounds, kGap);
  for (PlacedLabel& label : *labels) {
    if (!label.board.isEmpty()) label.board = placed[next++];
  }
}

}  // namespace

bool IsLabelFar(const content::Label& label, const Eigen::Vector3d& eye_in_map) {
  const double distance = (eye_in_map - label.anchor - label.offset).norm();
  return label.text_height * kMostMagnification < kLeastTextAngle * distance;
}

engine::Sim3 LabelPose(const content::Label& label, const Eigen::Vector3d& eye_in_map) {
  content::Signpost board;
  board.anchor = label.anchor + label.offset;
  board.up = label.up;
  const double distance = (eye_in_map - board.anchor).norm();
  board.height = distance > 0
                     ? std::clamp(label.text_height, kLeastTextAngle * distance, kMostTextAngle * distance)
                     : label.text_height;
  return SignpostPose(board, eye_in_map);
}

std::shared_ptr<const content::Model> LabelBoardShape(const std::string& text) {
  constexpr double kLayoutPx = 32;
  const cv::Mat image = DrawText(text, LabelStyle(kLayoutPx));
  const float half_width = static_cast<float>(0.5 * image.cols / kLayoutPx + kPaddingX);
  const float height = static_cast<float>(image.rows / kLayoutPx + 2 * kPaddingY);
  auto model = std::make_shared<content::Model>();
  model->name = "label";
  content::Primitive board;
  for (const glm::vec2& corner : {glm::vec2(-1, 0), glm::vec2(1, 0), glm::vec2(1, 1), glm::vec2(-1, 1)}) {
    content::Vertex vertex;
    vertex.position = glm::vec3(corner.x * half_width, corner.y * height, 0);
    board.vertices.push_back(vertex);
  }
  board.indices = {0, 1, 2, 0, 2, 3};
  model->meshes.push_back({"label", {std::move(board)}});
  content::Node node;
  node.mesh = 0;
  model->nodes.push_back(node);
  model->roots.push_back(0);
  model->bounds_min = glm::vec3(-half_width, 0, 0);
  model->bounds_max = glm::vec3(half_width, height, 0);
  return model;
}

std::vector<Eigen::AlignedBox2d> SignBoards(const content::Scene& scene, const engine::CameraModel& camera,
                                            const engine::Rigid3& camera_from_map) {
  constexpr double kHalfWidth = 0.8;  // Of a usual board, in its heights; its text decides.
  std::vector<Eigen::AlignedBox2d> boards;
  for (const content::Entity& entity : scene.entities) {
    if (entity.kind != content::Entity::Kind::kSignpost || entity.hidden) continue;
    const Eigen::Vector3d middle = camera_from_map * content::BoardMiddle(entity.signpost);
    const auto pixel = camera.Project(middle);
    if (!pixel || !camera.IsInside(*pixel)) continue;
    const auto above = camera.Project(middle - 0.5 * entity.signpost.height * Eigen::Vector3d::UnitY());
    if (!above) continue;
    const double half = (*above - *pixel).norm();
    const Eigen::Vector2d reach(2 * kHalfWidth * half, half);
    boards.emplace_back(*pixel - reach, *pixel + reach);
  }
  return boards;
}

std::vector<DrawnBoard> DrawLabels(const content::Scene& scene, const LabelView& view, Canvas* canvas) {
  std::vector<PlacedLabel> labels = LabelsInView(scene, view, canvas);
  std::vector<Eigen::AlignedBox2d> signs = SignBoards(scene, view.camera, view.camera_from_map);
  for (Eigen::AlignedBox2d& sign : signs)
    sign = {view.image_in_canvas.WindowFromImage(sign.min()),
            view.image_in_canvas.WindowFromImage(sign.max())};
  signs.insert(signs.end(), view.taken.begin(), view.taken.end());
  MoveApart(*canvas, std::move(signs), &labels);
  for (const PlacedLabel& label : labels) DrawLeader(label.drawn, label.board, label.opacity, canvas);
  std::vector<DrawnBoard> boards;
  for (const PlacedLabel& label : labels) {
    if (label.board.isEmpty()) continue;
    boards.push_back({*label.entity, label.board});
    const double text_px = label.drawn.text_px;
    canvas->Box(label.board.min(), label.board.max(), 0.25 * text_px, Dimmed(theme::kHeadsUp, label.opacity));
    canvas->Text(*label.text, label.style,
                 {label.board.center().x(), label.board.min().y() + text_px * kPaddingY}, 0.5, label.opacity);
  }
  return boards;
}

}  // namespace docent::ui
