// SPDX-License-Identifier: Apache-2.0
#include "app/evaluation/true_depth.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "engine/base/error.h"

namespace docent::app {

namespace {

constexpr double kDegree = std::numbers::pi / 180;

// The tracked pixels in an image after the first one.
struct TrackedImage {
  engine::Rigid3 now_from_first;
  std::vector<std::optional<Eigen::Vector2d>> rays;  // x / z and y / z in the camera frame.
};

std::optional<Eigen::Vector2d> RayOf(const engine::CameraModel& model, const cv::Point2f& pixel) {
  const std::optional<Eigen::Vector3d> ray = model.Unproject({pixel.x, pixel.y});
  constexpr double kMinZ = 0.2;  // 78 degrees from the optical axis; beyond, x / z grows without bound.
  if (!ray || ray->z() < kMinZ) return std::nullopt;
  return ray->hnormalized();
}

cv::Mat Grey(const cv::Mat& image) {
  if (image.channels() == 1) return image;
  cv::Mat grey;
  cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  return grey;
}

// Tracks pixels from image to image by optical flow.
class Flow {
 public:
  Flow(const cv::Mat& image, const std::vector<Eigen::Vector2f>& pixels)
      : before_(Grey(image)), alive_(pixels.size(), true) {
    for (const Eigen::Vector2f& pixel : pixels) at_.emplace_back(pixel.x(), pixel.y());
  }

  void Track(const cv::Mat& image) {
    cv::Mat now = Grey(image);
    std::vector<cv::Point2f> found;
    std::vector<unsigned char> status;
    std::vector<float> error;
    constexpr int kWindow_px = 15, kLevels = 4;
    cv::calcOpticalFlowPyrLK(before_, now, at_, found, status, error, {kWindow_px, kWindow_px}, kLevels);
    const cv::Rect2f inside(0, 0, static_cast<float>(now.cols - 1), static_cast<float>(now.rows - 1));
    for (std::size_t i = 0; i < at_.size(); ++i) {
      alive_[i] = alive_[i] && status[i] != 0 && inside.contains(found[i]);
      if (alive_[i]) at_[i] = found[i];
    }
    before_ = now;
  }

  double TrackedRatio() const {
    return static_cast<double>(std::count(alive_.begin(), alive_.end(), true)) /
           static_cast<double>(alive_.size());
  }
  bool alive(std::size_t i) const { return alive_[i]; }
  const cv::Point2f& at(std::size_t i) const { return at_[i]; }

 private:
  cv::Mat before_;
  std::vector<cv::Point2f> at_;
  std::vector<bool> alive_;
};

// Reprojection residual of one pixel in one image, in standard deviations. `rotation` is the correction of
// the image's orientation.
struct PixelResidual {
  Eigen::Vector2d first_ray, ray;
  engine::Rigid3 now_from_first;
  double weight;

  template <typename T>
  bool operator()(const T* rotation, const T* inverse_depth, T* residual) const {
    const Eigen::Vector3d rotated =
        now_from_first.rotation * Eigen::Vector3d(first_ray.x(), first_ray.y(), 1);
    const Eigen::Vector3d& t = now_from_first.translation;
    const T point[3] = {rotated.x() + inverse_depth[0] * t.x(), rotated.y() + inverse_depth[0] * t.y(),
                        rotated.z() + inverse_depth[0] * t.z()};
    T seen[3];
    ceres::AngleAxisRotatePoint(rotation, point, seen);
    if (seen[2] < T(1e-2)) seen[2] = T(1e-2);  // Points beside or behind the camera get a large residual.
    residual[0] = weight * (seen[0] / seen[2] - ray.x());
    residual[1] = weight * (seen[1] / seen[2] - ray.y());
    return true;
  }
};

// Prior of an orientation correction: zero, with the uncertainty of the true orientation.
struct RotationPrior {
  double weight;
  template <typename T>
  bool operator()(const T* rotation, T* residual) const {
    for (int i = 0; i < 3; ++i) residual[i] = weight * rotation[i];
    return true;
  }
};

// Linear least squares with the true orientations; empty when no image constrains the depth.
std::optional<double> LinearInverseDepth(const Eigen::Vector2d& first_ray, std::size_t i,
                                         const std::vector<TrackedImage>& images) {
  double product = 0, square = 0;
  for (const TrackedImage& image : images) {
    if (!image.rays[i]) continue;
    const Eigen::Vector3d rotated =
        image.now_from_first.rotation * Eigen::Vector3d(first_ray.x(), first_ray.y(), 1);
    const Eigen::Vector3d& t = image.now_from_first.translation;
    for (int axis = 0; axis < 2; ++axis) {
      const double u = (*image.rays[i])[axis];
      const double slope = t[axis] - u * t.z(), value = u * rotated.z() - rotated[axis];
      product += slope * value;
      square += slope * slope;
    }
  }
  if (!(square > 0)) return std::nullopt;
  return product / square;
}

class Triangulation {
 public:
  Triangulation(const engine::CameraModel& model, const TrueDepthOptions& options,
                const std::vector<TrackedImage>& images, std::vector<std::optional<Eigen::Vector2d>> first)
      : options_(options),
        images_(images),
        first_(std::move(first)),
        weight_(1 / (options.pixel_sigma * model.PixelAngle())) {}

