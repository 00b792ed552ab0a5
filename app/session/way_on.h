// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "app/session/route_state.h"
#include "app/session/visitor_strings.h"
#include "content/scene.h"
#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"
#include "ui/renderer.h"

// Where a visitor can go on. Pure functions; any thread.
namespace docent::app {

// The way that a visitor is shown in an image.
struct ShownWay {
  std::string signpost;  // The name of the signpost that leads on.
  std::string to_map;    // The name of the map that it leads to.
  // The signpost is in view, and the arrow points where one leaves; else it points to the signpost.
  bool follows_direction = false;
  // Where the arrow points: a unit vector in the camera frame.
  Eigen::Vector3d towards = Eigen::Vector3d::UnitZ();
  ui::WayOn drawn;  // The arrow in the image, with its text.
};

// The way to another map: to the nearest signpost that leads to one, if none of those is in view, else in the
// direction of the nearest one in view; empty if none of those in view has a direction, or there is no such
// signpost. Nearest is what the camera has to turn least for. With a route, only those signposts count from
// which the fewest others lead on to its target.
std::optional<ShownWay> FindWay(const content::Scene& scene, const engine::CameraModel& camera,
                                const engine::Rigid3& camera_from_map, const RouteState* route = nullptr,
                                const VisitorStrings& strings = VisitorStringsFor(""));

}  // namespace docent::app
