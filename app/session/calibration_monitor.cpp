// SPDX-License-Identifier: Apache-2.0
#include "app/session/calibration_monitor.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <utility>

namespace docent::app {

CalibrationMonitor::CalibrationMonitor(std::shared_ptr<const engine::CameraModel> camera,
                                       const CalibrationMonitorOptions& options)
    : camera_(std::move(camera)), options_(options) {
  const auto& lens = camera_->intrinsics();
  const double across = std::max(lens.cx, lens.width_px - 1 - lens.cx);
  const double down = std::max(lens.cy, lens.height_px - 1 - lens.cy);
  ring_width_px_ = std::max(1.0, std::hypot(across, down) / kRings);
}

void CalibrationMonitor::Add(const engine::TrackedFrame& frame) {
  using engine::TrackingState;
  if (++frames_since_ < options_.frames_between_samples) return;
  const bool placed = frame.state == TrackingState::kSixDof || frame.state == TrackingState::kHybrid;
  if (!placed || frame.quality_class != engine::TrackingQuality::kGood || !frame.map) return;
  constexpr double kDegrees = 180 / std::numbers::pi;
  const engine::Rotation3& now = frame.camera_from_map.rotation;
  if (sampled_at_ && (now * sampled_at_->inverse()).Angle() * kDegrees < options_.turn_between_samples_deg)
    return;
  frames_since_ = 0;
  sampled_at_ = now;
  Sample(frame);
  if (!told_) Judge();
}

void CalibrationMonitor::Judge() {
  std::size_t counting = 0, out = kRings, in = kRings;
  for (std::size_t i = 0; i < kRings; ++i) {
    if (profile_[i].samples < options_.min_samples) continue;
    ++counting;
    if (out == kRings || profile_[i].mean_px > profile_[out].mean_px) out = i;
    if (in == kRings || profile_[i].mean_px < profile_[in].mean_px) in = i;
  }
  if (counting < options_.min_rings) return;
  const auto variance_of_mean = [](const Ring& ring) {
    return ring.sigma_px * ring.sigma_px / static_cast<double>(ring.samples);
  };
  const double difference = profile_[out].mean_px - profile_[in].mean_px;
  const double sigma = std::sqrt(variance_of_mean(profile_[out]) + variance_of_mean(profile_[in]));
  if (difference < options_.told_px || difference < options_.told_sigmas * sigma) return;
  told_ = true;
  const auto radius = [this](std::size_t ring) {
    return std::to_string(std::lround((static_cast<double>(ring) + 0.5) * ring_width_px_));
  };
  char text[400];
  std::snprintf(
      text, sizeof text,
      "The calibration is not this lens's: %s pixels from the middle of the image things are seen "
      "%.1f pixels farther out than it says, and %s pixels from it %.1f pixels farther in. Measure the "
      "lens anew with `docent calibrate`.",
      radius(out).c_str(), std::max(0.0, profile_[out].mean_px), radius(in).c_str(),
      std::max(0.0, -profile_[in].mean_px));
  warning_ = text;
}

std::optional<std::string> CalibrationMonitor::TakeWarning() {
  return std::exchange(warning_, std::nullopt);
}

void CalibrationMonitor::Sample(const engine::TrackedFrame& frame) {
  for (auto& ring : residuals_) ring.clear();
  const Eigen::Vector2d middle(camera_->intrinsics().cx, camera_->intrinsics().cy);
  std::size_t used = 0;
  for (const engine::PointMatch& match : frame.matches) {
    if (match.level > 1) continue;
    const engine::MapPoint* const point = frame.map->FindPoint(match.point);
    if (point == nullptr || point->infinite()) continue;
    const auto expected = camera_->Project(frame.camera_from_map * point->position());
    if (!expected) continue;
    const Eigen::Vector2d outwards = *expected - middle;
    const double radius = outwards.norm();
    if (radius < 1) continue;
    const auto ring = static_cast<std::size_t>(radius / ring_width_px_);
    if (ring >= kRings) continue;
    residuals_[ring].push_back((match.pixel.cast<double>() - *expected).dot(outwards) / radius);
    ++used;
  }
  if (used < options_.min_matches) return;
  for (std::size_t i = 0; i < kRings; ++i) {
    auto& ring = residuals_[i];
    if (ring.size() < options_.min_ring_matches) continue;
    const auto middle_one = ring.begin() + static_cast<std::ptrdiff_t>(ring.size() / 2);
    std::nth_element(ring.begin(), middle_one, ring.end());
    sums_[i].sum += *middle_one;
    sums_[i].sum_squares += *middle_one * *middle_one;
    Ring& told = profile_[i];
    const auto count = static_cast<double>(++told.samples);
    told.mean_px = sums_[i].sum / count;
    told.sigma_px = std::sqrt(std::max(0.0, sums_[i].sum_squares / count - told.mean_px * told.mean_px));
  }
}

}  // namespace docent::app
