// SPDX-License-Identifier: Apache-2.0
#include "engine/vision/rotation_alignment.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/core/hal/intrin.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace docent::engine {
namespace {

// Only every kStride-th thumbnail pixel in both directions is compared: thumbnails are blurred, so that the
// pixels between are redundant.
constexpr int kStride = 2;

struct Sample {
  Eigen::Vector3d ray;                             // unit, camera frame
  Eigen::Matrix<float, 2, 3> pixel_from_rotation;  // d thumbnail pixel / d small rotation of the ray
  Eigen::Matrix<float, 2, 3> pixel_from_ray;       // d thumbnail pixel / d ray
  int x = 0, y = 0;                                // thumbnail pixels
  bool valid = false;                              // the lens model has a ray here
};

// The rays and derivatives of the sampled thumbnail pixels of a camera.
struct SampleTable {
  CameraModel camera;
  cv::Size size;
  int scale = 0;
  int columns = 0, rows = 0;  // number of samples
  std::vector<Sample> samples;

  const Sample& Nearest(float x, float y) const {
    const int column = std::min(static_cast<int>(x * (1.0f / kStride)), columns - 1);
    const int row = std::min(static_cast<int>(y * (1.0f / kStride)), rows - 1);
    return samples[static_cast<std::size_t>(row * columns + column)];
  }
};

// Thumbnail pixel u covers image pixels scale * u to scale * (u + 1) - 1.
double ImageFromThumbnail(double x, int scale) {
  return scale * (x + 0.5) - 0.5;
}
double ThumbnailFromImage(double x, int scale) {
  return (x + 0.5) / scale - 0.5;
}

SampleTable MakeSampleTable(const CameraModel& camera, cv::Size size, int scale) {
  SampleTable table{.camera = camera, .size = size, .scale = scale, .samples = {}};
  table.columns = (size.width + kStride - 1) / kStride;
  table.rows = (size.height + kStride - 1) / kStride;
  table.samples.reserve(static_cast<std::size_t>(table.columns * table.rows));
  for (int y = 0; y < size.height; y += kStride) {
    for (int x = 0; x < size.width; x += kStride) {
      Sample sample;
      sample.x = x;
      sample.y = y;
      const auto ray = camera.Unproject({ImageFromThumbnail(x, scale), ImageFromThumbnail(y, scale)});
      Eigen::Vector2d pixel;
      Eigen::Matrix<double, 2, 3> jacobian;
      if (ray && camera.Project(*ray, &pixel, &jacobian)) {
        sample.ray = *ray;
        sample.pixel_from_rotation = (jacobian * -Hat(*ray) / scale).cast<float>();
        sample.pixel_from_ray = (jacobian / scale).cast<float>();
        sample.valid = true;
      }
      table.samples.push_back(sample);
    }
  }
  return table;
}

// The table depends on its key alone, so caching it changes no result; one cache per thread needs no lock. A
// session has at most a few cameras, each with two thumbnail sizes.
const SampleTable& FindSampleTable(const CameraModel& camera, cv::Size size, int scale) {
  constexpr std::size_t kRemembered = 8;
  thread_local std::vector<std::unique_ptr<SampleTable>> tables;
  const auto found = std::find_if(tables.begin(), tables.end(), [&](const auto& table) {
    return table->size == size && table->scale == scale && table->camera == camera;
  });
  if (found != tables.end()) {
    std::rotate(tables.begin(), found, found + 1);
  } else {
    if (tables.size() == kRemembered) tables.pop_back();
    tables.insert(tables.begin(), std::make_unique<SampleTable>(MakeSampleTable(camera, size, scale)));
  }
  return *tables.front();
}

// Grey value and gradient (grey values per thumbnail pixel) in one vector, so that one interpolation reads
// all of them.
struct GradientImage {
  cv::Size size;
  std::vector<Eigen::Vector4f, Eigen::aligned_allocator<Eigen::Vector4f>> texels;  // value, d/dx, d/dy, 0

