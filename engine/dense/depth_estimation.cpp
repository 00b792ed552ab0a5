// SPDX-License-Identifier: Apache-2.0
#include "engine/dense/depth_estimation.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <opencv2/core.hpp>
#include <utility>

#include "engine/base/interrupt.h"
#include "engine/base/option_check.h"
#include "engine/dense/plane_sweep.h"

namespace docent::engine {
namespace {

int LevelFor(const CameraModel& camera, int max_width_px) {
  int level = 0;
  while (level + 1 < kPyramidLevels && (camera.width_px() >> level) > max_width_px) ++level;
  return level;
}

// What other depth maps say of a surface at a point. Those that see something nearer, or whose depth is not
// known there, say nothing.
struct Agreement {
  int agreeing = 0;       // Depth maps that have a surface there.
  int contradicting = 0;  // Depth maps that see something behind the point, and so through it.
};

Agreement CountAgreeing(const Eigen::Vector3d& point_in_map, const std::vector<const DepthMap*>& others,
                        double agreement) {
  Agreement result;
  for (const DepthMap* const other : others) {
    if (other == nullptr) continue;
    const Eigen::Vector3d point_in_camera = other->camera_from_map * point_in_map;
    const auto pixel = other->rays->Project(point_in_camera);
    if (!pixel) continue;
    const double expected = 1 / point_in_camera.norm(), found = InverseDistanceAt(*other, *pixel);
    if (found <= 0) continue;
    const double tolerance = agreement * expected + other->step;
    if (std::abs(found - expected) <= tolerance) {
      ++result.agreeing;
    } else if (found < expected) {
      ++result.contradicting;
    }
  }
  return result;
}

// Clears connected regions of less than min_pixels, whose neighbouring inverse distances differ by at most
// max_difference.
void RemoveSmallRegions(int min_pixels, double max_difference, DepthMap* depth) {
  cv::Mat& inverse = depth->inverse_distance;
  cv::Mat seen = cv::Mat::zeros(inverse.size(), CV_8UC1);
  std::vector<cv::Point> region;
  for (int y = 0; y < inverse.rows; ++y) {
    for (int x = 0; x < inverse.cols; ++x) {
      if (seen.at<std::uint8_t>(y, x) != 0 || inverse.at<float>(y, x) <= 0) continue;
      region.assign(1, {x, y});
      seen.at<std::uint8_t>(y, x) = 1;
      for (std::size_t i = 0; i < region.size(); ++i) {
        const cv::Point at = region[i];
        for (const cv::Point& step : {cv::Point(1, 0), cv::Point(-1, 0), cv::Point(0, 1), cv::Point(0, -1)}) {
          const cv::Point next = at + step;
          if (next.x < 0 || next.y < 0 || next.x >= inverse.cols || next.y >= inverse.rows) continue;
          const float value = inverse.at<float>(next);
          if (seen.at<std::uint8_t>(next) != 0 || value <= 0) continue;
          if (std::abs(value - inverse.at<float>(at)) > max_difference) continue;
          seen.at<std::uint8_t>(next) = 1;
          region.push_back(next);
        }
      }
      if (static_cast<int>(region.size()) >= min_pixels) continue;
      for (const cv::Point& pixel : region) {
        inverse.at<float>(pixel) = 0;
        depth->confidence.at<std::uint8_t>(pixel) = 0;
      }
    }
  }
}

}  // namespace

std::optional<std::string> DepthOptions::Validate() const {
  return OptionCheck()
      .Contained(views.Validate())
      .AtLeast(max_width_px, 1, "largest width")
      .Within(max_planes, 16, 1024, "number of planes")
      .Within(min_confidence, 0, 255, "smallest confidence")
      .Within(min_agreeing, 1, 16, "number of depths that agree")
      .Ratio(agreement, "agreement of depths")
      .AtLeast(min_region_px, 0, "size of the smallest region")
      .fault();
}

DepthEstimator::DepthEstimator(std::shared_ptr<const MapSnapshot> map, const DepthOptions& options)
    : map_(std::move(map)), options_(Checked(options)), views_(ChooseDepthViews(*map_, options.views)) {}

std::shared_ptr<const LevelRays> DepthEstimator::RaysOf(const KeyFrame& keyframe) {
  const CameraModel& camera = *keyframe.camera;
  for (const auto& [known, rays] : rays_) {
    if (known == camera) return rays;
  }
  // Each image of a turning rolling shutter has rays of its own, which would take more memory than its depth.
  const auto storage =
      camera == camera.WithoutMotion() ? LevelRays::Storage::kStored : LevelRays::Storage::kComputed;
  auto rays = std::make_shared<const LevelRays>(camera, LevelFor(camera, options_.max_width_px), storage);
  if (rays->is_stored()) rays_.emplace_back(camera, rays);
  return rays;
}

std::optional<DepthMap> DepthEstimator::Estimate(const DepthViews& views,
                                                 const std::atomic<bool>* interrupt) {
  std::vector<std::shared_ptr<const LevelRays>> rays;  // Of the reference, then of its neighbours.
  const auto view_of = [&](KeyFrameId id) {
    const KeyFrame& keyframe = *map_->FindKeyFrame(id);
    keyframe.features->MarkInUse();
    rays.push_back(RaysOf(keyframe));
    const LevelRays& own = *rays.back();
    const cv::Mat& image = keyframe.features->levels[static_cast<std::size_t>(own.level())];
    return SweepView{&image, &own, keyframe.camera_from_map};
  };
  SweepView reference = view_of(views.keyframe);
  std::optional<LevelRays> stored;  // The sweep reads each ray of the reference with every plane.
  if (!reference.rays->is_stored())
    reference.rays = &stored.emplace(*map_->FindKeyFrame(views.keyframe)->camera, reference.rays->level());
  std::vector<SweepView> neighbours;
  for (const KeyFrameId id : views.neighbours) neighbours.push_back(view_of(id));
  const SweepPlanes planes = SpacePlanes(reference, neighbours, views.min_inverse_distance,
                                         views.max_inverse_distance, options_.max_planes);
  const CostVolume volume = SweepCosts(reference, neighbours, planes, interrupt);
  if (IsInterrupted(interrupt)) return std::nullopt;
  PlaneChoice choice = OptimizePlanes(volume, *reference.image, options_.smoothness);

  DepthMap depth;
  depth.keyframe = views.keyframe;
  depth.camera_from_map = reference.camera_from_map;
  depth.rays = rays.front();
  depth.step = planes.step;
  depth.confidence = std::move(choice.confidence);
  depth.inverse_distance = cv::Mat::zeros(choice.plane.size(), CV_32FC1);
  for (int y = 0; y < choice.plane.rows; ++y) {
    for (int x = 0; x < choice.plane.cols; ++x) {
      std::uint8_t& confidence = depth.confidence.at<std::uint8_t>(y, x);
      if (confidence < options_.min_confidence || reference.rays->At(x, y).isZero()) {
        confidence = 0;
      } else {
        depth.inverse_distance.at<float>(y, x) =
            static_cast<float>(planes.InverseDistance(choice.plane.at<float>(y, x)));
      }
    }
  }
  return depth;
}

DepthMap DepthEstimator::KeepConsistent(const DepthMap& depth,
                                        const std::vector<const DepthMap*>& others) const {
  DepthMap kept = depth;
  kept.inverse_distance = depth.inverse_distance.clone();
  kept.confidence = depth.confidence.clone();
  const Rigid3 map_from_camera = depth.camera_from_map.inverse();
  for (int y = 0; y < kept.inverse_distance.rows; ++y) {
    for (int x = 0; x < kept.inverse_distance.cols; ++x) {
      float& inverse = kept.inverse_distance.at<float>(y, x);
      if (inverse <= 0) continue;
      const Eigen::Vector3d point_in_map =
          map_from_camera * Eigen::Vector3d(depth.rays->At(x, y).cast<double>() / inverse);
      const Agreement found = CountAgreeing(point_in_map, others, options_.agreement);
      const int judging = found.agreeing + found.contradicting;
      if (found.agreeing >= std::clamp(judging, 1, options_.min_agreeing)) continue;
      inverse = 0;
      kept.confidence.at<std::uint8_t>(y, x) = 0;
    }
  }
  RemoveSmallRegions(options_.min_region_px, 2 * kept.step, &kept);
  return kept;
}

}  // namespace docent::engine
