// SPDX-License-Identifier: Apache-2.0
#include "app/session/head_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace docent::app {

namespace {

constexpr double kTau = 2 * std::numbers::pi;

double Gaussian(double x) {
  return std::exp(-0.5 * x * x);
}

// Positions of at most `count` finite points, evenly sampled.
std::vector<Eigen::Vector3d> SampleFinitePoints(const engine::MapSnapshot& map, std::size_t count) {
  std::vector<Eigen::Vector3d> points;
  for (const engine::MapPoint& point : map.points) {
    if (!point.infinite()) points.push_back(point.position());
  }
  if (points.size() <= count) return points;
  std::vector<Eigen::Vector3d> some;
  for (std::size_t i = 0; i < count; ++i) some.push_back(points[i * points.size() / count]);
  return some;
}

}  // namespace

PanTilt TowardPoint(const engine::Rigid3& carrier_from_map, const Eigen::Vector3d& point_in_map) {
  return Toward(carrier_from_map * point_in_map);
}

std::optional<Eigen::Vector3d> GazePoint(const engine::MapSnapshot& map,
                                         const std::vector<engine::MapPointId>& seen) {
  std::array<std::vector<double>, 3> coordinates;
  for (const engine::MapPointId id : seen) {
    const engine::MapPoint* point = map.FindPoint(id);
    if (point == nullptr || point->infinite()) continue;
    for (int axis = 0; axis < 3; ++axis)
      coordinates[static_cast<std::size_t>(axis)].push_back(point->position()[axis]);
  }
  if (coordinates[0].empty()) return std::nullopt;
  Eigen::Vector3d gaze;
  for (int axis = 0; axis < 3; ++axis) {
    auto& values = coordinates[static_cast<std::size_t>(axis)];
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    gaze[axis] = *middle;
  }
  return gaze;
}

HeadSearch::HeadSearch(const PanTiltRange& range, const engine::CameraModel& camera,
                       const engine::MapSnapshot& map, const engine::Rigid3& carrier_from_map,
                       const HeadSearchOptions& options)
    : range_(range), options_(options), yaw_distribution_(kYaws) {
  constexpr double kRow_rad = 0.17;
  const double height = range.highest.tilt_rad - range.lowest.tilt_rad;
  const int rows = 1 + static_cast<int>(std::ceil(height / kRow_rad));
  for (int row = 0; row < rows; ++row)
    tilts_.push_back(range.lowest.tilt_rad + (rows == 1 ? 0.5 : row / (rows - 1.0)) * height);
  constexpr std::size_t kMaxPoints = 400;
  const std::vector<Eigen::Vector3d> points = SampleFinitePoints(map, kMaxPoints);
  std::size_t finite = 0;
  for (const engine::MapPoint& point : map.points) finite += !point.infinite();
  const double each = points.empty() ? 0 : static_cast<double>(finite) / static_cast<double>(points.size());
  const Eigen::Vector3d center = carrier_from_map.OriginInSource();
  for (const double tilt : tilts_) {
    for (int yaw = 0; yaw < kYaws; ++yaw) {
      const engine::Rigid3 camera_from_carrier(CarrierFromCamera({yaw * kTau / kYaws, tilt}).inverse(),
                                               Eigen::Vector3d::Zero());
      const engine::Rigid3 camera_from_map = camera_from_carrier * carrier_from_map;
      double similarity = 0;
      for (const engine::KeyFrame& keyframe : map.keyframes) {
        const double depth = std::max(1e-9, keyframe.mean_depth);
        const double shift = (keyframe.camera_from_map.OriginInSource() - center).norm() / depth;
        const double turn = (keyframe.camera_from_map.rotation * camera_from_map.rotation.inverse()).Angle();
        similarity = std::max(similarity, Gaussian(turn / options.view_rotation_sigma_rad) *
                                              Gaussian(shift / options.view_shift_sigma));
      }
      double visible = 0;
      for (const Eigen::Vector3d& point : points) {
        const auto pixel = camera.Project(camera_from_map * point);
        if (pixel && camera.IsInside(*pixel)) visible += each;
      }
      probabilities_.push_back(options.max_probability * similarity *
                               std::min(1.0, visible / options.sufficient_points));
    }
  }
  for (int i = 0; i < kYaws; ++i) {
    const double yaw = std::remainder(i * kTau / kYaws, kTau);
    yaw_distribution_[static_cast<std::size_t>(i)] = (1 - options.uniform_weight) *
                                                         Gaussian(yaw / options.yaw_sigma_rad) * kTau /
                                                         kYaws / options.yaw_sigma_rad / std::sqrt(kTau) +
                                                     options.uniform_weight / kYaws;
  }
}

