// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/change_sequence/sequence_changes.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "app/files/text_file.h"
#include "engine/base/error.h"
#include "tests/tools/change_sequence/walking_people.h"

namespace docent::testing {

namespace {

class Blur : public SequenceChange {
 public:
  Blur(double length_px, std::optional<double> angle_rad)
      : length_px_(length_px), along_motion_(!angle_rad), angle_rad_(angle_rad.value_or(0)) {}

  cv::Mat Apply(Timestamp /*time*/, const cv::Mat& image) override {
    if (along_motion_) FollowMotion(image);
    cv::Mat blurred;
    cv::filter2D(image, blurred, -1, LineKernel(length_px_, angle_rad_), {-1, -1}, 0, cv::BORDER_REPLICATE);
    return blurred;
  }

 private:
  // Sets the direction to that of the translation between an image and the one before it (phase correlation).
  // While the image hardly moves, the previous direction is kept.
  void FollowMotion(const cv::Mat& image) {
    cv::Mat grey = image;
    if (image.channels() == 3) cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
    cv::Mat small;
    cv::resize(grey, small, {}, 0.5, 0.5, cv::INTER_AREA);
    small.convertTo(small, CV_32F);
    if (!previous_.empty()) {
      if (window_.empty()) cv::createHanningWindow(window_, small.size(), CV_32F);
      const cv::Point2d motion = cv::phaseCorrelate(previous_, small, window_);
      if (std::hypot(motion.x, motion.y) > kMinMotion_px) angle_rad_ = std::atan2(motion.y, motion.x);
    }
    previous_ = small;
  }

  static constexpr double kMinMotion_px =
      0.25;  // at half resolution; above it the direction is known to about 0.2 rad

  const double length_px_;
  const bool along_motion_;
  double angle_rad_;
  cv::Mat previous_, window_;
};

class Exposure : public SequenceChange {
 public:
  explicit Exposure(double factor) : factor_(factor) {}

  cv::Mat Apply(Timestamp /*time*/, const cv::Mat& image) override {
    cv::Mat changed;
    image.convertTo(changed, -1, factor_);
    return changed;
  }

 private:
  const double factor_;
};

// x' = factor (x - middle) + middle: the focal length and the offset of the principal point from the image
// centre are multiplied by the factor. Distortion coefficients apply to normalized coordinates and do not
// change.
class Tele : public SequenceChange {
 public:
  explicit Tele(double factor) : factor_(factor) {}

  engine::CameraModel Lens(const engine::CameraModel& camera) const override {
    engine::CameraModel::Intrinsics lens = camera.intrinsics();
    const double middle_x = 0.5 * (lens.width_px - 1), middle_y = 0.5 * (lens.height_px - 1);
    lens.fx *= factor_;
    lens.fy *= factor_;
    lens.cx = factor_ * (lens.cx - middle_x) + middle_x;
    lens.cy = factor_ * (lens.cy - middle_y) + middle_y;
    return {camera.lens(), lens, camera.distortion()};
  }

  cv::Mat Apply(Timestamp /*time*/, const cv::Mat& image) override {
    const double middle_x = 0.5 * (image.cols - 1), middle_y = 0.5 * (image.rows - 1);
    const cv::Matx23d source_from_changed(1 / factor_, 0, middle_x * (1 - 1 / factor_), 0, 1 / factor_,
                                          middle_y * (1 - 1 / factor_));
    cv::Mat changed;
    cv::warpAffine(image, changed, source_from_changed, image.size(), cv::INTER_CUBIC | cv::WARP_INVERSE_MAP,
                   cv::BORDER_REPLICATE);
    return changed;
  }

 private:
  const double factor_;
};

class People : public SequenceChange {
 public:
  People(double ratio, const ChangeContext& context) : people_(ratio, context) {}

  cv::Mat Apply(Timestamp time, const cv::Mat& image) override {
    if (!first_) first_ = time;
    cv::Mat changed = image.clone();
    const double time_s = ToSeconds(time - *first_);
    people_.Draw(time_s, &changed);
    const double occluded = people_.OccludedRatio(time_s);
    min_occluded_ = std::min(min_occluded_, occluded);
    max_occluded_ = std::max(max_occluded_, occluded);
    return changed;
  }
  std::string Summary() const override {
    return "people occlude " + app::FormatNumber(100 * min_occluded_, 2) + " to " +
           app::FormatNumber(100 * max_occluded_, 2) + " % of the image";
  }

