// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>

#include "content/scene.h"
#include "engine/geometry/rigid3.h"
#include "engine/map/map_snapshot.h"

namespace docent::ui {

// An eye that circles around a point of the map and always looks at it.
struct Orbit {
  Eigen::Vector3d target = Eigen::Vector3d::Zero();  // map, metres
  double distance_m = 1.0;
  double azimuth =
      0.0;  // radians about the map's up axis; 0: the eye is where the map's first camera looks from
  double elevation = 1.2;  // radians above the horizon, at most pi / 2 (straight above)
};

// The eye's pose for an orbit. The map's up axis is -y, as everywhere in Docent.
engine::Rigid3 CameraFromMap(const Orbit& orbit);

// An orbit from which the whole map (nine tenths of its points, all its keyframes) is seen in a picture of
// these proportions, from above.
Orbit OrbitAbove(const engine::MapSnapshot& map, double width_over_height = 4.0 / 3.0);

struct MapViewOptions {
  int width_px = 960, height_px = 720;
  int samples = 4;
  int max_texture_px = 1024;
};

// Draws a map from outside: points by level, keyframes as frusta, the content where it stands, a grid and its
// scale. Needs a current context from construction to destruction, on one thread.
class MapView {
 public:
  explicit MapView(const MapViewOptions& options = {});
  ~MapView();
  MapView(const MapView&) = delete;
  MapView& operator=(const MapView&) = delete;

  // scene may be null; title is shown in the corner, empty for none.
  void Draw(const engine::MapSnapshot& map, const content::Scene* scene, const Orbit& orbit,
            const std::string& title = {});
  // As Renderer's.
  void Present(int width_px, int height_px);
  void ReadBack(cv::Mat* picture);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace docent::ui
