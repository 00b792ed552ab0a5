// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"
#include "engine/initialization/corner_sequence.h"

namespace docent::engine {

struct TrackBundleOptions {
  int max_corners = 120;  // more take longer
  // Standard deviation of the readout time before anything is known, seconds. Phones take 28 to 61 ms
  // (Ringaby and Forssen 2012), webcams about as long, a global shutter none.
  double prior_sigma_s = 0.03;
  // Smallest standard deviation of a pixel of level 0 that is assumed.
  double min_noise_px = 0.05;
};

// Bundle adjustment of a CornerSequence: all poses, one inverse distance per corner, the readout time of a
// rolling shutter and the errors of a calibration, with the inverse distances eliminated. Each corner lies on
// the ray of its pixel in the first image, and each row of an image sees it from the pose at which it was
// exposed (Im et al., "High Quality Structure from Small Motion for Rolling Shutter Cameras", ICCV 2015).
// Velocities are those between the poses of neighbouring images. The unit of length is the median distance of
// the corners. The state at the beginning: the rotations of the sequence, no translation, one distance for
// all corners (Yu and Gallup, "3D Reconstruction from Accidental Motion", CVPR 2014), no readout time.
// Deterministic. Allocates. Used on one thread.
class TrackBundle {
 public:
  // All three outlive the bundle. camera: without a readout. sequence: at least three images.
  TrackBundle(const TrackBundleOptions& options, const CameraModel& camera, const CornerSequence& sequence);

  std::size_t corners() const { return corners_.size(); }
  // Robust standard deviation of the residuals, in pixels of the level of each corner, and with its minimum.
  double sigma_px() const { return linearized_.sigma_px; }
  double RobustSigma() const;
  const Eigen::Vector2d& readout_s() const { return state_.readout_s; }
  // Of all residuals and priors, with this standard deviation of a pixel.
  double Cost(double sigma) const;

  // Instead of Huber's, which is convex and lets the poses converge: gives corners that drift less weight.
  void UseCauchyLoss() { cauchy_ = true; }
  // Levenberg-Marquardt steps, with the readout time of one axis (0: rows one after another, 1: columns), or
  // with a fixed one.
  void Adjust(std::optional<Eigen::Index> axis, int iterations);
  // By corner, whether it does not belong to a rigid scene, as where a near and a distant edge cross.
  std::vector<char> Outliers() const;
  void Remove(const std::vector<char>& removed);
  // Standard deviation of the readout time of an axis, with the other one fixed.
  double ReadoutSigma(Eigen::Index axis);
  // By image, as in ReadoutMotion.
  std::vector<Eigen::Vector3d> RotationRates() const;

 private:
  // Errors of the calibration: of the focal length, the aspect ratio, the skew, the principal point (2), the
  // radial and the tangential (2) distortion, all as by Brown (1966). While the camera moves uniformly, a
  // rolling shutter looks like some of them.
  static constexpr Eigen::Index kLens = 8, kShared = kLens + 2;  // and both axes of the readout time
  using Lens = Eigen::Matrix<double, kLens, 1>;
  using ByLens = Eigen::Matrix<double, 2, kLens>;
  using ByShared = Eigen::Matrix<double, 2, kShared>;
  using Twist = Eigen::Matrix<double, 6, 1>;

  struct Corner {
    const CornerSequence::Corner* seen;
    Eigen::Vector3d ray;  // in the first image, third coordinate 1
    ByLens ray_by_lens;   // its first two coordinates, negated
  };
  struct State {
    std::vector<Rigid3> poses;              // camera from the first image
    std::vector<double> inverse_distances;  // of the corners, along their rays
    Lens lens = Lens::Zero();
    Eigen::Vector2d readout_s = Eigen::Vector2d::Zero();
  };
  struct Residual {
    Eigen::Vector2d value = Eigen::Vector2d::Zero();  // normalized by the level
    Eigen::Matrix<double, 2, 6> by_pose;              // where the corner is in image k
    Eigen::Matrix<double, 2, 6> by_first_motion;      // the twist per second of the first image
    Eigen::Vector2d by_inverse_distance;
    ByShared by_shared;
    double delay = 0;  // of the exposure in image k, seconds
  };
  // A corner in the first image, in its camera frame and scaled by the inverse distance.
  struct CornerInFirstImage {
    Eigen::Vector2d position;  // as CameraModel::ReadoutPosition
    double delay;              // of the exposure of the corner, seconds
    Eigen::Vector3d ray;       // with the errors of the calibration
    Eigen::Vector3d velocity;  // per second
    Eigen::Vector3d middle;    // where it is at the exposure of the middle row
  };
  // What follows from a state.
  struct Linearization {
    std::vector<Twist> motions;       // by image, left twist per second
    std::vector<Residual> residuals;  // by corner, and by image without the first
    std::vector<char> visible;        // by residual
    std::vector<double> norms;        // of the residuals that are visible
    double sigma_px = 0;
  };
  // A twist per second as a weighted sum of the twists by which poses change.
  struct Weight {
    std::size_t image;
    double per_second;
  };
  using Weights = std::array<Weight, 3>;
  // Derivatives of a residual by the pose of an image.
  struct PoseBlock {
    std::size_t image;
    Eigen::Matrix<double, 2, 6> jacobian;
  };

  static ByLens LensDerivatives(const Eigen::Vector2d& image_point);
  Eigen::Vector2d ImagePoint(const Eigen::Vector2d& pixel) const;
  // The left twist per second of an image is the mean between its neighbours; of the first and the last image
  // it is extrapolated.
  Weights WeightsOf(std::size_t k) const;
  void UpdateMotions();
  Eigen::Vector3d Velocity(std::size_t k, const Eigen::Vector3d& point, double inverse_distance) const;
  double Loss(double x) const;
  double LossWeight(double x) const;
  CornerInFirstImage InFirstImage(const Corner& corner, double inverse_distance) const;
  // Of a corner in image k; points are scaled by the inverse distance of their corner. False if the corner is
  // not in the image.
  bool Linearize(const Corner& corner, double inverse_distance, const CornerInFirstImage& first,
                 std::size_t k, Residual* out) const;
  // Of all residuals in the present state.
  void Linearize();
  // Collects the derivatives of a residual of image k by the poses of images, without the first.
  void CollectBlocks(std::size_t k, const Residual& residual);
  // The normal equations with the inverse distances eliminated: all poses but the first, then the shared
  // parameters.
  void Reduce(double sigma);
  // Solves the reduced equations.
  void Step(std::optional<Eigen::Index> axis, double damping);

  const TrackBundleOptions* options_;
  const CameraModel* camera_;
  std::vector<double> times_s_;
  State state_;
  std::vector<Corner> corners_;
  bool cauchy_ = false;                      // otherwise Huber's loss
  std::vector<Weights> weights_;             // by image
  Eigen::Matrix<double, kShared, 1> prior_;  // inverse variances
  std::vector<PoseBlock> blocks_;            // scratch memory
  Linearization linearized_;                 // the present state
  Linearization linearized_before_;          // the state before the last step; scratch memory
  // Of the last Reduce.
  Eigen::MatrixXd matrix_;  // lower triangle
  Eigen::VectorXd gradient_;
  Eigen::MatrixXd couplings_;  // of each inverse distance, a column
  std::vector<double> hessians_, gradients_;
  Eigen::MatrixXd scaled_couplings_, damped_;  // scratch memory
};

}  // namespace docent::engine