  explicit GradientImage(const cv::Mat& pixels) : size(pixels.size()) {
    texels.resize(static_cast<std::size_t>(size.area()));
    for (int y = 0; y < size.height; ++y) {
      const int up = std::max(y - 1, 0), down = std::min(y + 1, size.height - 1);
      const float* row = pixels.ptr<float>(y);
      const float* row_up = pixels.ptr<float>(up);
      const float* row_down = pixels.ptr<float>(down);
      const float per_y = down > up ? 1.0f / static_cast<float>(down - up) : 0.0f;
      for (int x = 0; x < size.width; ++x) {
        const int left = std::max(x - 1, 0), right = std::min(x + 1, size.width - 1);
        const float per_x = right > left ? 1.0f / static_cast<float>(right - left) : 0.0f;
        texels[static_cast<std::size_t>(y * size.width + x)] = {row[x], (row[right] - row[left]) * per_x,
                                                                (row_down[x] - row_up[x]) * per_y, 0.0f};
      }
    }
  }

  const Eigen::Vector4f& At(int x, int y) const {
    return texels[static_cast<std::size_t>(y * size.width + x)];
  }

  // 0 <= x <= width - 1, 0 <= y <= height - 1.
  Eigen::Vector4f Interpolate(float x, float y) const {
    const int left = std::min(static_cast<int>(x), std::max(size.width - 2, 0));
    const int top = std::min(static_cast<int>(y), std::max(size.height - 2, 0));
    const int right = std::min(left + 1, size.width - 1), bottom = std::min(top + 1, size.height - 1);
    const float fraction_x = x - static_cast<float>(left), fraction_y = y - static_cast<float>(top);
    const Eigen::Vector4f upper = At(left, top) + fraction_x * (At(right, top) - At(left, top));
    const Eigen::Vector4f lower = At(left, bottom) + fraction_x * (At(right, bottom) - At(left, bottom));
    return upper + fraction_y * (lower - upper);
  }
};

// The comparison at one rotation: grey_b = gain * grey_a + offset + noise. Gain and offset are solved in
// closed form, which compensates changes of exposure.
struct Comparison {
  double mean_squared = std::numeric_limits<double>::infinity();
  double overlap = 0;
  double gain = 1;
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();  // J'J with gain and offset eliminated
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();     // J'r
};

// Sums over the overlap of the columns J (rotation, 3), a, 1, b.
struct Sums {
  Eigen::Matrix<double, 6, 6> products = Eigen::Matrix<double, 6, 6>::Zero();
  int valid = 0;   // samples of a
  int inside = 0;  // contained in `valid`; inside b
  // Contained in `inside`; away from the borders of both: the number of rows of the products.
  int compared = 0;
};

Comparison Summarize(const Sums& sums) {
  Comparison result;
  if (sums.valid == 0 || sums.compared < 6) return result;
  const double count = sums.compared;
  const auto& m = sums.products;
  const double mean_a = m(3, 4) / count, mean_b = m(5, 4) / count;
  const double variance_a = m(3, 3) - count * mean_a * mean_a;
  const double variance_b = m(5, 5) - count * mean_b * mean_b;
  const double covariance = m(3, 5) - count * mean_a * mean_b;
  // A free gain would let two unrelated images agree by reducing one of them to flat grey.
  result.gain = variance_a > 1e-6 * count ? std::clamp(covariance / variance_a, 0.5, 2.0) : 1.0;
  const double squared = variance_b - 2 * result.gain * covariance + result.gain * result.gain * variance_a;
  result.mean_squared = std::max(squared, 0.0) / count;
  result.overlap = static_cast<double>(sums.inside) / sums.valid;
  const double offset = mean_b - result.gain * mean_a;
  result.gradient = m.block<3, 1>(0, 5) - result.gain * m.block<3, 1>(0, 3) - offset * m.block<3, 1>(0, 4);
  Eigen::Matrix2d photometric = m.block<2, 2>(3, 3);
  photometric.diagonal().array() += 1e-6 * count;
  const Eigen::Matrix<double, 3, 2> mixed = m.block<3, 2>(0, 3);
  result.information = m.block<3, 3>(0, 0) - mixed * photometric.inverse() * mixed.transpose();
  return result;
}

class RotationAligner {
 public:
  RotationAligner(const cv::Mat& a, const CameraModel& camera_a, const cv::Mat& b,
                  const CameraModel& camera_b, int scale_a, int scale_b, const Eigen::Vector3d& pivot)
      : image_a_(a),
        image_b_(b),
        pivot_(pivot),
        hat_of_pivot_(Hat(pivot).cast<float>()),
        turns_about_itself_(pivot.isZero(0)) {
    // The tables outlive this aligner: one AlignRotation requests at most four, fewer than the cache holds.
    // A rolling shutter moves no more than a fraction of a pixel of a thumbnail.
    table_a_ = &FindSampleTable(camera_a.WithoutMotion(), a.size(), scale_a);
    table_b_ = &FindSampleTable(camera_b.WithoutMotion(), b.size(), scale_b);
  }

