// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"
#include "engine/map/map.h"
#include "engine/tracking/tracked_frame.h"

// A small painted world for the engine's tests: a few flat walls, seen through a CameraModel by casting rays,
// so that every pixel's true place is known. World frame x right, y down, z forward, metres.
namespace docent::engine::testing_world {

// A rectangle: center + x * right + y * down with |x| <= half_width, |y| <= half_height. It is seen from both
// sides. The paint is smooth at the scale of a texel, so that four rays a pixel do not alias.
struct Wall {
  Eigen::Vector3d center, right, down;  // right and down are unit vectors at a right angle
  double half_width = 1, half_height = 1;
  cv::Mat paint;  // CV_32FC1, kTexelSize metres a texel

  Eigen::Vector3d Normal() const { return right.cross(down); }
};
inline constexpr double kTexelSize = 0.004;

class RenderedWorld {
 public:
  explicit RenderedWorld(std::vector<Wall> walls) : walls_(std::move(walls)) {}

  // A back wall three metres away, and before it three smaller ones at other depths and slants.
  static RenderedWorld Room(std::uint64_t seed);
  // One wall straight ahead, large enough to fill any image.
  static RenderedWorld SingleWall(double distance, std::uint64_t seed);

  struct Hit {
    std::size_t wall = 0;
    Eigen::Vector3d point;
  };
  // The first wall along a ray; direction of any length.
  std::optional<Hit> Cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;
  // What the camera shows at a pixel.
  std::optional<Hit> AtPixel(const CameraModel& camera, const Rigid3& camera_from_world,
                             const Eigen::Vector2d& pixel) const;
  // Whether a point of a wall is in the image with nothing before it.
  bool Sees(const CameraModel& camera, const Rigid3& camera_from_world, const Eigen::Vector3d& point,
            double margin_px = 8) const;
  // From a point to the nearest wall, metres.
  double DistanceToSurface(const Eigen::Vector3d& point) const;

  // CV_8UC1; grey 128 where there is no wall. noise_sigma in grey values, drawn under noise_seed.
  cv::Mat Render(const CameraModel& camera, const Rigid3& camera_from_world, double noise_sigma = 0,
                 std::uint64_t noise_seed = 1) const;

  const std::vector<Wall>& walls() const { return walls_; }

 private:
  std::vector<Wall> walls_;
};

// A wall painted with random figures from about 3 to 20 centimetres.
Wall PaintedWall(const Eigen::Vector3d& center, const Eigen::Vector3d& right, const Eigen::Vector3d& down,
                 double half_width, double half_height, std::uint64_t seed);

// A pinhole camera with an image 77 degrees across.
std::shared_ptr<const CameraModel> PinholeCamera(int width_px, int height_px);

// What most tests look through and at, made once: a camera of 320x240 pixels, and a room.
const std::shared_ptr<const CameraModel>& Camera();
const RenderedWorld& World();

// The pose of a camera at a place, turned by a rotation vector in degrees (world_from_camera).
Rigid3 CameraAt(const Eigen::Vector3d& center, const Eigen::Vector3d& turn_deg = Eigen::Vector3d::Zero());

// The image of that number, of a camera that takes thirty a second.
Frame MakeFrame(int index, const cv::Mat& image);
// The same, of what Camera() shows from a pose, with the noise that a sensor has.
Frame MakeFrame(int index, const RenderedWorld& world, const Rigid3& camera_from_world);

KeyFrame MakeKeyFrame(const RenderedWorld& world, const std::shared_ptr<const CameraModel>& camera,
                      const Rigid3& camera_from_world);

// A map without any error: keyframes at these poses, a point for corners of each of them, put on the wall
// that the corner shows, observed exactly where it projects by every keyframe that sees it. Corners at a
// wall's rim are left out, as are those near a point that is there already. The first keyframe is fixed.
Map TrueMap(const RenderedWorld& world, const std::shared_ptr<const CameraModel>& camera,
            const std::vector<Rigid3>& poses,
            std::size_t max_points_a_keyframe = std::numeric_limits<std::size_t>::max());

// The same, published, with those points up to half a metre from where they were whose index is astray.
std::shared_ptr<const MapSnapshot> MapGoneAstray(const RenderedWorld& world,
                                                 const std::shared_ptr<const CameraModel>& camera,
                                                 const std::vector<Rigid3>& views,
                                                 const std::function<bool(std::size_t)>& astray);

}  // namespace docent::engine::testing_world
