// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/bundle/map_adjustment.h"

#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "engine/base/median.h"
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

// The factor by which the adjusted distances from a centre are as before: in the least-squares sense those of
// the keyframes, if there are ten or more. The positions of fewer are poorly known: an adjustment of two to
// four changed their distances by up to 18 %, and the median distance of the points by 0.4 %.
double ScaleThatKeepsDistances(const MapAssembly& adjusted, const Eigen::Vector3d& center, Map* map) {
  constexpr std::size_t kManyKeyframes = 10;
  const BundleProblem& problem = adjusted.problem;
  if (problem.cameras.size() >= kManyKeyframes) {
    double products = 0, squares = 0;
    for (std::size_t i = 0; i < problem.cameras.size(); ++i) {
      const Rigid3& before = map->FindKeyFrame(adjusted.cameras[i])->keyframe.camera_from_map;
      const Eigen::Vector3d after = problem.cameras[i].camera_from_map.OriginInSource() - center;
      products += after.dot(before.OriginInSource() - center);
      squares += after.squaredNorm();
    }
    return products / squares;
  }
  std::vector<double> ratios;
  ratios.reserve(problem.points.size());
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    const Eigen::Vector3d before = map->FindPoint(adjusted.points[i])->point.position();
    const double ratio = (before - center).norm() / (problem.points[i].position - center).norm();
    if (std::isfinite(ratio)) ratios.push_back(ratio);
  }
  return ratios.empty() ? 1 : Median(std::move(ratios));
}

// Images do not determine the scale: adjustments of whole maps from one fixed centre changed it by 0.1 to 3
// %, and of maps with three to eleven keyframes by 7 to 30 %, so that positions before and after did not fit
// together. Scales the solution about this centre.
void KeepScale(Map* map, MapAssembly* assembly) {
  BundleProblem& problem = assembly->problem;
  const auto center = OnlyFixedCenter(problem);
  if (!center) return;
  const double scale = ScaleThatKeepsDistances(*assembly, *center, map);
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
