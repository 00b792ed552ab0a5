// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/bundle/map_adjustment.h"

#include <cmath>
#include <optional>

#include "engine/base/option_check.h"
#include "engine/mapping/bundle/map_assembly.h"
#include "engine/mapping/panorama/panorama_registration.h"

namespace docent::engine {

namespace {

// The centre that all fixed cameras share; empty if there are several, which determine the scale.
std::optional<Eigen::Vector3d> OnlyFixedCenter(const BundleProblem& problem) {
  std::optional<Eigen::Vector3d> only;
  for (const BundleProblem::Camera& camera : problem.cameras) {
    if (!camera.fixed) continue;
    const Eigen::Vector3d center = camera.camera_from_map.OriginInSource();
    if (only && *only != center) return std::nullopt;
    only = center;
  }
  return only;
}

// Images do not determine the scale: adjustments of whole maps from one fixed centre changed it by 0.1 to 3
// %, and one with eleven keyframes by 13 %. Scales the solution about this centre so that the distances of
// the keyframes are as before in the least-squares sense. The positions of fewer than ten are poorly known:
// an adjustment of two to four changed their distances by up to 18 %, while the points stayed.
void KeepScale(Map* map, MapAssembly* assembly) {
  constexpr std::size_t kManyKeyframes = 10;
  BundleProblem& problem = assembly->problem;
  const auto center = OnlyFixedCenter(problem);
  if (!center || problem.cameras.size() < kManyKeyframes) return;
  double products = 0, squares = 0;
  for (std::size_t i = 0; i < problem.cameras.size(); ++i) {
    const Rigid3& before = map->FindKeyFrame(assembly->cameras[i])->keyframe.camera_from_map;
    const Eigen::Vector3d after = problem.cameras[i].camera_from_map.OriginInSource() - *center;
    products += after.dot(before.OriginInSource() - *center);
    squares += after.squaredNorm();
  }
  const double scale = products / squares;
  if (!(scale > 0) || !std::isfinite(scale)) return;
  const auto scaled = [&](const Eigen::Vector3d& position) -> Eigen::Vector3d {
    return *center + scale * (position - *center);
  };
  for (BundleProblem::Point& point : problem.points) point.position = scaled(point.position);
  for (BundleProblem::Camera& camera : problem.cameras) {
    Rigid3& pose = camera.camera_from_map;
    if (!camera.fixed) pose.translation = -(pose.rotation * scaled(pose.OriginInSource()));
  }
}

BundleSummary Solve(const BundleOptions& options, MapAssembly* assembly, Map* map) {
  const BundleSummary summary = AdjustBundle(options, &assembly->problem);
  KeepScale(map, assembly);
  const PanoramaRegistration registration(*map);
  for (std::size_t i = 0; i < assembly->cameras.size(); ++i) {
    if (!assembly->problem.cameras[i].fixed) {
      map->FindKeyFrame(assembly->cameras[i])->keyframe.camera_from_map =
          assembly->problem.cameras[i].camera_from_map;
    }
  }
  for (std::size_t i = 0; i < assembly->points.size(); ++i) {
    map->FindPoint(assembly->points[i])->point.point_in_map.head<3>() = assembly->problem.points[i].position;
  }
  // Residuals of an interrupted adjustment are not reliable enough to reject measurements.
  if (summary.outcome != BundleSummary::Outcome::kInterrupted) {
    for (const BundleProblem::Measurement& measurement : assembly->problem.measurements) {
      if (measurement.outlier) {
        map->RemoveObservation(assembly->cameras[static_cast<std::size_t>(measurement.camera)],
                               assembly->points[static_cast<std::size_t>(measurement.point)]);
      }
    }
  }
  for (const MapPointId id : assembly->points) {
    if (Map::PointRecord* record = map->FindPoint(id)) map->UpdateNormal(record);
  }
  for (const KeyFrameId id : assembly->cameras) map->UpdateDepth(map->FindKeyFrame(id));
  registration.Follow(map);
  map->NoteMovement();
  return summary;
}

}  // namespace

std::optional<std::string> MapAdjustmentOptions::Validate() const {
  return OptionCheck()
      .AtLeast(window, 0, "number of keyframes of a local adjustment")
      .AtLeast(max_fixed, 0, "number of fixed keyframes of a local adjustment")
      .AtLeast(local_iterations, 1, "number of iterations of a local adjustment")
      .AtLeast(global_iterations, 1, "number of iterations of a global adjustment")
      .fault();
}

BundleSummary AdjustLocally(const MapAdjustmentOptions& options, KeyFrameId keyframe,
                            const std::atomic<bool>* interrupt, Map* map) {
  Checked(options);
  if (!map->FindKeyFrame(keyframe)) return {};
  MapAssembly assembly = AssembleAround(options.window, options.max_fixed, keyframe, map);
  BundleOptions bundle;
  bundle.max_iterations = options.local_iterations;
  bundle.interrupt = interrupt;
  return Solve(bundle, &assembly, map);
}

BundleSummary AdjustGlobally(const MapAdjustmentOptions& options, const std::atomic<bool>* interrupt,
                             Map* map) {
  Checked(options);
  MapAssembly assembly = AssembleAll(map);
  BundleOptions bundle;
  bundle.max_iterations = options.global_iterations;
  bundle.loss = options.global_loss;
  bundle.interrupt = interrupt;
  return Solve(bundle, &assembly, map);
}

}  // namespace docent::engine