std::size_t HeadSearch::Row(double tilt_rad) const {
  const auto row = std::min_element(tilts_.begin(), tilts_.end(), [&](double a, double b) {
    return std::abs(a - tilt_rad) < std::abs(b - tilt_rad);
  });
  return static_cast<std::size_t>(row - tilts_.begin());
}

std::size_t HeadSearch::Column(double yaw_rad) {
  return static_cast<std::size_t>(((std::lround(yaw_rad / kTau * kYaws) % kYaws) + kYaws) % kYaws);
}

double HeadSearch::ProbabilityAt(double yaw_rad, double tilt_rad) const {
  return probabilities_[Row(tilt_rad) * kYaws + Column(yaw_rad)];
}

double HeadSearch::RecognitionProbability(const PanTilt& at) const {
  return ProbabilityAt(at.pan_rad, at.tilt_rad);
}

std::vector<double> HeadSearch::ExpectedProbabilities() const {
  std::vector<double> expected(probabilities_.size(), 0);
  for (std::size_t row = 0; row < tilts_.size(); ++row) {
    for (std::size_t pan = 0; pan < kYaws; ++pan) {
      for (std::size_t yaw = 0; yaw < kYaws; ++yaw)
        expected[row * kYaws + pan] +=
            yaw_distribution_[yaw] * probabilities_[row * kYaws + (pan + yaw) % kYaws];
    }
  }
  return expected;
}

PanTilt HeadSearch::Best() const {
  PanTilt best;
  double most = -1;
  for (const double tilt : tilts_) {
    for (double pan = range_.lowest.pan_rad; pan <= range_.highest.pan_rad; pan += kTau / kYaws) {
      const double probability = ProbabilityAt(pan, tilt);
      if (probability <= most) continue;
      most = probability;
      best = {pan, tilt};
    }
  }
  return best;
}

void HeadSearch::AddEmptyView(const PanTilt& at) {
  double all = 0;
  for (int i = 0; i < kYaws; ++i) {
    double& weight = yaw_distribution_[static_cast<std::size_t>(i)];
    weight *= 1 - ProbabilityAt(at.pan_rad + i * kTau / kYaws, at.tilt_rad);
    all += weight;
  }
  for (double& weight : yaw_distribution_) weight /= all;
}

PanTilt HeadSearch::Next(const PanTilt& at) const {
  const std::vector<double> expected = ExpectedProbabilities();
  constexpr double kStep_s = 0.15;
  PanTilt next = at;
  double best = -1;
  for (const double tilt : tilts_) {
    for (double pan = range_.lowest.pan_rad; pan <= range_.highest.pan_rad; pan += kTau / kYaws) {
      const PanTilt there{pan, tilt};
      const double travel_s = range_.TravelSeconds(at, there);
      const int steps = 1 + static_cast<int>(travel_s / kStep_s);
      double miss_probability = 1;
      for (int i = 1; i <= steps; ++i) {
        const PanTilt between{at.pan_rad + i * (there.pan_rad - at.pan_rad) / steps,
                              at.tilt_rad + i * (there.tilt_rad - at.tilt_rad) / steps};
        miss_probability *= 1 - expected[Row(between.tilt_rad) * kYaws + Column(between.pan_rad)];
      }
      const double rate = (1 - miss_probability) / (travel_s + options_.dwell_s);
      if (rate <= best) continue;
      best = rate;
      next = there;
    }
  }
  return next;
}

}  // namespace docent::app
