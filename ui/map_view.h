// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "content/scene.h"
#include "engine/geometry/rigid3.h"
#include "engine/map/map_snapshot.h"
#include "ui/canvas.h"

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

// An orbit from which the whole map (nine tenths of its points, all its keyframes) is seen in an image of
// these proportions, from above.
Orbit OrbitAbove(const engine::MapSnapshot& map, double width_over_height = 4.0 / 3.0);

// What stands below the title: how much the map has, and how wide the grid is. In units of the map, which are
// metres only where it was started from something of known width; a map does not know of that.
std::string MapViewCounts(const engine::MapSnapshot& map, double grid);

struct MapViewOptions {
  int width_px = 960, height_px = 720;
  int samples = 4;
  int max_texture_px = 1024;
};

// How well a camera that is lost will be found at a place when it looks in a direction: an eighth of a
// circle, red where it never is, green where it always is.
struct PredictedRecall {
  Eigen::Vector3d place = Eigen::Vector3d::Zero();       // map
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  // map, level, unit length: the middle of the eighth
  double side_m = 1;                                     // of the square whose middle is the place
  double share = 0;                                      // of the attempts that succeed
};
Color ShareColor(double share);

// Draws a map from outside: points by level, keyframes as frusta, the content where it stands, a grid and its
// scale. Needs a current context from construction to destruction, on one thread.
class MapView {
 public:
  explicit MapView(const MapViewOptions& options = {});
  ~MapView();
  MapView(const MapView&) = delete;
  MapView& operator=(const MapView&) = delete;

  // scene may be null; title is shown in the corner, empty for none. predicted_recall lies on the floor,
  // under all.
  void Draw(const engine::MapSnapshot& map, const content::Scene* scene, const Orbit& orbit,
            const std::string& title = {}, const std::vector<PredictedRecall>& predicted_recall = {});
  // As Renderer's.
  void Present(int width_px, int height_px);
  void ReadBack(cv::Mat* image);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace docent::ui