  // gain: the value of the last comparison; weights the reference's gradient relative to the current one's.
  Comparison Compare(const Rotation3& b_from_a, double gain) const {
    Sums sums;
    const Eigen::Matrix3d rotation = b_from_a.matrix();
    const Eigen::Matrix3f rotation_f = rotation.cast<float>();
    const float max_x = static_cast<float>(image_b_.size.width - 1);
    const float max_y = static_cast<float>(image_b_.size.height - 1);
    Eigen::Matrix<float, 6, 6> row_sum;
    for (int row = 0; row < table_a_->rows; ++row) {
      row_sum.setZero();  // row sums are exact enough in single precision, sums over the image need double
      for (int column = 0; column < table_a_->columns; ++column) {
        const Sample& sample = table_a_->samples[static_cast<std::size_t>(row * table_a_->columns + column)];
        if (!sample.valid) continue;
        ++sums.valid;
        const auto pixel = table_b_->camera.Project(rotation * (sample.ray - pivot_) + pivot_);
        if (!pixel) continue;
        const float x = static_cast<float>(ThumbnailFromImage(pixel->x(), table_b_->scale));
        const float y = static_cast<float>(ThumbnailFromImage(pixel->y(), table_b_->scale));
        if (!(x >= 0 && y >= 0 && x <= max_x && y <= max_y)) continue;
        ++sums.inside;
        const Sample& there = table_b_->Nearest(x, y);
        if (!there.valid || IsNearBorder(image_a_, sample.x, sample.y) || IsNearBorder(image_b_, x, y))
          continue;
        ++sums.compared;
        const Eigen::Vector4f& reference = image_a_.At(sample.x, sample.y);
        const Eigen::Vector4f current = image_b_.Interpolate(x, y);
        const Eigen::RowVector3f slope_a = reference.segment<2>(1).transpose() * PixelFromRotation(sample);
        const Eigen::RowVector3f slope_b =
            current.segment<2>(1).transpose() * PixelFromRotation(there) * rotation_f;
        Eigen::Matrix<float, 6, 1> columns;
        columns << 0.5f * (slope_b + static_cast<float>(gain) * slope_a).transpose(), reference[0], 1.0f,
            current[0];
        row_sum.noalias() += columns * columns.transpose();
      }
      sums.products += row_sum.cast<double>();
    }
    return Summarize(sums);
  }

 private:
  Eigen::Matrix<float, 2, 3> PixelFromRotation(const Sample& sample) const {
    if (turns_about_itself_) return sample.pixel_from_rotation;
    return sample.pixel_from_rotation + sample.pixel_from_ray * hat_of_pivot_;
  }
  // Near the border the blur includes mirrored grey values, which do not move with the scene.
  static bool IsNearBorder(const GradientImage& image, float x, float y) {
    constexpr float kBlurBorder = 4;  // thumbnail pixels; 1.6 sigma of the default blur
    const float border_x = std::min(kBlurBorder, static_cast<float>(image.size.width) / 8);
    const float border_y = std::min(kBlurBorder, static_cast<float>(image.size.height) / 8);
    return x < border_x || y < border_y || x > static_cast<float>(image.size.width - 1) - border_x ||
           y > static_cast<float>(image.size.height - 1) - border_y;
  }
  static bool IsNearBorder(const GradientImage& image, int x, int y) {
    return IsNearBorder(image, static_cast<float>(x), static_cast<float>(y));
  }

