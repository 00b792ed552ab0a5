// SPDX-License-Identifier: Apache-2.0
#include "engine/system/calibration_monitor.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "engine/base/option_check.h"

namespace docent::engine {

std::optional<std::string> CalibrationMonitorOptions::Validate() const {
  return OptionCheck()
      .AtLeast(frames_between_samples, 0, "number of frames between samples")
      .AtLeast(rotation_between_samples_deg, 0, "rotation between samples")
      .That(min_ring_matches > 0, "A ring needs at least one match.")
      .That(min_samples > 1, "A ring needs at least two samples.")
      .That(min_rings > 1 && min_rings <= CalibrationMonitor::kRings, "From 2 to 6 rings must be required.")
      .Positive(warning_px, "difference between rings")
      .AtLeast(warning_sigmas, 0, "number of standard deviations")
      .fault();
}

CalibrationMonitor::CalibrationMonitor(std::shared_ptr<const CameraModel> camera,
                                       const CalibrationMonitorOptions& options)
    : camera_(std::move(camera)), options_(Checked(options)) {
  const auto& lens = camera_->intrinsics();
  const double across = std::max(lens.cx, lens.width_px - 1 - lens.cx);
  const double down = std::max(lens.cy, lens.height_px - 1 - lens.cy);
  ring_width_px_ = std::max(1.0, std::hypot(across, down) / kRings);
}

void CalibrationMonitor::Add(const TrackedFrame& frame) {
  if (++frames_since_ < options_.frames_between_samples) return;
  const bool has_position = frame.state == TrackingState::kSixDof || frame.state == TrackingState::kHybrid;
  if (!has_position || frame.quality_class != TrackingQuality::kGood || !frame.map) return;
  constexpr double kDegrees = 180 / std::numbers::pi;
  const Rotation3& now = frame.camera_from_map.rotation;
  if (sampled_at_ &&
      (now * sampled_at_->inverse()).Angle() * kDegrees < options_.rotation_between_samples_deg)
    return;
  frames_since_ = 0;
  sampled_at_ = now;
  Sample(frame);
  if (!is_reported_) Evaluate();
}

void CalibrationMonitor::Evaluate() {
  std::size_t usable_rings = 0, largest = kRings, smallest = kRings;
  for (std::size_t i = 0; i < kRings; ++i) {
    if (profile_[i].samples < options_.min_samples) continue;
    ++usable_rings;
    if (largest == kRings || profile_[i].mean_px > profile_[largest].mean_px) largest = i;
    if (smallest == kRings || profile_[i].mean_px < profile_[smallest].mean_px) smallest = i;
  }
  if (usable_rings < options_.min_rings) return;
  const auto variance_of_mean = [](const Ring& ring) {
    return ring.sigma_px * ring.sigma_px / static_cast<double>(ring.samples);
  };
  const double difference = profile_[largest].mean_px - profile_[smallest].mean_px;
  const double sigma = std::sqrt(variance_of_mean(profile_[largest]) + variance_of_mean(profile_[smallest]));
  if (difference < options_.warning_px || difference < options_.warning_sigmas * sigma) return;
  is_reported_ = true;
  const auto radius = [this](std::size_t ring) { return (static_cast<double>(ring) + 0.5) * ring_width_px_; };
  mismatch_ = Mismatch{radius(largest), std::max(0.0, profile_[largest].mean_px), radius(smallest),
                       std::max(0.0, -profile_[smallest].mean_px)};
}

std::optional<CalibrationMonitor::Mismatch> CalibrationMonitor::TakeMismatch() {
  return std::exchange(mismatch_, std::nullopt);
}

void CalibrationMonitor::Sample(const TrackedFrame& frame) {
  for (auto& ring : residuals_) ring.clear();
  const Eigen::Vector2d center(camera_->intrinsics().cx, camera_->intrinsics().cy);
  std::size_t used = 0;
  for (const PointMatch& match : frame.matches) {
    if (match.level > 1) continue;
    const MapPoint* const point = frame.map->FindPoint(match.point);
    if (point == nullptr || point->infinite()) continue;
    const auto expected = camera_->Project(frame.camera_from_map * point->position());
    if (!expected) continue;
    const Eigen::Vector2d outwards = *expected - center;
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
    const auto median = ring.begin() + static_cast<std::ptrdiff_t>(ring.size() / 2);
    std::nth_element(ring.begin(), median, ring.end());
    sums_[i].sum += *median;
    sums_[i].sum_squares += *median * *median;
    Ring& ring_profile = profile_[i];
    const auto count = static_cast<double>(++ring_profile.samples);
    ring_profile.mean_px = sums_[i].sum / count;
    ring_profile.sigma_px =
        std::sqrt(std::max(0.0, sums_[i].sum_squares / count - ring_profile.mean_px * ring_profile.mean_px));
  }
}

}  // namespace docent::engine
