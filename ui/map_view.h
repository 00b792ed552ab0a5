// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "content/scene.h"
#include "engine/geometry/rigid3.h"
#include "engine/map/map_snapshot.h"
#include "engine/map/upright_axes.h"
#include "ui/canvas.h"
#include "ui/renderer.h"

namespace docent::ui {

// A viewpoint that circles around a target point of the map and always faces it.
struct Orbit {
  engine::UprightAxes axes;                          // The horizontal plane of the map.
  Eigen::Vector3d target = Eigen::Vector3d::Zero();  // Map coordinates.
  double distance = 1.0;                             // In map units.
  // Radians about the up axis, clockwise seen from above. At 0 the viewpoint lies on the side from which the
  // map's first camera looks.
  double azimuth = 0.0;
  double elevation = 1.2;  // Radians above the horizontal plane, at most pi / 2 (from straight above).
};

// The pose of the viewing camera for an orbit.
engine::Rigid3 CameraFromMap(const Orbit& orbit);

// An orbit that shows the whole map (all keyframes and the central nine tenths of the points along each of
// the upright axes) from above, in an image of this aspect ratio.
Orbit OrbitAbove(const engine::MapSnapshot& map, double width_over_height = 4.0 / 3.0);

// The text below the title: the size of the map and the spacing of the grid. The spacing is in map units,
// because a map does not know whether its unit is the metre.
std::string MapViewCounts(const engine::MapSnapshot& map, double grid);

struct MapViewOptions {
  int width_px = 960, height_px = 720;
  int samples = 4;            // As in RendererOptions.
  int max_texture_px = 1024;  // As in RendererOptions.
};

// The predicted recall of relocalization for a lost camera at one place and viewing direction. It is drawn as
// an octant of a disk, from red (never recognized) to green (always recognized).
struct PredictedRecall {
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  // Map coordinates.
  // Unit vector in the map, horizontal: the central direction of the octant.
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  double side = 1;   // Side of the grid cell that is centred on the place, in map units.
  double share = 0;  // Ratio of successful attempts.
};
Color RecallColor(double share);

// What a view of a map shows besides the map.
struct MapViewContents {
  const content::Scene* scene = nullptr;  // Null for none.
  std::string title;                      // Shown in the corner with the counts; empty for none of both.
  // Drawn on the ground plane, below everything else.
  std::vector<PredictedRecall> predicted_recall;
  // Points are grey instead of coloured by pyramid level, so that colours mean recall only.
  bool grey_points = false;
  // A box in map coordinates whose edges are drawn, for instance where the map ends; empty for none.
  std::optional<Eigen::AlignedBox3d> boundary = std::nullopt;
  // The pose of a camera, drawn above everything else; empty for none.
  std::optional<engine::Rigid3> camera_from_map = std::nullopt;
};

// Draws a map from outside: map points coloured by pyramid level, keyframes as frusta, the content, a grid
// and its spacing. A context must be current from construction to destruction, on one thread.
class MapView {
 public:
  explicit MapView(const MapViewOptions& options = {});
  ~MapView();
  MapView(const MapView&) = delete;
  MapView& operator=(const MapView&) = delete;

  void Draw(const engine::MapSnapshot& map, const Orbit& orbit, const MapViewContents& contents);
  // Shows the last drawing in a part of the default framebuffer, letterboxed.
  void Present(const WindowPart& part);
  // See Renderer::ReadBack.
  void ReadBack(cv::Mat* image);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace docent::ui
