// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/points/map_descriptors.h"

#include <algorithm>
#include <iterator>

#include "engine/base/option_check.h"
#include "engine/recognition/absolute_pose.h"
#include "engine/vision/descriptor.h"

namespace docent::engine {

std::optional<std::string> AppearanceOptions::Validate() const {
  return OptionCheck()
      .AtLeast(levels_around, 0, "number of further levels of a description")
      .Positive(inlier_px, "inlier threshold of descriptor matches")
      .AtLeast(min_inliers, 4, "number of inliers among descriptor matches")
      .Ratio(min_inlier_ratio, "inlier ratio of descriptor matches")
      .fault();
}

void MapDescriptors::Clear() {
  database_.Clear();
  described_.clear();
}

bool MapDescriptors::UpdateOne(const AppearanceOptions& options, Map* map) {
  for (auto it = described_.begin(); it != described_.end(); ++it) {
    if (map->FindKeyFrame(it->first)) continue;
    database_.RemoveKeyFrame(it->first);
    described_.erase(it);
    return true;
  }
  for (const auto& [id, record] : map->keyframes()) {
    if (record.keyframe.kind == KeyFrameKind::kPanorama) continue;
    finite_.clear();
    for (const Observation& observation : record.observations) {
      const Map::PointRecord* point = map->FindPoint(observation.point);
      if (point && !point->point.infinite()) finite_.push_back(observation.point);
    }
    std::vector<MapPointId>& described = described_[id];
    if (described == finite_) continue;
    std::vector<MapPointId> gone;
    std::set_difference(described.begin(), described.end(), finite_.begin(), finite_.end(),
                        std::back_inserter(gone));
    for (const MapPointId point : gone) database_.RemoveObservation(id, point);
    for (const Observation& observation : record.observations) {
      if (std::binary_search(finite_.begin(), finite_.end(), observation.point) &&
          !std::binary_search(described.begin(), described.end(), observation.point))
        AddObservation(*record.keyframe.features, observation, options.levels_around, &database_);
    }
    described = finite_;
    return true;
  }
  return false;
}

std::optional<Rigid3> MapDescriptors::SuggestPose(const AppearanceOptions& options, const KeyFrame& keyframe,
                                                  std::uint64_t seed, Map* map) const {
  const std::vector<DescribedKeypoint> places = DescribeCorners(*keyframe.features);
  std::vector<Descriptor> queries;
  queries.reserve(places.size());
  for (const DescribedKeypoint& place : places) queries.push_back(place.oriented.descriptor);
  std::vector<Eigen::Vector3d> rays, points;
  for (const DescriptorDatabase::Match& match : database_.FindMatches(queries, {})) {
    const Map::PointRecord* point = map->FindPoint(match.entry.point);
    const auto ray = keyframe.camera->Unproject(places[match.query].pixel.cast<double>());
    if (!point || point->point.infinite() || !ray) continue;
    rays.push_back(*ray);
    points.push_back(point->point.position());
  }
  AbsolutePoseOptions pose_options;
  pose_options.pixel_angle = keyframe.camera->PixelAngle();
  pose_options.inlier_px = options.inlier_px;
  pose_options.min_inliers = options.min_inliers;
  pose_options.min_inlier_ratio = options.min_inlier_ratio;
  pose_options.seed = seed;
  const auto pose = EstimateAbsolutePose(rays, points, pose_options);
  if (!pose) return std::nullopt;
  return pose->camera_from_map;
}

}  // namespace docent::engine