  GradientImage image_a_, image_b_;
  Eigen::Vector3d pivot_;
  Eigen::Matrix3f hat_of_pivot_;
  bool turns_about_itself_;
  const SampleTable* table_a_ = nullptr;
  const SampleTable* table_b_ = nullptr;
};

struct Descent {
  Rotation3 b_from_a;
  Comparison comparison;
  bool converged = false;
};

constexpr double kStepTolerance = 1e-4;  // radians; a hundredth of a thumbnail pixel

// Gauss-Newton on the second-order (mean gradient) Jacobian. The rotation is updated on the right, in frame
// a: there the reference's Jacobian is the same in every iteration, as ESM requires. Damped only after a step
// that failed.
Descent Descend(const RotationAligner& aligner, const Descent& start, int max_iterations) {
  Descent best = start;
  double damping = 0;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    Eigen::Matrix3d damped = best.comparison.information;
    damped.diagonal() *= 1 + damping;
    damped.diagonal().array() += 1e-9 * damped.trace() + 1e-12;
    Eigen::Vector3d step = -damped.ldlt().solve(best.comparison.gradient);
    if (!step.allFinite()) break;
    constexpr double kMaxStep = 0.15;  // radians: beyond it the gradients belong to another part of the scene
    if (step.norm() > kMaxStep) step *= kMaxStep / step.norm();
    const Rotation3 candidate = best.b_from_a * Rotation3::Exp(step);
    if (step.norm() < kStepTolerance) {  // too small to change the comparison
      best.b_from_a = candidate;
      best.converged = true;
      break;
    }
    const Comparison comparison = aligner.Compare(candidate, best.comparison.gain);
    if (comparison.mean_squared <= best.comparison.mean_squared) {
      best.b_from_a = candidate;
      best.comparison = comparison;
      damping = damping > 1e-2 ? damping * 0.1 : 0;
    } else {
      damping = std::max(damping * 10, 0.1);
    }
  }
  return best;
}

// Half the size and twice the blur: a wide basin of convergence for large rotations.
cv::Mat Coarser(const cv::Mat& pixels) {
  const cv::Size size(pixels.cols / 2, pixels.rows / 2);
  cv::Mat half, blurred;
  cv::resize(pixels(cv::Rect({0, 0}, size * 2)), half, size, 0, 0, cv::INTER_AREA);
  cv::GaussianBlur(half, blurred, {}, 2.0);
  return blurred;
}

// Whether the image determines the rotation: compares the standard deviation that follows from its texture,
// the residuals (at least those of quantised images) and the number of independent samples.
bool IsObservable(const Comparison& comparison) {
  constexpr double kMinNoise = 0.1;              // grey values
  constexpr double kSamplesOneIndependent = 20;  // area of the blur, 4 pi sigma^2, in units of kStride^2
  constexpr double kMaxDeviation = 0.02;         // radians
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(comparison.information, Eigen::EigenvaluesOnly);
  const double smallest = eigen.eigenvalues()[0];
  if (!(smallest > 0)) return false;
  const double noise_squared = std::max(comparison.mean_squared, kMinNoise * kMinNoise);
  return kSamplesOneIndependent * noise_squared / smallest < kMaxDeviation * kMaxDeviation;
}

}  // namespace

std::optional<RotationAlignment> AlignRotation(const SmallBlurryImage& a, const CameraModel& camera_a,
                                               const SmallBlurryImage& b, const CameraModel& camera_b,
                                               const Rotation3& initial, int max_iterations,
                                               const Eigen::Vector3d& pivot) {
  if (a.pixels.empty() || b.pixels.empty()) return std::nullopt;
  const RotationAligner fine(a.pixels, camera_a, b.pixels, camera_b, a.scale, b.scale, pivot);
  Descent descent{initial, fine.Compare(initial, 1.0)};
  constexpr int kMinSizeForCoarse = 32;
  if (std::min({a.pixels.cols, a.pixels.rows, b.pixels.cols, b.pixels.rows}) >= kMinSizeForCoarse) {
    const RotationAligner coarse(Coarser(a.pixels), camera_a, Coarser(b.pixels), camera_b, 2 * a.scale,
                                 2 * b.scale, pivot);
    const Descent guess = Descend(coarse, {initial, coarse.Compare(initial, 1.0)}, max_iterations);
    // The coarse images provide the initial rotation; the full thumbnails decide.
    const Comparison comparison = fine.Compare(guess.b_from_a, 1.0);
    if (comparison.mean_squared < descent.comparison.mean_squared) descent = {guess.b_from_a, comparison};
  }
  descent = Descend(fine, descent, max_iterations);
  constexpr double kMinOverlap = 0.25;
  if (descent.comparison.overlap < kMinOverlap) return std::nullopt;
  return RotationAlignment{.b_from_a = descent.b_from_a,
                           .rms = std::sqrt(descent.comparison.mean_squared),
                           .overlap = descent.comparison.overlap,
                           .converged = descent.converged && IsObservable(descent.comparison)};
}

}  // namespace docent::engine
