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

// A small synthetic world for the engine's tests: a few flat textured walls, rendered through a CameraModel
// by ray casting, so that the true 3D point of every pixel is known. World frame: x right, y down, z forward,
// metres.
namespace docent::engine::testing_world {

// A rectangle: center + x * right + y * down with |x| <= half_width, |y| <= half_height, visible from both
// sides. The texture is smooth at the scale of a texel, so that four rays per pixel do not alias.
struct Wall {
  Eigen::Vector3d center, right, down;  // right and down are orthogonal unit vectors
  double half_width = 1, half_height = 1;
  cv::Mat paint;  // CV_32FC1, kTexelSize metres per texel

  Eigen::Vector3d Normal() const { return right.cross(down); }
};
inline constexpr double kTexelSize = 0.004;

class RenderedWorld {
 public:
  explicit RenderedWorld(std::vector<Wall> walls) : walls_(std::move(walls)) {}

  // A back wall three metres away, and three smaller walls in front of it at other depths and slants.
  static RenderedWorld Room(std::uint64_t seed);
  // One wall straight ahead, large enough to fill any image.
  static RenderedWorld SingleWall(double distance, std::uint64_t seed);

  struct Hit {
    std::size_t wall = 0;
    Eigen::Vector3d point;
  };
  // The nearest wall along a ray. The direction need not be normalized.
  std::optional<Hit> Cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;
  // The wall point that a pixel shows.
  std::optional<Hit> AtPixel(const CameraModel& camera, const Rigid3& camera_from_world,
                             const Eigen::Vector2d& pixel) const;
  // Whether a point on a wall is in the image and not occluded.
  bool Sees(const CameraModel& camera, const Rigid3& camera_from_world, const Eigen::Vector3d& point,
            double margin_px = 8) const;
  // The distance in metres from a point to the nearest wall.
  double DistanceToSurface(const Eigen::Vector3d& point) const;

  // A CV_8UC1 image, with grey value 128 where there is no wall. noise_sigma is in grey values; noise_seed
  // seeds
  // the noise.
  cv::Mat Render(const CameraModel& camera, const Rigid3& camera_from_world, double noise_sigma = 0,
                 std::uint64_t noise_seed = 1) const;

  const std::vector<Wall>& walls() const { return walls_; }

 private:
  std::vector<Wall> walls_;
};

// A wall textured with random shapes of about 3 to 20 centimetres.
Wall PaintedWall(const Eigen::Vector3d& center, const Eigen::Vector3d& right, const Eigen::Vector3d& down,
                 double half_width, double half_height, std::uint64_t seed);

// A pinhole camera with a horizontal field of view of 77 degrees.
std::shared_ptr<const CameraModel> PinholeCamera(int width_px, int height_px);

// The camera (320x240 pixels) and the room that most tests use, created once.
const std::shared_ptr<const CameraModel>& Camera();
const RenderedWorld& World();

// The camera_from_world pose of a camera at `center` whose orientation (world_from_camera) is the rotation
// vector `rotation_deg`, in degrees.
Rigid3 CameraAt(const Eigen::Vector3d& center, const Eigen::Vector3d& rotation_deg = Eigen::Vector3d::Zero());

// The frame with this index, with the time stamp of a 30 Hz camera.
Frame MakeFrame(int index, const cv::Mat& image);
// The same, with the image that Camera() takes from this pose, with sensor noise of 1.5 grey values.
Frame MakeFrame(int index, const RenderedWorld& world, const Rigid3& camera_from_world);

KeyFrame MakeKeyFrame(const RenderedWorld& world, const std::shared_ptr<const CameraModel>& camera,
                      const Rigid3& camera_from_world);

// A map without any error: keyframes at these poses, and map points at their keypoints, placed exactly on the
// wall that the keypoint shows and observed exactly where they project by every keyframe that sees them.
// Keypoints at a wall's edge are left out, as are those near an existing point. The first keyframe is fixed.
Map TrueMap(const RenderedWorld& world, const std::shared_ptr<const CameraModel>& camera,
            const std::vector<Rigid3>& poses,
            std::size_t max_points_per_keyframe = std::numeric_limits<std::size_t>::max());

// A snapshot of the same map, in which each point whose index satisfies `displaced` is moved by up to half a
// metre in x and in y.
std::shared_ptr<const MapSnapshot> MapWithDisplacedPoints(const RenderedWorld& world,
                                                          const std::shared_ptr<const CameraModel>& camera,
                                                          const std::vector<Rigid3>& views,
                                                          const std::function<bool(std::size_t)>& displaced);

}  // namespace docent::engine::testing_world