 private:
  WalkingPeople people_;
  double min_occluded_ = 1, max_occluded_ = 0;
  std::optional<Timestamp> first_;
};

class Rim : public SequenceChange {
 public:
  explicit Rim(double diameter) : diameter_(diameter) {}

  cv::Mat Apply(Timestamp /*time*/, const cv::Mat& image) override {
    if (mask_.empty()) MakeMask(image);
    cv::Mat wide, changed;
    image.convertTo(wide, CV_32F);
    wide = wide.mul(mask_);
    wide.convertTo(changed, image.type());
    return changed;
  }

 private:
  void MakeMask(const cv::Mat& image) {
    const double radius_px = 0.5 * diameter_ * std::hypot(image.cols, image.rows);
    cv::Mat mask(image.size(), CV_32F);
    for (int y = 0; y < mask.rows; ++y) {
      for (int x = 0; x < mask.cols; ++x) {
        const double inside_px =
            radius_px - std::hypot(x - 0.5 * (image.cols - 1), y - 0.5 * (image.rows - 1));
        mask.at<float>(y, x) = static_cast<float>(std::clamp(inside_px / kSoftEdge_px + 0.5, 0.0, 1.0));
      }
    }
    cv::merge(std::vector<cv::Mat>(static_cast<std::size_t>(image.channels()), mask), mask_);
  }

  static constexpr double kSoftEdge_px = 6;  // the edge of the lens is out of focus

  const double diameter_;
  cv::Mat mask_;
};

double NumberIn(const std::string& change, std::string_view text, double low, double high) {
  const auto number = app::ParseNumber(text);
  if (!number || !(*number >= low && *number <= high)) {
    throw Error("The change '" + change + "' needs a number from " + app::FormatNumber(low) + " to " +
                app::FormatNumber(high) + " after the colon.");
  }
  return *number;
}

}  // namespace

cv::Mat LineKernel(double length_px, double angle_rad) {
  const int half = static_cast<int>(std::ceil(0.5 * length_px)) + 1;
  cv::Mat kernel = cv::Mat::zeros(2 * half + 1, 2 * half + 1, CV_32F);
  // Sixteen samples per pixel, each distributed over its four neighbours with bilinear weights.
  const int samples = std::max(1, static_cast<int>(std::lround(16 * length_px)));
  for (int i = 0; i < samples; ++i) {
    const double along = length_px * ((i + 0.5) / samples - 0.5);
    const double x = half + along * std::cos(angle_rad), y = half + along * std::sin(angle_rad);
    const int left = static_cast<int>(std::floor(x)), top = static_cast<int>(std::floor(y));
    const double right_weight = x - left, below_weight = y - top;
    kernel.at<float>(top, left) += static_cast<float>((1 - right_weight) * (1 - below_weight));
    kernel.at<float>(top, left + 1) += static_cast<float>(right_weight * (1 - below_weight));
    kernel.at<float>(top + 1, left) += static_cast<float>((1 - right_weight) * below_weight);
    kernel.at<float>(top + 1, left + 1) += static_cast<float>(right_weight * below_weight);
  }
  return kernel / cv::sum(kernel)[0];
}

std::unique_ptr<SequenceChange> MakeChange(const std::string& text, const ChangeContext& context) {
  const std::size_t colon = std::min(text.find(':'), text.size());
  const std::string name = text.substr(0, colon);
  const std::string_view rest = std::string_view(text).substr(std::min(colon + 1, text.size()));
  if (name == "blur") {
    const std::size_t at = rest.find('@');
    std::optional<double> angle_rad;
    if (at != std::string_view::npos)
      angle_rad = NumberIn(text, rest.substr(at + 1), -360, 360) * std::numbers::pi / 180;
    return std::make_unique<Blur>(NumberIn(text, rest.substr(0, at), 1, 200), angle_rad);
  }
  if (name == "exposure") return std::make_unique<Exposure>(NumberIn(text, rest, 0.01, 100));
  if (name == "tele") return std::make_unique<Tele>(NumberIn(text, rest, 1, 10));
  if (name == "people") return std::make_unique<People>(NumberIn(text, rest, 0.01, 0.9), context);
  if (name == "rim") return std::make_unique<Rim>(NumberIn(text, rest, 0.1, 1));
  throw Error("Unknown change '" + text + "': the changes are blur, exposure, tele, people and rim.");
}

}  // namespace docent::testing
