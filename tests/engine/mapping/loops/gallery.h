// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "engine/geometry/sim3.h"
#include "engine/map/map.h"
#include "tests/engine/rendered_world.h"

// Cameras go along a gallery of painted panels, each with a smaller panel in front of it. For tests of places
// that were mapped twice, by two maps or by one that has drifted in between.
namespace docent::engine::testing_world {

inline constexpr double kPanelDistance = 2.0;  // metres, from the middle of one panel to that of the next

// Seeds of the panels and of the smaller ones in front of them; equal seeds paint equal panels.
inline RenderedWorld Gallery(const std::vector<std::uint64_t>& panels,
                             const std::vector<std::uint64_t>& stands) {
  std::vector<Wall> walls;
  for (std::size_t i = 0; i < panels.size(); ++i) {
    const double x = kPanelDistance * static_cast<double>(i);
    walls.push_back(PaintedWall({x, 0, 1.3}, {1, 0, 0}, {0, 1, 0}, kPanelDistance / 2, 1.2, panels[i]));
    walls.push_back(PaintedWall({x + 0.3, 0.2, 1.0}, {1, 0, 0}, {0, 1, 0}, 0.2, 0.25, stands[i]));
  }
  return RenderedWorld(std::move(walls));
}

// Four panels, all different.
inline const RenderedWorld& VariedGallery() {
  static const RenderedWorld gallery = Gallery({1, 2, 3, 4}, {11, 12, 13, 14});
  return gallery;
}

inline const std::shared_ptr<const CameraModel>& GalleryCamera() {
  static const auto camera = PinholeCamera(400, 300);
  return camera;
}

// The camera at x metres along the gallery; its height and its direction sway a little.
inline Rigid3 InTheGallery(double x, double height = 0) {
  return CameraAt({x, height + 0.03 * std::sin(5 * x), 0}, {0, 4 * std::sin(3 * x), 0});
}

// A map without error of these poses.
inline Map MapOfGallery(const RenderedWorld& gallery, const std::vector<Rigid3>& poses) {
  return TrueMap(gallery, GalleryCamera(), poses, 150);
}

// Expresses a map in other coordinates.
inline void Transform(const Sim3& after_from_before, Map* map) {
  std::map<KeyFrameId, Sim3> moved;
  for (const auto& [id, record] : map->keyframes()) moved[id] = after_from_before;
  map->Correct(moved);
}

// A stretch of a camera's path that was mapped without knowing the stretches before it.
struct Stretch {
  std::shared_ptr<const MapSnapshot> truth;  // in the coordinates of the gallery
  Sim3 drift;                                // from the true coordinates to those of the map
  // Whether its first keyframe observes the points of the last keyframe before it, as it does if the camera
  // was tracked all the way. Otherwise it shares no points with the other stretches.
  bool continues = true;
};

// One map of several stretches. Keyframe i of a stretch has the id of its first one, which is the number of
// the keyframes before it, plus i.
inline Map MapOfStretches(std::span<const Stretch> stretches) {
  MapSnapshot all;
  const MapSnapshot* before = nullptr;
  for (const Stretch& stretch : stretches) {
    const KeyFrameId first_keyframe = all.next_keyframe;
    const MapPointId first_point = all.next_point;
    // The points of the stretch before this one, as its first keyframe sees them.
    std::vector<Observation> continued;
    if (before && stretch.continues) {
      const MapPointId first_point_before = first_point - before->next_point;
      const Rigid3& pose = stretch.truth->keyframes.front().camera_from_map;
      for (const Observation& observation : before->observations) {
        if (observation.keyframe != before->keyframes.back().id) continue;
        const auto pixel = GalleryCamera()->Project(pose * before->FindPoint(observation.point)->position());
        if (!pixel || !GalleryCamera()->IsInside(*pixel, 8)) continue;
        continued.push_back({first_keyframe, observation.point + first_point_before, pixel->cast<float>(),
                             observation.level});
      }
    }
    Map moved(*stretch.truth);
    Transform(stretch.drift, &moved);
    const auto drifted = moved.Snapshot();
    for (KeyFrame keyframe : drifted->keyframes) {
      keyframe.id += first_keyframe;
      keyframe.fixed = keyframe.id == 0;
      all.keyframes.push_back(std::move(keyframe));
    }
    for (MapPoint point : drifted->points) {
      point.id += first_point;
      point.source_keyframe += first_keyframe;
      all.points.push_back(point);
    }
    for (Observation observation : drifted->observations) {
      observation.keyframe += first_keyframe;
      observation.point += first_point;
      continued.push_back(observation);
    }
    // By ascending keyframe, then point: the points of the stretch before come first.
    all.observations.insert(all.observations.end(), continued.begin(), continued.end());
    all.next_keyframe += drifted->next_keyframe;
    all.next_point += drifted->next_point;
    before = stretch.truth.get();
  }
  return Map(all);
}

}  // namespace docent::engine::testing_world