  TrueDepths Solve() {
    inverse_depths_.assign(first_.size(), 0);
    rotations_.assign(images_.size(), {0, 0, 0});
    ceres::Problem problem;
    for (std::size_t i = 0; i < first_.size(); ++i) AddPoint(i, &problem);
    if (problem.NumResidualBlocks() == 0) return TrueDepths(first_.size());
    const double prior = 1 / (options_.orientation_sigma_deg * kDegree);
    for (std::array<double, 3>& rotation : rotations_) {
      if (!problem.HasParameterBlock(rotation.data())) continue;
      problem.AddResidualBlock(new ceres::AutoDiffCostFunction<RotationPrior, 3, 3>(new RotationPrior{prior}),
                               nullptr, rotation.data());
    }
    ceres::Solver::Options solver;
    solver.linear_solver_type = ceres::DENSE_SCHUR;
    solver.logging_type = ceres::SILENT;
    solver.num_threads = 1;
    ceres::Solver::Summary summary;
    ceres::Solve(solver, &problem, &summary);
    TrueDepths depths(first_.size());
    for (std::size_t i = 0; i < first_.size(); ++i) {
      if (summary.IsSolutionUsable()) depths[i] = Depth(i);
    }
    return depths;
  }

 private:
  void AddPoint(std::size_t i, ceres::Problem* problem) {
    if (!first_[i]) return;
    const std::optional<double> start = LinearInverseDepth(*first_[i], i, images_);
    if (!start) return;
    // The initial depth is limited to 0.5 m to 1 km, because the linear estimate is arbitrary when the
    // baseline is tiny, and the optimization does not recover from a depth that is far too small.
    inverse_depths_[i] = std::clamp(*start, 1e-3, 2.0);
    for (std::size_t j = 0; j < images_.size(); ++j) {
      if (!images_[j].rays[i]) continue;
      problem->AddResidualBlock(new ceres::AutoDiffCostFunction<PixelResidual, 2, 3, 1>(new PixelResidual{
                                    *first_[i], *images_[j].rays[i], images_[j].now_from_first, weight_}),
                                new ceres::CauchyLoss(2), rotations_[j].data(), &inverse_depths_[i]);
    }
  }

  // Empty when the pixel was not tracked well, or the camera has not moved at all.
  std::optional<TrueDepth> Depth(std::size_t i) const {
    if (!first_[i]) return std::nullopt;
    double error = 0, baseline_m = 0;
    int seen = 0;
    for (std::size_t j = 0; j < images_.size(); ++j) {
      if (!images_[j].rays[i]) continue;
      double residual[2];
      const PixelResidual pixel{*first_[i], *images_[j].rays[i], images_[j].now_from_first, weight_};
      if (!pixel(rotations_[j].data(), &inverse_depths_[i], residual)) return std::nullopt;
      error += residual[0] * residual[0] + residual[1] * residual[1];
      ++seen;
      baseline_m = std::max(baseline_m, images_[j].now_from_first.translation.norm());
    }
    const bool tracked = seen > 0 && std::sqrt(error / seen) * options_.pixel_sigma <= options_.max_error_px;
    if (!tracked || !(baseline_m > 0)) return std::nullopt;
    const double inverse = inverse_depths_[i];
    const double by_rotation = options_.orientation_sigma_deg * kDegree / baseline_m;
    const double by_centers = inverse * std::numbers::sqrt2 * options_.truth_noise_m / baseline_m;
    return TrueDepth{inverse, std::hypot(by_rotation, by_centers)};
  }

