// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "content/scene.h"
#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"
#include "ui/entity_shapes.h"
#include "ui/label_board.h"
#include "ui/letterbox.h"
#include "ui/renderer.h"

namespace docent::ui {

// What is in view and has a card (content::HasCard), the nearest to the middle of the image first. What spans
// less than a degree is left out. `shapes` is used as if it was drawn, without its EndFrame.
std::vector<CardTarget> FindCardTargets(const content::Scene& scene, const engine::CameraModel& camera,
                                        const engine::Rigid3& camera_from_map, EntityShapes* shapes);

// The targets with the boards of labels where they were drawn in a canvas: FindCardTargets does not know the
// sizes of their texts and what else they keep clear of. `box`: where the image is in the canvas.
std::vector<CardTarget> MovedToBoards(std::vector<CardTarget> targets, std::span<const DrawnBoard> boards,
                                      const Letterbox& box);

// Where the labels of a scene are in the image as they were drawn, in the order in which DrawLabels draws
// them: first the dots of those that are far away, then the boards that it returned.
std::vector<LabelArea> AreasOfLabels(const content::Scene& scene, const LabelView& view,
                                     std::span<const DrawnBoard> boards);

// The target that a person means by this pixel of the image, who may miss it by `margin_px`: of those that
// contain it the smallest, else the nearest. Null for none.
const CardTarget* TargetAt(const std::vector<CardTarget>& targets, const Eigen::Vector2d& pixel,
                           double margin_px);

}  // namespace docent::ui
