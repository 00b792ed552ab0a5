// SPDX-License-Identifier: Apache-2.0
#include "app/session/surface_at_pixel.h"

#include <cmath>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/dense/pixel_distance.h"

namespace docent::app {

namespace {

// What a user points at.
struct PointedAt {
  std::string pixel;                    // In words.
  Eigen::Vector3d origin, ray;          // In the map.
  std::vector<Eigen::Vector3d> points;  // The finite points in view.
};

PointedAt PointAt(const engine::TrackedFrame& frame, const engine::CameraModel& camera,
                  const Eigen::Vector2d& pixel) {
  RequirePose(frame);
  PointedAt at;
  at.pixel = "pixel " + std::to_string(std::lround(pixel.x())) + " " + std::to_string(std::lround(pixel.y()));
  if (!camera.IsInside(pixel, -0.5)) throw Error(at.pixel + " lies outside the image");
  const auto ray = camera.Unproject(pixel);
  if (!ray)
    throw Error("the lens does not see anything at " + at.pixel +
                "; click nearer to the middle of the image");
  for (const engine::MapPoint& point : frame.map->points) {
    if (point.infinite()) continue;
    const auto seen = camera.Project(frame.camera_from_map * point.position());
    if (seen && camera.IsInside(*seen)) at.points.push_back(point.position());
  }
  const engine::Rigid3 map_from_camera = frame.camera_from_map.inverse();
  at.origin = map_from_camera.translation;
  at.ray = map_from_camera.rotation * *ray;
  return at;
}

content::SurfaceHit HitOrError(const content::SurfaceResult& result, const PointedAt& at) {
  if (!result.hit) throw Error("there is no surface at " + at.pixel + ": " + result.reason);
  return *result.hit;
}

// Points of the surface around a pixel whose distances can be measured, for its normal where the map has no
// points.
void AddMeasuredPoints(const engine::TrackedFrame& frame, const engine::CameraModel& camera,
                       const Eigen::Vector2d& pixel, std::vector<Eigen::Vector3d>* points) {
  const double reach_px = camera.width_px() / 50.0;  // Patches that hardly overlap; see PixelDistanceOptions.
  const engine::Rigid3 map_from_camera = frame.camera_from_map.inverse();
  for (const double x : {-1.0, 0.0, 1.0}) {
    for (const double y : {-1.0, 0.0, 1.0}) {
      const Eigen::Vector2d beside = pixel + reach_px * Eigen::Vector2d(x, y);
      const auto ray = camera.Unproject(beside);
      const auto distance =
          engine::MeasureDistance(*frame.map, frame.frame.image, camera, frame.camera_from_map, beside);
      if (ray && distance)
        points->push_back(map_from_camera * Eigen::Vector3d(*distance * ray->normalized()));
    }
  }
}

}  // namespace

void RequirePose(const engine::TrackedFrame& frame) {
  if (!engine::HasPose(frame.state) || !frame.map)
    throw Error("nothing can be placed while the camera is lost; point it at the map first");
}

content::SurfaceHit SurfaceAtPixel(const engine::TrackedFrame& frame, const engine::CameraModel& camera,
                                   const Eigen::Vector2d& pixel) {
  PointedAt at = PointAt(frame, camera, pixel);
  const auto distance =
      engine::MeasureDistance(*frame.map, frame.frame.image, camera, frame.camera_from_map, pixel);
  content::SurfaceResult result = content::FindSurface(at.points, at.origin, at.ray, {}, distance);
  if (distance && result.hit && !result.hit->on_plane) {
    AddMeasuredPoints(frame, camera, pixel, &at.points);
    result = content::FindSurface(at.points, at.origin, at.ray, {}, distance);
  }
  return HitOrError(result, at);
}

content::SurfaceHit PlaneAtPixel(const engine::TrackedFrame& frame, const engine::CameraModel& camera,
                                 const Eigen::Vector2d& pixel) {
  const PointedAt at = PointAt(frame, camera, pixel);
  return HitOrError(content::FindSurface(at.points, at.origin, at.ray), at);
}

}  // namespace docent::app