  const TrueDepthOptions& options_;
  const std::vector<TrackedImage>& images_;
  const std::vector<std::optional<Eigen::Vector2d>> first_;
  const double weight_;
  std::vector<double> inverse_depths_;
  std::vector<std::array<double, 3>> rotations_;
};

// Selects `count` images, evenly spaced and including the last one.
std::vector<TrackedImage> Subsample(std::vector<TrackedImage> images, std::size_t count) {
  if (images.size() <= count) return images;
  std::vector<TrackedImage> selected;
  for (std::size_t i = 1; i <= count; ++i)
    selected.push_back(std::move(images[i * images.size() / count - 1]));
  return selected;
}

}  // namespace

std::optional<std::string> TrueDepthOptions::Validate() const {
  if (max_duration <= Timestamp{}) return "the maximum duration must be positive";
  if (!(min_tracked_ratio >= 0 && min_tracked_ratio < 1))
    return "the minimum ratio of tracked pixels must be in [0, 1)";
  if (images < 1) return "at least one image must be used";
  if (!(pixel_sigma > 0) || !(orientation_sigma_deg > 0)) return "standard deviations must be positive";
  if (!(truth_noise_m >= 0)) return "the noise of the truth must not be negative";
  if (!(max_error_px > 0)) return "the maximum error must be positive";
  return std::nullopt;
}

TrueDepths MeasureTrueDepths(CalibratedCamera* camera, const std::vector<TimedPose>& truth,
                             const std::vector<Eigen::Vector2f>& pixels, const TrueDepthOptions& options) {
  if (const auto fault = options.Validate()) throw Error("True depths cannot be measured: " + *fault + ".");
  engine::Frame frame;
  if (pixels.empty() || !camera->source->Next(&frame)) return TrueDepths(pixels.size());
  const auto first_pose = InterpolatePose(truth, frame.time, options.max_time_difference);
  if (!first_pose) return TrueDepths(pixels.size());
  const Timestamp begin = frame.time;
  Flow flow(frame.image, pixels);
  std::vector<std::optional<Eigen::Vector2d>> first;
  for (std::size_t i = 0; i < pixels.size(); ++i) first.push_back(RayOf(*camera->model, flow.at(i)));
  std::vector<TrackedImage> images;
  while (camera->source->Next(&frame) && frame.time - begin <= options.max_duration) {
    flow.Track(frame.image);
    if (flow.TrackedRatio() < options.min_tracked_ratio) break;
    const auto pose = InterpolatePose(truth, frame.time, options.max_time_difference);
    if (!pose) continue;
    TrackedImage image{pose->inverse() * *first_pose, {}};
    for (std::size_t i = 0; i < pixels.size(); ++i)
      image.rays.push_back(flow.alive(i) ? RayOf(*camera->model, flow.at(i)) : std::nullopt);
    images.push_back(std::move(image));
  }
  images = Subsample(std::move(images), static_cast<std::size_t>(options.images));
  return Triangulation(*camera->model, options, images, std::move(first)).Solve();
}

TrueDepths SimulatedTrueDepths(const Simulation& simulation, int frame,
                               const std::vector<Eigen::Vector2f>& pixels) {
  TrueDepths depths;
  const engine::Rigid3 camera_from_world = simulation.world_from_camera(frame).inverse();
  for (const Eigen::Vector2f& pixel : pixels) {
    const auto point = simulation.SurfaceAt(frame, pixel.cast<double>());
    depths.emplace_back();
    if (point) depths.back() = {1 / (camera_from_world * *point).z(), 0};
  }
  return depths;
}

}  // namespace docent::app
