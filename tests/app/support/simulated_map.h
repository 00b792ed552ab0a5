// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "app/simulator/simulation.h"
#include "engine/map/map.h"
#include "engine/vision/features.h"

namespace docent::app {

// A map without any error of a simulated scene: keyframes at the true poses of these frames, and map points
// at their keypoints of one pyramid level, exactly on the surface and observed exactly where they are seen.
// The map's frame is the world, so that a map unit is a metre.
inline std::shared_ptr<const engine::MapSnapshot> SimulatedMap(const Simulation& simulation,
                                                               const std::vector<int>& frames) {
  constexpr int kLevel = 1;
  constexpr std::size_t kEvery = 4;  // Of the keypoints; a map has a few hundred per keyframe.
  engine::Map map;
  const auto camera = std::make_shared<const engine::CameraModel>(simulation.camera());
  for (const int frame : frames) {
    engine::KeyFrame keyframe;
    keyframe.time = simulation.time(frame);
    keyframe.camera = camera;
    keyframe.fixed = map.empty();
    keyframe.camera_from_map = simulation.world_from_camera(frame).inverse();
    cv::Mat bgr, gray;
    simulation.Render(frame, &bgr);
    cv::cvtColor(bgr, gray, cv::COLOR_BGR2GRAY);
    keyframe.features = engine::MakeFeatures(gray);
    map.AddKeyFrame(std::move(keyframe));
  }
  for (std::size_t source = 0; source < frames.size(); ++source) {
    const auto source_id = static_cast<engine::KeyFrameId>(source);
    const std::vector<engine::Corner>& corners =
        map.FindKeyFrame(source_id)->keyframe.features->corners[kLevel];
    for (std::size_t i = 0; i < corners.size(); i += kEvery) {
      const Eigen::Vector2d pixel = engine::LevelZeroFromLevel({corners[i].x, corners[i].y}, kLevel);
      const auto surface = simulation.SurfaceAt(frames[source], pixel);
      if (!surface) continue;
      engine::MapPoint point;
      point.point_in_map << *surface, 1;
      point.source_keyframe = source_id;
      point.source_level = kLevel;
      point.source_pixel = Eigen::Vector2f(corners[i].x, corners[i].y);
      const engine::MapPointId id = map.AddPoint(point);
      for (std::size_t other = 0; other < frames.size(); ++other) {
        if (!simulation.IsVisible(frames[other], *surface)) continue;
        const engine::KeyFrame& keyframe = map.FindKeyFrame(static_cast<engine::KeyFrameId>(other))->keyframe;
        const auto seen = camera->Project(keyframe.camera_from_map * *surface);
        if (seen && camera->IsInside(*seen))
          map.AddObservation({keyframe.id, id, seen->cast<float>(), kLevel});
      }
    }
  }
  for (auto& [id, record] : map.keyframes()) map.UpdateDepth(&record);
  return map.Snapshot();
}

// Every frame of a number of them, evenly spaced.
inline std::vector<int> EvenlySpacedFrames(const Simulation& simulation, int count) {
  std::vector<int> frames;
  for (int i = 0; i < count; ++i)
    frames.push_back(i * (simulation.frame_count() - 1) / std::max(1, count - 1));
  return frames;
}

}  // namespace docent::app
