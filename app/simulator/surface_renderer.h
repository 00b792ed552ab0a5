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

// Renders Surfaces by casting rays through the camera's lens, on one core. The exact ray of each pixel is
// unprojected once at construction, so no resampling for the distortion is needed. In the frame of a
// rectangle, the inside test and the inverse distance are linear in the ray. Each tile of pixels therefore
// tests only rectangles whose linear functions can be nonnegative within its four (slightly widened) corner
// rays. Pixels at edges are averaged over four sub-rays. Immutable after construction; Render may run on any
// thread.
class SurfaceRenderer {
 public:
  // `surfaces` must outlive the renderer.
  SurfaceRenderer(const Surfaces* surfaces, const engine::CameraModel& camera);

  // Renders the image at a pose, CV_8UC3 in BGR. Pixels without a ray, or whose ray hits nothing, are black.
  void Render(const engine::Rigid3& camera_from_world, cv::Mat* bgr) const;
  // Renders an image with one pose for each row, as with a rolling shutter. The poses of the sixteen rows of
  // a tile may differ by a few pixels only. Takes about twice as long.
  void RenderRows(std::span<const engine::Rigid3> camera_from_world, cv::Mat* bgr) const;

 private:
  static constexpr int kTile = 16;  // Pixels.
  static constexpr int kTilePixels = kTile * kTile;
  static constexpr int kGroup = 4;  // Tiles along each side of a group.
  using CornerRays = Eigen::Matrix<float, 4, 3>;

  struct Rays {
    std::array<float, kTilePixels> x, y, z;  // Unit rays in the camera frame; zero for pixels without a ray.
  };
  struct Cone {
    CornerRays corners;
    bool is_known = false;  // All corner rays exist; otherwise no rectangle may be skipped.
  };
  // A rectangle in the camera frame: for a ray d, inverse_distance = w . d, and the hit is inside if |u . d|
  // <= w . d and |v . d| <= w . d; its position in the rectangle is (u . d / w . d, v . d / w . d).
  struct Facet {
    Eigen::Vector3f u, v, w;
    float plane_distance = 0;    // Distance of the plane from the camera, metres.
    float texels_per_metre = 0;  // Of level 0.
    float middle_x = 0, middle_y = 0, half_x = 0, half_y = 0;  // texel = middle + half * position.
    int rectangle = 0;
  };
  struct Candidate {
    int facet;
    float nearest;  // Largest inverse distance within the tile.
  };

  Cone ConeOver(const engine::CameraModel& camera, int left, int top, int size) const;
  // One facet for each rectangle, in their order. A rectangle seen exactly edge-on is invisible.
  std::vector<Facet> FacetsFrom(const engine::Rigid3& camera_from_world) const;
  static bool MayShow(const Facet& facet, const Cone& cone);
  void CandidatesOf(const std::vector<Facet>& facets, const std::vector<int>& group, const Cone& cone,
                    std::vector<Candidate>* candidates) const;
  // Candidates of a tile with one pose per row: the union over the facets of its first and last rows of
  // either parity.
  void CandidatesOfRows(std::span<const std::vector<Facet>> row_facets, int tile_x, int tile_y,
                        std::vector<Candidate>* candidates) const;
  // Finds the facet (or kNothing) of kCount pixels of a tile, starting at first_pixel.
  template <int kCount>
  static void Trace(const std::vector<Facet>& facets, const std::vector<Candidate>& candidates,
                    const Rays& rays, int first_pixel, int* nearest);
  // Copies the facets of a tile's pixels into the index image.
  void StoreTile(const std::array<int, kTilePixels>& tile_nearest, int tile_x, int tile_y,
                 cv::Mat* nearest) const;
  int TraceOne(const std::vector<Facet>& facets, const std::vector<Candidate>& candidates,
               const Eigen::Vector3f& ray) const;
  cv::Vec3b Shade(const Facet& facet, const Eigen::Vector3f& ray, float pixel_angle) const;
  // facets_of_row: the facets for each row of the tile.
  using FacetsOfRow = std::array<const std::vector<Facet>*, kTile>;
  void ShadeTile(const FacetsOfRow& facets_of_row, const std::vector<Candidate>& candidates,
                 const cv::Mat& nearest, int tile_x, int tile_y, cv::Mat* bgr) const;
  bool IsEdge(const cv::Mat& nearest, int x, int y) const;

  const Surfaces* surfaces_;
  int width_px_, height_px_, tiles_x_, tiles_y_, groups_x_;
  std::vector<Rays> rays_;          // By tile.
  std::vector<float> pixel_angle_;  // By tile, radians.
  std::vector<Cone> tile_cones_, group_cones_;
};

}  // namespace docent::app
