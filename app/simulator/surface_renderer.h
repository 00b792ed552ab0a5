// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "app/simulator/surfaces.h"
#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"

namespace docent::app {

// Ray casting of Surfaces through the camera's own lens, on one core. Every pixel has its exact ray,
// unprojected once at construction, so the image needs no resampling for the distortion. In the frame of a
// rectangle both its inside test and its inverse distance are linear in the ray; so a tile of pixels keeps
// the rectangles whose linear functions are not negative at all four (slightly widened) corner rays, and only
// these are tried. Pixels at an edge are averaged over four sub-rays. Immutable after construction; Render
// may run on any thread.
class SurfaceRenderer {
 public:
  // surfaces must outlive the renderer.
  SurfaceRenderer(const Surfaces* surfaces, const engine::CameraModel& camera);

  // The image at a pose, CV_8UC3 in BGR. Pixels that no ray reaches, or whose ray meets nothing, are black.
  void Render(const engine::Rigid3& camera_from_world, cv::Mat* bgr) const;
  // The same when each row is seen from a pose of its own, as through a rolling shutter; one pose a row. The
  // poses of the sixteen rows of a tile lie within a few pixels of one another. Costs about twice as much.
  void RenderRows(std::span<const engine::Rigid3> camera_from_world, cv::Mat* bgr) const;

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
  // A facet for each rectangle, in their order. One that is seen exactly from the side shows nowhere.
  std::vector<Facet> FacetsFrom(const engine::Rigid3& camera_from_world) const;
  static bool MayShow(const Facet& facet, const Cone& cone);
  void CandidatesOf(const std::vector<Facet>& facets, const std::vector<int>& group, const Cone& cone,
                    std::vector<Candidate>* candidates) const;
  // What the tile of these rows may show: the union over the facets of its outermost rows of either parity.
  void CandidatesOfRows(std::span<const std::vector<Facet>> row_facets, int tile_x, int tile_y,
                        std::vector<Candidate>* candidates) const;
  // The facet (or kNothing) of kCount pixels of a tile from first_pixel on.
  template <int kCount>
  static void Trace(const std::vector<Facet>& facets, const std::vector<Candidate>& candidates,
                    const Rays& rays, int first_pixel, int* nearest);
  // Copies what a tile's pixels show into the map of the whole image.
  void StoreTile(const std::array<int, kTilePixels>& tile_nearest, int tile_x, int tile_y,
                 cv::Mat* nearest) const;
  int TraceOne(const std::vector<Facet>& facets, const std::vector<Candidate>& candidates,
               const Eigen::Vector3f& ray) const;
  cv::Vec3b Shade(const Facet& facet, const Eigen::Vector3f& ray, float pixel_angle) const;
  // facets_of_row: one set of facets for each row of the tile.
  using FacetsOfRow = std::array<const std::vector<Facet>*, kTile>;
  void ShadeTile(const FacetsOfRow& facets_of_row, const std::vector<Candidate>& candidates,
                 const cv::Mat& nearest, int tile_x, int tile_y, cv::Mat* bgr) const;
  bool IsEdge(const cv::Mat& nearest, int x, int y) const;

  const Surfaces* surfaces_;
  int width_px_, height_px_, tiles_x_, tiles_y_, groups_x_;
  std::vector<Rays> rays_;          // a tile
  std::vector<float> pixel_angle_;  // a tile, radians
  std::vector<Cone> tile_cones_, group_cones_;
};

}  // namespace docent::app
