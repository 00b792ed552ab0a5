// SPDX-License-Identifier: Apache-2.0
#include "engine/map/map_snapshot.h"

#include <algorithm>
#include <cmath>

namespace docent::engine {

namespace {

template <typename Item, typename Id>
const Item* FindById(const std::vector<Item>& items, Id id) {
  const auto it = std::lower_bound(items.begin(), items.end(), id,
                                   [](const Item& item, Id wanted) { return item.id < wanted; });
  return it != items.end() && it->id == id ? &*it : nullptr;
}

std::string CheckKeyFrames(const MapSnapshot& map) {
  KeyFrameId next = 0;
  for (const KeyFrame& keyframe : map.keyframes) {
    const std::string name = "keyframe " + std::to_string(keyframe.id);
    if (keyframe.id < next || keyframe.id >= map.next_keyframe) return name + " is out of order";
    next = keyframe.id + 1;
    if (!keyframe.camera) return name + " has no camera";
    if (!keyframe.features || keyframe.features->levels[0].empty()) return name + " has no image";
    if (keyframe.features->levels[0].cols != keyframe.camera->width_px() ||
        keyframe.features->levels[0].rows != keyframe.camera->height_px()) {
      return name + " has an image whose size differs from the camera's";
    }
    const auto& pose = keyframe.camera_from_map;
    if (!pose.translation.allFinite() || !pose.rotation.quaternion().coeffs().allFinite() ||
        std::abs(pose.rotation.quaternion().norm() - 1) > 1e-6) {
      return name + " has no valid pose";
    }
    if (!(keyframe.mean_depth > 0) || !std::isfinite(keyframe.mean_depth) || !(keyframe.depth_sigma >= 0) ||
        !std::isfinite(keyframe.depth_sigma)) {
      return name + " has no valid depth";
    }
  }
  return {};
}

std::string CheckPanoramas(const MapSnapshot& map) {
  PanoramaId next = 0;
  for (const PanoramaMap& panorama : map.panoramas) {
    const std::string name = "panorama map " + std::to_string(panorama.id);
    if (panorama.id < next || panorama.id >= map.next_panorama) return name + " is out of order";
    next = panorama.id + 1;
    const KeyFrame* reference = map.FindKeyFrame(panorama.reference);
    if (!reference) return name + " refers to a missing reference keyframe";
    if (reference->kind != KeyFrameKind::kSixDof || reference->panorama != panorama.id)
      return name + " has a reference keyframe that does not belong to it";
  }
  for (const KeyFrame& keyframe : map.keyframes) {
    const bool dependent = keyframe.kind == KeyFrameKind::kPanorama;
    if (keyframe.panorama == kNoId ? dependent : !map.FindPanorama(keyframe.panorama))
      return "keyframe " + std::to_string(keyframe.id) + " refers to a missing panorama map";
  }
  return {};
}

std::string CheckPoints(const MapSnapshot& map) {
  MapPointId next = 0;
  for (const MapPoint& point : map.points) {
    const std::string name = "point " + std::to_string(point.id);
    if (point.id < next || point.id >= map.next_point) return name + " is out of order";
    next = point.id + 1;
    if (!point.point_in_map.allFinite() || (point.point_in_map[3] != 0 && point.point_in_map[3] != 1) ||
        (point.infinite() && std::abs(point.position().norm() - 1) > 1e-6)) {
      return name + " has no valid position";
    }
    if (!point.normal.allFinite()) return name + " has no valid normal";
    if (point.infinite() ? !map.FindPanorama(point.panorama) : point.panorama != kNoId)
      return name + " refers to a missing panorama map";
    const KeyFrame* source = map.FindKeyFrame(point.source_keyframe);
    if (!source) return name + " refers to a missing source keyframe";
    if (point.source_level >= kPyramidLevels) return name + " refers to a missing pyramid level";
    const cv::Mat& level = source->features->levels[point.source_level];
    if (!point.source_pixel.allFinite() || point.source_pixel.minCoeff() < 0 ||
        point.source_pixel.x() > static_cast<float>(level.cols - 1) ||
        point.source_pixel.y() > static_cast<float>(level.rows - 1)) {
      return name + " has its source outside the image";
    }
  }
  return {};
}

std::string CheckObservations(const MapSnapshot& map) {
  const Observation* previous = nullptr;
  for (const Observation& observation : map.observations) {
    const std::string name = "observation of point " + std::to_string(observation.point) + " in keyframe " +
                             std::to_string(observation.keyframe);
    if (previous && (observation.keyframe < previous->keyframe ||
                     (observation.keyframe == previous->keyframe && observation.point <= previous->point))) {
      return name + " is out of order";
    }
    previous = &observation;
    const KeyFrame* keyframe = map.FindKeyFrame(observation.keyframe);
    if (!keyframe) return name + " refers to a missing keyframe";
    if (!map.FindPoint(observation.point)) return name + " refers to a missing point";
    if (observation.level >= kPyramidLevels) return name + " refers to a missing pyramid level";
    if (!observation.pixel.allFinite() || !keyframe->camera->IsInside(observation.pixel.cast<double>())) {
      return name + " lies outside the image";
    }
  }
  return {};
}

}  // namespace

const KeyFrame* MapSnapshot::FindKeyFrame(KeyFrameId id) const {
  return FindById(keyframes, id);
}
const MapPoint* MapSnapshot::FindPoint(MapPointId id) const {
  return FindById(points, id);
}
const PanoramaMap* MapSnapshot::FindPanorama(PanoramaId id) const {
  return FindById(panoramas, id);
}

bool MapSnapshot::HasFinitePoints() const {
  return std::any_of(points.begin(), points.end(), [](const MapPoint& point) { return !point.infinite(); });
}

std::string Validate(const MapSnapshot& map) {
  if (std::string problem = CheckKeyFrames(map); !problem.empty()) return problem;
  if (std::string problem = CheckPanoramas(map); !problem.empty()) return problem;
  if (std::string problem = CheckPoints(map); !problem.empty()) return problem;
  return CheckObservations(map);
}

}  // namespace docent::engine
