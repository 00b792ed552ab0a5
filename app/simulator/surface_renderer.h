// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "app/simulator/surfaces.h"
#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"

namespace docent::app {

// Ray casting of Surfaces through the camera's own lens, on one core. Every pixel has its exact ray,
// unprojected once at construction, so the picture needs no resampling for the distortion. In the frame of a
// rectangle both its inside test and its inverse distance are linear in the ray; so a tile of pixels keeps
// the rectangles whose linear functions are not negative at all four (slightly widened) corner rays, and only
// these are tried. Pixels at an edge are averaged over four sub-rays. Immutable after construction; Render
// may run on any thread.
class SurfaceRenderer {
 public:
  // surfaces must outlive the renderer.
  SurfaceRenderer(const Surfaces* surfaces, const engine::CameraModel& camera);

  // The picture at a pose, CV_8UC3 in BGR. Pixels that no ray reaches, or whose ray meets nothing, are black.
  void Render(const engine::Rigid3& camera_from_world, cv::Mat* bgr) const;

 private:
  static constexpr int kTile = 16;  // pixels
  static constexpr int kTilePixels = kTile * kTile;
  static constexpr int kGroup = 4;  // tiles along the side of a group
  using CornerRays = Eigen::Matrix<float, 4, 3>;

  struct Rays {
    std::array<float, kTilePixels> x, y, z;  // unit rays in the camera frame; zero where the lens has none
  };
  struct Cone {
    CornerRays corners;
    bool is_known = false;  // all corner rays exist; otherwise nothing may be left out
  };
  // A rectangle in the camera frame: for a ray d, inverse_distance = w . d, and the hit lies inside where
  // |u . d| <= w . d and |v . d| <= w . d; its place is u . d / w . d.
  struct Facet {
    Eigen::Vector3f u, v, w;
    float plane_distance = 0;                                  // from the camera, metres
    float texels_per_metre = 0;                                // of level 0
    float middle_x = 0, middle_y = 0, half_x = 0, half_y = 0;  // texel = middle + half * place
    int rectangle = 0;
  };
  struct Candidate {
    int facet;
    float nearest;  // largest inverse distance within the tile
  };

  Cone ConeOver(const engine::CameraModel& camera, int left, int top, int size) const;
  std::vector<Facet> FacetsFrom(const engine::Rigid3& camera_from_world) const;
  static bool MayShow(const Facet& facet, const Cone& cone);
  void CandidatesOf(const std::vector<Facet>& facets, const std::vector<int>& group, const Cone& cone,
                    std::vector<Candidate>* candidates) const;
  void Trace(const std::vector<Facet>& facets, const std::vector<Candidate>& candidates, const Rays& rays,
             std::array<int, kTilePixels>* nearest) const;
  int TraceOne(const std::vector<Facet>& facets, const std::vector<Candidate>& candidates,
               const Eigen::Vector3f& ray) const;
  cv::Vec3b Shade(const Facet& facet, const Eigen::Vector3f& ray, float pixel_angle) const;
  void ShadeTile(const std::vector<Facet>& facets, const std::vector<Candidate>& candidates,
                 const cv::Mat& nearest, int tile_x, int tile_y, cv::Mat* bgr) const;
  bool IsEdge(const cv::Mat& nearest, int x, int y) const;

  const Surfaces* surfaces_;
  int width_px_, height_px_, tiles_x_, tiles_y_, groups_x_;
  std::vector<Rays> rays_;          // a tile
  std::vector<float> pixel_angle_;  // a tile, radians
  std::vector<Cone> tile_cones_, group_cones_;
};

}  // namespace docent::app
