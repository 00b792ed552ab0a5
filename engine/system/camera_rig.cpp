// SPDX-License-Identifier: Apache-2.0
#include "engine/system/camera_rig.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "engine/base/median.h"
#include "engine/base/option_check.h"

namespace docent::engine {

namespace {

constexpr double kDegreesPerRadian = 180 / std::numbers::pi;
// For distances in 3D: the median of |x| for a normal x in three dimensions is 1.538 sigma.
constexpr double kSigmaOfMedianDistance = 1 / 1.538;

Eigen::Vector3d GeometricMedian(const std::vector<Rigid3>& poses) {
  // Start at the medians of the coordinates, which are close already.
  Eigen::Vector3d median;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Rigid3& pose : poses) values.push_back(pose.translation[axis]);
    median[axis] = Median(std::move(values));
  }
  for (int iteration = 0; iteration < 20; ++iteration) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double weights = 0;
    for (const Rigid3& pose : poses) {
      const double weight = 1 / std::max(1e-9, (pose.translation - median).norm());
      sum += weight * pose.translation;
      weights += weight;
    }
    median = sum / weights;
  }
  return median;
}

// Starts at the sample with the least sum of angles to the others, so that outliers cannot bias the start.
Rotation3 MedianRotation(const std::vector<Rigid3>& poses) {
  const std::size_t stride = std::max<std::size_t>(1, poses.size() / 40);
  Rotation3 median;
  double least = std::numeric_limits<double>::max();
  for (std::size_t i = 0; i < poses.size(); i += stride) {
    double sum = 0;
    for (std::size_t j = 0; j < poses.size(); j += stride)
      sum += (poses[i].rotation.inverse() * poses[j].rotation).Angle();
    if (sum < least) {
      least = sum;
      median = poses[i].rotation;
    }
  }
  for (int iteration = 0; iteration < 20; ++iteration) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double weights = 0;
    for (const Rigid3& pose : poses) {
      const Eigen::Vector3d step = (median.inverse() * pose.rotation).Log();
      const double weight = 1 / std::max(1e-9, step.norm());
      sum += weight * step;
      weights += weight;
    }
    median = median * Rotation3::Exp(sum / weights);
  }
  return median;
}

Rigid3 Interpolate(const Rigid3& a, const Rigid3& b, double fraction) {
  const Rigid3 a_inverse = a.inverse();
  return Rigid3::Exp(fraction * (b * a_inverse).Log()) * a;
}

}  // namespace

std::optional<std::string> RigOptions::Validate() const {
  return OptionCheck()
      .That(min_samples > 0, "A rig needs at least one sample.")
      .That(window >= min_samples, "The window of a rig must hold the samples that an estimate needs.")
      .AtLeast(viewpoint_rotation_deg, 0, "rotation between viewpoints")
      .Positive(max_rigid_position_sigma, "position sigma of a rigid rig")
      .Positive(max_rigid_rotation_deg, "rotation sigma of a rigid rig")
      .NotNegative(max_gap, "gap between poses of a rig")
      .fault();
}

RigEstimate RobustRelativePose(const std::vector<Rigid3>& second_from_first) {
  // Positions are compared as the first camera's centre in the second one's frame, which is the translation
  // itself and therefore independent of the rotation's noise.
  const Rigid3 median(MedianRotation(second_from_first), GeometricMedian(second_from_first));
  std::vector<double> distances, angles;
  for (const Rigid3& pose : second_from_first) {
    distances.push_back((pose.translation - median.translation).norm());
    angles.push_back((median.rotation.inverse() * pose.rotation).Angle());
  }
  RigEstimate estimate;
  estimate.samples = second_from_first.size();
  estimate.position_sigma = kSigmaOfMedianDistance * Median(distances);
  const double rotation_sigma = kSigmaOfMedianDistance * Median(angles);
  estimate.rotation_sigma_deg = rotation_sigma * kDegreesPerRadian;
  Eigen::Vector3d position = Eigen::Vector3d::Zero(), turn = Eigen::Vector3d::Zero();
  double count = 0;
  for (std::size_t i = 0; i < second_from_first.size(); ++i) {
    if (distances[i] > 3 * estimate.position_sigma || angles[i] > 3 * rotation_sigma) continue;
    position += second_from_first[i].translation;
    turn += (median.rotation.inverse() * second_from_first[i].rotation).Log();
    ++count;
  }
  estimate.second_from_first = median;
  if (count > 0) {
    estimate.second_from_first = Rigid3(median.rotation * Rotation3::Exp(turn / count), position / count);
  }
  return estimate;
}

