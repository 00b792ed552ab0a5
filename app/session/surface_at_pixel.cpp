// SPDX-License-Identifier: Apache-2.0
#include "app/session/surface_at_pixel.h"

#include <cmath>
#include <string>
#include <vector>

#include "engine/base/error.h"

namespace docent::app {

content::SurfaceHit SurfaceAtPixel(const engine::TrackedFrame& frame, const engine::CameraModel& camera,
                                   const Eigen::Vector2d& pixel) {
  if (!engine::HasPose(frame.state) || !frame.map) {
    throw Error("nothing can be placed while the camera is lost");
  }
  const std::string at =
      "pixel " + std::to_string(std::lround(pixel.x())) + " " + std::to_string(std::lround(pixel.y()));
  if (!camera.IsInside(pixel, -0.5)) throw Error(at + " lies outside the image");
  const auto ray = camera.Unproject(pixel);
  if (!ray) throw Error("the camera model has no ray for " + at);
  std::vector<Eigen::Vector3d> points;
  for (const engine::MapPoint& point : frame.map->points) {
    if (point.infinite()) continue;
    const auto seen = camera.Project(frame.camera_from_map * point.position());
    if (seen && camera.IsInside(*seen)) points.push_back(point.position());
  }
  const engine::Rigid3 map_from_camera = frame.camera_from_map.inverse();
  const content::SurfaceResult result =
      content::FindSurface(points, map_from_camera.translation, map_from_camera.rotation * *ray);
  if (!result.hit) throw Error("there is no surface at " + at + ": " + result.reason);
  return *result.hit;
}

}  // namespace docent::app
