// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "content/scene.h"
#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"
#include "ui/canvas.h"
#include "ui/letterbox.h"

// Labels: boards with text that are drawn over the image, at the resolution of the canvas, and leader lines
// to what they are about. Nothing hides them, and their texts are readable wherever their boards are drawn.
namespace docent::ui {

// The pose of a label's board for a reader at eye_in_map (map units): the middle of its lower edge is at the
// origin, y is up, the reader is at +z, and the scale is the height of a line of text as it is shown, which
// is at least 1/40 and at most 1/8 of the distance.
engine::Sim3 LabelPose(const content::Label& label, const Eigen::Vector3d& eye_in_map);

// The board's front as a rectangle without content, to be picked and outlined; in units of a line of text.
std::shared_ptr<const content::Model> LabelBoardShape(const std::string& text);

// The opacity of hidden content that is drawn all the same, because an author has selected it.
inline constexpr double kFaintOpacity = 0.35;

// For whom labels are drawn.
struct LabelView {
  const engine::CameraModel& camera;
  const engine::Rigid3& camera_from_map;
  Letterbox image_in_canvas;                // Where the camera's image is in the canvas.
  const std::string& language;              // Of the reader; it chooses the texts (TextFor).
  std::span<const std::string> faint = {};  // Hidden labels that are drawn all the same, faintly, by name.
  std::span<const Eigen::AlignedBox2d> taken =
      {};                    // Parts of the canvas that boards keep clear of, as texts lie there.
  double least_text_px = 0;  // Of the canvas; no text of a label is drawn smaller.
};

// Where the boards of signposts are in the image, about: labels keep clear of them.
std::vector<Eigen::AlignedBox2d> SignBoards(const content::Scene& scene, const engine::CameraModel& camera,
                                            const engine::Rigid3& camera_from_map);

// Whether a reader is so far away that only the point is shown that the label is about, and not its board,
// which would have to be magnified more than fourfold to be read.
bool IsLabelFar(const content::Label& label, const Eigen::Vector3d& eye_in_map);

// A label's board as it was drawn.
struct DrawnBoard {
  std::string entity;         // The label's name.
  Eigen::AlignedBox2d board;  // Pixels of the canvas.
};

// Draws all labels of a scene that are not hidden, and returns their boards. Boards that would cover each
// other are moved apart, at the ends of their leader lines. A label whose board is outside of the image is
// left out; one that is far away (IsLabelFar) is shown as a dot.
std::vector<DrawnBoard> DrawLabels(const content::Scene& scene, const LabelView& view, Canvas* canvas);

}  // namespace docent::ui
