// SPDX-License-Identifier: Apache-2.0
#include "app/session/head_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace docent::app {

namespace {

constexpr double kTau = 2 * std::numbers::pi;

double Bell(double x) {
  return std::exp(-0.5 * x * x);
}

// Points with a place, at most so many, taken evenly.
std::vector<Eigen::Vector3d> SomePoints(const engine::MapSnapshot& map, std::size_t most) {
  std::vector<Eigen::Vector3d> points;
  for (const engine::MapPoint& point : map.points) {
    if (!point.infinite()) points.push_back(point.position());
  }
  if (points.size() <= most) return points;
  std::vector<Eigen::Vector3d> some;
  for (std::size_t i = 0; i < most; ++i) some.push_back(points[i * points.size() / most]);
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
    : range_(range), options_(options), belief_(kYaws) {
  constexpr double kRow_rad = 0.17;
  const double height = range.highest.tilt_rad - range.lowest.tilt_rad;
  const int rows = 1 + static_cast<int>(std::ceil(height / kRow_rad));
  for (int row = 0; row < rows; ++row)
    tilts_.push_back(range.lowest.tilt_rad + (rows == 1 ? 0.5 : row / (rows - 1.0)) * height);
  constexpr std::size_t kMostPoints = 400;
  const std::vector<Eigen::Vector3d> points = SomePoints(map, kMostPoints);
  std::size_t finite = 0;
  for (const engine::MapPoint& point : map.points) finite += !point.infinite();
  const double each = points.empty() ? 0 : static_cast<double>(finite) / static_cast<double>(points.size());
  const Eigen::Vector3d center = carrier_from_map.OriginInSource();
  for (const double tilt : tilts_) {
    for (int yaw = 0; yaw < kYaws; ++yaw) {
      const engine::Rigid3 camera_from_carrier(CarrierFromCamera({yaw * kTau / kYaws, tilt}).inverse(),
                                               Eigen::Vector3d::Zero());
      const engine::Rigid3 camera_from_map = camera_from_carrier * carrier_from_map;
      double likeness = 0;
      for (const engine::KeyFrame& keyframe : map.keyframes) {
        const double depth = std::max(1e-9, keyframe.mean_depth);
        const double shift = (keyframe.camera_from_map.OriginInSource() - center).norm() / depth;
        const double turn = (keyframe.camera_from_map.rotation * camera_from_map.rotation.inverse()).Angle();
        likeness =
            std::max(likeness, Bell(turn / options.likeness_rad) * Bell(shift / options.likeness_shift));
      }
      double visible = 0;
      for (const Eigen::Vector3d& point : points) {
        const auto pixel = camera.Project(camera_from_map * point);
        if (pixel && camera.IsInside(*pixel)) visible += each;
      }
      odds_.push_back(options.best_odds * likeness * std::min(1.0, visible / options.enough_points));
    }
  }
  for (int i = 0; i < kYaws; ++i) {
    const double turned = std::remainder(i * kTau / kYaws, kTau);
    belief_[static_cast<std::size_t>(i)] = (1 - options.anywhere) * Bell(turned / options.turn_sigma_rad) *
                                               kTau / kYaws / options.turn_sigma_rad / std::sqrt(kTau) +
                                           options.anywhere / kYaws;
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

double HeadSearch::OddsIn(double yaw_rad, double tilt_rad) const {
  return odds_[Row(tilt_rad) * kYaws + Column(yaw_rad)];
}

double HeadSearch::Odds(const PanTilt& at) const {
  return OddsIn(at.pan_rad, at.tilt_rad);
}

std::vector<double> HeadSearch::Expected() const {
  std::vector<double> expected(odds_.size(), 0);
  for (std::size_t row = 0; row < tilts_.size(); ++row) {
    for (std::size_t pan = 0; pan < kYaws; ++pan) {
      for (std::size_t turned = 0; turned < kYaws; ++turned)
        expected[row * kYaws + pan] += belief_[turned] * odds_[row * kYaws + (pan + turned) % kYaws];
    }
  }
  return expected;
}

PanTilt HeadSearch::Best() const {
  PanTilt best;
  double most = -1;
  for (const double tilt : tilts_) {
    for (double pan = range_.lowest.pan_rad; pan <= range_.highest.pan_rad; pan += kTau / kYaws) {
      const double odds = OddsIn(pan, tilt);
      if (odds <= most) continue;
      most = odds;
      best = {pan, tilt};
    }
  }
  return best;
}

void HeadSearch::AddEmptyView(const PanTilt& at) {
  double all = 0;
  for (int i = 0; i < kYaws; ++i) {
    double& belief = belief_[static_cast<std::size_t>(i)];
    belief *= 1 - OddsIn(at.pan_rad + i * kTau / kYaws, at.tilt_rad);
    all += belief;
  }
  for (double& belief : belief_) belief /= all;
}

PanTilt HeadSearch::Next(const PanTilt& at) const {
  const std::vector<double> expected = Expected();
  constexpr double kStep_s = 0.15;
  PanTilt next = at;
  double best = -1;
  for (const double tilt : tilts_) {
    for (double pan = range_.lowest.pan_rad; pan <= range_.highest.pan_rad; pan += kTau / kYaws) {
      const PanTilt there{pan, tilt};
      const double way_s = range_.TravelSeconds(at, there);
      const int steps = 1 + static_cast<int>(way_s / kStep_s);
      double in_vain = 1;
      for (int i = 1; i <= steps; ++i) {
        const PanTilt between{at.pan_rad + i * (there.pan_rad - at.pan_rad) / steps,
                              at.tilt_rad + i * (there.tilt_rad - at.tilt_rad) / steps};
        in_vain *= 1 - expected[Row(between.tilt_rad) * kYaws + Column(between.pan_rad)];
      }
      const double soon = (1 - in_vain) / (way_s + options_.dwell_s);
      if (soon <= best) continue;
      best = soon;
      next = there;
    }
  }
  return next;
}

}  // namespace docent::app
