// SPDX-License-Identifier: Apache-2.0
#include "ui/card_targets.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "content/cards.h"
#include "content/picking.h"
#include "ui/label_layout.h"

namespace docent::ui {

namespace {

constexpr double kLeastSize = std::numbers::pi / 180;  // Radians; smaller things are not pointed at.

// What the lens sees of a box that reaches beyond what it sees, as beside a person who stands at it: points
// of its edges, and the points of the image, in a coarse grid, that show its sides. Empty if it sees none.
Eigen::AlignedBox2d SeenOf(const PlacedBox& box, const engine::CameraModel& camera,
                           const engine::Rigid3& camera_from_map) {
  constexpr int kSteps = 32;  // Along an edge.
  Eigen::AlignedBox2d seen;
  for (int corner = 0; corner < 8; ++corner) {
    for (const int bit : {1, 2, 4}) {
      if ((corner & bit) != 0) continue;
      const Eigen::Vector3d from = camera_from_map * box.Corner(corner),
                            to = camera_from_map * box.Corner(corner | bit);
      for (int i = 0; i <= kSteps; ++i) {
        const double t = static_cast<double>(i) / kSteps;
        if (const auto pixel = camera.Project(Eigen::Vector3d((1 - t) * from + t * to))) seen.extend(*pixel);
      }
    }
  }
  const engine::Sim3 box_from_map = box.map_from_box.inverse();
  const engine::Rotation3 map_from_camera = camera_from_map.rotation.inverse();
  const Eigen::Vector3d eye = box_from_map * camera_from_map.OriginInSource();
  for (const double right : {0.0, 0.5, 1.0}) {
    for (const double down : {0.0, 0.5, 1.0}) {
      const Eigen::Vector2d pixel(right * (camera.width_px() - 1), down * (camera.height_px() - 1));
      const auto ray = camera.Unproject(pixel);
      if (!ray) continue;
      const Eigen::Vector3d direction = box_from_map.rotation * (map_from_camera * *ray);
      if (content::IntersectBox({eye, direction}, box.low, box.high)) seen.extend(pixel);
    }
  }
  return seen;
}

// The part of the image that a box covers; empty if it is behind the camera, outside the image, or too small.
std::optional<CardTarget> TargetOf(const PlacedBox& box, const engine::CameraModel& camera,
                                   const engine::Rigid3& camera_from_map) {
  Eigen::AlignedBox2d seen;
  for (int corner = 0; corner < 8; ++corner) {
    const auto pixel = camera.Project(camera_from_map * box.Corner(corner));
    if (!pixel) {
      seen = SeenOf(box, camera, camera_from_map);
      break;
    }
    seen.extend(*pixel);
  }
  if (seen.isEmpty()) return std::nullopt;
  CardTarget target{{}, seen.min(), seen.max()};
  const Eigen::Vector2d last(camera.width_px() - 1, camera.height_px() - 1);
  target.low = target.low.cwiseMax(0.0).cwiseMin(last);
  target.high = target.high.cwiseMax(0.0).cwiseMin(last);
  const Eigen::Vector2d size = target.high - target.low;
  if (size.minCoeff() <= 0 || size.maxCoeff() * camera.PixelAngle() < kLeastSize) return std::nullopt;
  return target;
}

// As DrawLabels draws a label: its board, or a dot; empty where it is left out.
std::optional<CardTarget> TargetOfLabel(const content::Label& label, const PlacedBox& box,
                                        const engine::CameraModel& camera,
                                        const engine::Rigid3& camera_from_map) {
  const Eigen::Vector3d eye = camera_from_map.OriginInSource();
  const auto foot = camera.Project(camera_from_map * LabelPose(label, eye).translation);
  if (!foot || !camera.IsInside(*foot)) return std::nullopt;
  if (!IsLabelFar(label, eye)) return TargetOf(box, camera, camera_from_map);
  const auto dot = camera.Project(camera_from_map * label.anchor);
  if (!dot || !camera.IsInside(*dot)) return std::nullopt;
  const Eigen::Vector2d half = Eigen::Vector2d::Constant(0.75 * kLeastSize / camera.PixelAngle());
  return CardTarget{{}, *dot - half, *dot + half};
}

double AreaOf(const CardTarget& target) {
  return (target.high - target.low).prod();
}

double DistanceTo(const CardTarget& target, const Eigen::Vector2d& pixel) {
  return (pixel - pixel.cwiseMax(target.low).cwiseMin(target.high)).norm();
}

// Moves the boards of labels as they are drawn: apart from each other and from signposts (DrawLabels).
void MoveLabels(const content::Scene& scene, const engine::CameraModel& camera,
                const engine::Rigid3& camera_from_map,
                std::vector<std::pair<const content::Entity*, CardTarget>>* targets) {
  constexpr double kGap_px = 3;
  std::vector<Eigen::AlignedBox2d> boards = SignBoards(scene, camera, camera_from_map);
  std::size_t next = boards.size();
  const Eigen::Vector3d eye = camera_from_map.OriginInSource();
  const auto is_label = [&eye](const auto& target) {
    return target.first->kind == content::Entity::Kind::kLabel && !IsLabelFar(target.first->label, eye);
  };
  for (const auto& target : *targets) {
    if (is_label(target)) boards.emplace_back(target.second.low, target.second.high);
  }
  const Eigen::AlignedBox2d bounds(Eigen::Vector2d::Zero(),
                                   Eigen::Vector2d(camera.width_px(), camera.height_px()));
  const auto placed = LayOutApart(boards, bounds, kGap_px);
  for (auto& target : *targets) {
    if (!is_label(target)) continue;
    target.second.low = placed[next].min();
    target.second.high = placed[next++].max();
  }
}

}  // namespace

std::vector<CardTarget> FindCardTargets(const content::Scene& scene, const engine::CameraModel& camera,
                                        const engine::Rigid3& camera_from_map, EntityShapes* shapes) {
  const Eigen::Vector3d eye = camera_from_map.OriginInSource();
  const Eigen::Vector2d middle(0.5 * (camera.width_px() - 1), 0.5 * (camera.height_px() - 1));
  std::vector<std::pair<const content::Entity*, CardTarget>> found;
  for (const content::Entity& entity : scene.entities) {
    if (!content::HasCard(entity)) continue;
    const auto box = shapes->BoxOf(entity, eye);
    if (!box) continue;
    auto target = entity.kind == content::Entity::Kind::kLabel
                      ? TargetOfLabel(entity.label, *box, camera, camera_from_map)
                      : TargetOf(*box, camera, camera_from_map);
    if (!target) continue;
    target->entity = entity.name;
    found.emplace_back(&entity, *std::move(target));
  }
  MoveLabels(scene, camera, camera_from_map, &found);
  std::vector<CardTarget> targets;
  targets.reserve(found.size());
  for (auto& [entity, target] : found) targets.push_back(std::move(target));
  const auto distance = [&middle](const CardTarget& target) {
    return (0.5 * (target.low + target.high) - middle).norm();
  };
  std::stable_sort(targets.begin(), targets.end(),
                   [&](const CardTarget& a, const CardTarget& b) { return distance(a) < distance(b); });
  return targets;
}

std::vector<CardTarget> MovedToBoards(std::vector<CardTarget> targets, std::span<const DrawnBoard> boards,
                                      const Letterbox& box) {
  for (CardTarget& target : targets) {
    const auto drawn = std::find_if(boards.begin(), boards.end(), [&target](const DrawnBoard& board) {
      return board.entity == target.entity;
    });
    if (drawn == boards.end()) continue;
    target.low = box.ImageFromWindow(drawn->board.min());
    target.high = box.ImageFromWindow(drawn->board.max());
  }
  return targets;
}

std::vector<LabelArea> AreasOfLabels(const content::Scene& scene, const LabelView& view,
                                     std::span<const DrawnBoard> boards) {
  std::vector<LabelArea> areas;
  const Eigen::Vector3d eye = view.camera_from_map.OriginInSource();
  for (const content::Entity& entity : scene.entities) {
    if (entity.kind != content::Entity::Kind::kLabel || !IsLabelFar(entity.label, eye)) continue;
    if (entity.hidden && std::find(view.faint.begin(), view.faint.end(), entity.name) == view.faint.end())
      continue;
    if (const auto dot = TargetOfLabel(entity.label, {}, view.camera, view.camera_from_map))
      areas.push_back({entity.name, {dot->low, dot->high}});
  }
  for (const DrawnBoard& drawn : boards) {
    areas.push_back({drawn.entity,
                     {view.image_in_canvas.ImageFromWindow(drawn.board.min()),
                      view.image_in_canvas.ImageFromWindow(drawn.board.max())}});
  }
  return areas;
}

const CardTarget* TargetAt(const std::vector<CardTarget>& targets, const Eigen::Vector2d& pixel,
                           double margin_px) {
  const CardTarget* best = nullptr;
  std::pair<double, double> least(margin_px, std::numeric_limits<double>::infinity());
  for (const CardTarget& target : targets) {
    const std::pair miss(DistanceTo(target, pixel), AreaOf(target));
    if (miss.first > margin_px || (best != nullptr && miss >= least)) continue;
    best = &target;
    least = miss;
  }
  return best;
}

}  // namespace docent::ui
