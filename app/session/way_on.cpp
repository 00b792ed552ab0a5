// SPDX-License-Identifier: Apache-2.0
#include "app/session/way_on.h"

#include <cmath>
#include <limits>

namespace docent::app {

namespace {

bool LeadsOn(const content::Entity& entity) {
  return entity.kind == content::Entity::Kind::kSignpost && !entity.hidden && entity.signpost.to_key != 0;
}

// The least number of signposts from where one of the scene's signposts leads to the route's target.
std::optional<int> FewestSignposts(const content::Scene& scene, const RouteState& route) {
  std::optional<int> fewest;
  for (const content::Entity& entity : scene.entities) {
    if (!LeadsOn(entity)) continue;
    const std::optional<int> signposts = route.SignpostsFrom(entity.signpost.to_key);
    if (signposts && (!fewest || *signposts < *fewest)) fewest = signposts;
  }
  return fewest;
}

std::string WayText(const content::Signpost& sign, const RouteState* route, const VisitorStrings& text) {
  if (route == nullptr) return sign.to_map.empty() ? sign.text : Filled(text, text.to, {sign.to_map});
  const RouteStop& target = route->route().stops[*route->Target()];
  if (target.key == sign.to_key) return Filled(text, text.to, {target.name});
  return Filled(text, text.to_through, {target.name, sign.to_map});
}

// An arrow to what is in view: from below, as a way ahead is seen.
ui::EdgeArrow ArrowInto(const engine::CameraModel& camera, const Eigen::Vector2d& pixel) {
  const Eigen::Vector2d below(0.5 * (camera.width_px() - 1), 1.5 * camera.height_px());
  return {pixel, (pixel - below).normalized()};
}

// A signpost that leads on, as a camera sees it.
struct SeenSign {
  const content::Entity* entity = nullptr;
  Eigen::Vector3d board = Eigen::Vector3d::Zero();         // Its middle in the camera frame, map units.
  std::optional<ui::EdgeArrow> arrow;                      // To the board; empty if it is in view.
  double angle = std::numeric_limits<double>::infinity();  // From the optical axis, radians.
};

// Which of two signposts is shown: one in view, then one with a direction, then the nearest one.
bool IsShownBefore(const SeenSign& a, const SeenSign& b) {
  if (a.arrow.has_value() != b.arrow.has_value()) return !a.arrow;
  const bool a_points = a.entity->signpost.direction.has_value(),
             b_points = b.entity->signpost.direction.has_value();
  if (!a.arrow && a_points != b_points) return a_points;
  return a.angle < b.angle;
}

}  // namespace

std::optional<ShownWay> FindWay(const content::Scene& scene, const engine::CameraModel& camera,
                                const engine::Rigid3& camera_from_map, const RouteState* route,
                                const VisitorStrings& strings) {
  const std::optional<int> fewest = route != nullptr ? FewestSignposts(scene, *route) : std::nullopt;
  if (route != nullptr && !fewest) return std::nullopt;
  constexpr double kMargin = 0.04;  // Ratio of the image's width.
  const double margin_px = kMargin * camera.width_px();
  std::optional<SeenSign> nearest;
  for (const content::Entity& entity : scene.entities) {
    if (!LeadsOn(entity)) continue;
    if (route != nullptr && route->SignpostsFrom(entity.signpost.to_key) != fewest) continue;
    // The middle of the board is what has to be seen.
    SeenSign sign;
    sign.entity = &entity;
    sign.board = camera_from_map * content::BoardMiddle(entity.signpost);
    sign.arrow = ui::ArrowTowards(camera, sign.board, margin_px);
    sign.angle = std::atan2(sign.board.head<2>().norm(), sign.board.z());
    if (!nearest || IsShownBefore(sign, *nearest)) nearest = sign;
  }
  if (!nearest) return std::nullopt;
  const content::Signpost& signpost = nearest->entity->signpost;
  ShownWay way;
  way.signpost = nearest->entity->name;
  way.to_map = signpost.to_map;
  way.drawn.text = WayText(signpost, route, strings);
  if (nearest->arrow) {
    way.towards = nearest->board.normalized();
    way.drawn.arrow = *nearest->arrow;
    return way;
  }
  if (!signpost.direction) return std::nullopt;
  way.follows_direction = true;
  way.towards = camera_from_map.rotation * *signpost.direction;
  const auto beyond = ui::ArrowTowards(camera, way.towards, margin_px);
  way.drawn.arrow = beyond ? *beyond : ArrowInto(camera, *camera.Project(way.towards));
  return way;
}

}  // namespace docent::app