void CameraRig::Add(int camera, Timestamp time, std::uint64_t map_key, const Rigid3& camera_from_map) {
  if (map_key != map_key_) {
    map_key_ = map_key;
    for (auto& poses : poses_) poses.clear();
    samples_.clear();
    viewpoints_.clear();
    estimate_.reset();
    since_update_ = 0;
  }
  constexpr std::size_t kKept = 12;
  auto& poses = poses_[camera];
  poses.push_back({time, camera_from_map});
  if (poses.size() > kKept) poses.pop_front();
  Match(camera);
}

// Pairs the poses of the other camera that lie between the last two poses of this one.
void CameraRig::Match(int camera) {
  const auto& own = poses_[camera];
  const int other = 1 - camera;
  const Pose& now = own.back();
  const Pose& before = own.size() > 1 ? own[own.size() - 2] : now;
  const bool joined = now.time - before.time <= options_.max_gap;
  for (const Pose& pose : poses_[other]) {
    if (pose.time <= matched_until_[other] || pose.time > now.time) continue;
    const bool same = pose.time == now.time;
    if (!same && (!joined || pose.time <= before.time)) continue;
    matched_until_[other] = pose.time;
    if (same) matched_until_[camera] = now.time;
    const double fraction = same || now.time == before.time
                                ? 1
                                : ToSeconds(pose.time - before.time) / ToSeconds(now.time - before.time);
    const Rigid3 mine = Interpolate(before.camera_from_map, now.camera_from_map, fraction);
    const Rigid3& first = camera == 0 ? mine : pose.camera_from_map;
    const Rigid3& second = camera == 0 ? pose.camera_from_map : mine;
    samples_.push_back(second * first.inverse());
    if (samples_.size() > options_.window) samples_.pop_front();
    const auto near = [&](const Rotation3& seen) {
      return (seen.inverse() * first.rotation).Angle() * kDegreesPerRadian < options_.viewpoint_rotation_deg;
    };
    if (viewpoints_.size() < options_.min_viewpoints &&
        std::none_of(viewpoints_.begin(), viewpoints_.end(), near)) {
      viewpoints_.push_back(first.rotation);
    }
    ++since_update_;
  }
  constexpr std::size_t kBetweenUpdates = 15;
  if (since_update_ >= kBetweenUpdates) Update();
}

void CameraRig::Update() {
  since_update_ = 0;
  if (samples_.size() < options_.min_samples) return;
  RigEstimate estimate = RobustRelativePose({samples_.begin(), samples_.end()});
  estimate.rigid = viewpoints_.size() >= options_.min_viewpoints &&
                   estimate.position_sigma <= options_.max_rigid_position_sigma * estimate.Baseline() &&
                   estimate.rotation_sigma_deg <= options_.max_rigid_rotation_deg;
  estimate_ = estimate;
}

std::optional<Rigid3> CameraRig::Predict(int camera, Timestamp time, std::uint64_t map_key) const {
  const auto& others = poses_[1 - camera];
  if (!estimate_ || !estimate_->rigid || map_key != map_key_ || others.empty()) return std::nullopt;
  const Timestamp age = time - others.back().time;
  if (age > options_.max_gap || age < -options_.max_gap) return std::nullopt;
  const Rigid3& known = others.back().camera_from_map;
  return camera == 1 ? estimate_->second_from_first * known : estimate_->second_from_first.inverse() * known;
}

}  // namespace docent::engine
