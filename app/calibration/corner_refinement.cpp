// SPDX-License-Identifier: Apache-2.0
#include "app/calibration/corner_refinement.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace docent::app {

namespace {

struct Sample {
  Eigen::Vector2d pixel;
  double brightness;
};

// Model: brightness = middle + contrast * Edge(first) * Edge(second). Edge is a step function blurred by a
// Gaussian; each edge is a line through the corner, given by the direction of its normal.
struct Crossing {
  enum { kX, kY, kFirst, kSecond, kMiddle, kContrast, kBlur, kCount };
  using Numbers = Eigen::Matrix<double, kCount, 1>;
  Numbers numbers = Numbers::Zero();

  Eigen::Vector2d corner() const { return numbers.head<2>(); }

  double At(const Eigen::Vector2d& pixel, Numbers* slope) const {
    const double blur = numbers[kBlur];
    const Eigen::Vector2d from_corner = pixel - corner();
    double edge[2], steep[2], distance[2];
    Eigen::Vector2d normal[2];
    for (int i = 0; i < 2; ++i) {
      normal[i] = {std::cos(numbers[kFirst + i]), std::sin(numbers[kFirst + i])};
      distance[i] = normal[i].dot(from_corner);
      edge[i] = std::erf(distance[i] / (std::numbers::sqrt2 * blur));
      steep[i] =
          std::sqrt(2 / std::numbers::pi) / blur * std::exp(-0.5 * distance[i] * distance[i] / (blur * blur));
    }
    const double contrast = numbers[kContrast];
    if (slope != nullptr) {
      const double by_first = contrast * steep[0] * edge[1], by_second = contrast * edge[0] * steep[1];
      slope->head<2>() = -(by_first * normal[0] + by_second * normal[1]);
      const auto across = [&](int i) {
        return -normal[i].y() * from_corner.x() + normal[i].x() * from_corner.y();
      };
      (*slope)[kFirst] = by_first * across(0);
      (*slope)[kSecond] = by_second * across(1);
      (*slope)[kMiddle] = 1;
      (*slope)[kContrast] = edge[0] * edge[1];
      (*slope)[kBlur] = -(by_first * distance[0] + by_second * distance[1]) / blur;
    }
    return numbers[kMiddle] + contrast * edge[0] * edge[1];
  }
};

// Samples the pixels around the guess that belong to the four squares, without the area in which a marker may
// be printed.
std::vector<Sample> SamplesOf(const cv::Mat& grey, const CornerGuess& guess, double clear_ratio) {
  constexpr double kMaxDistance_px = 9;  // Farther away, lens distortion may bend the edges.
  constexpr double kMaxSquares = 0.42;   // Farther away, an inaccurate guess could include other edges.
  std::vector<Sample> samples;
  Eigen::Matrix2d pixel_from_squares;
  pixel_from_squares << guess.along_row, guess.along_column;
  if (std::abs(pixel_from_squares.determinant()) < 4) return samples;
  const Eigen::Matrix2d squares_from_pixel = pixel_from_squares.inverse();
  const int reach = static_cast<int>(kMaxDistance_px);
  const int x0 = static_cast<int>(std::lround(guess.pixel.x())),
            y0 = static_cast<int>(std::lround(guess.pixel.y()));
  for (int y = y0 - reach; y <= y0 + reach; ++y) {
    for (int x = x0 - reach; x <= x0 + reach; ++x) {
      const Eigen::Vector2d offset = Eigen::Vector2d(x, y) - guess.pixel;
      const Eigen::Vector2d squares = (squares_from_pixel * offset).cwiseAbs();
      if (offset.norm() > kMaxDistance_px || squares.maxCoeff() > kMaxSquares ||
          squares.minCoeff() > clear_ratio)
        continue;
      // A window that is cut off by the image border would bias the corner towards the remaining side.
      if (x < 0 || y < 0 || x >= grey.cols || y >= grey.rows) return {};
      samples.push_back({{x, y}, static_cast<double>(grey.at<uchar>(y, x))});
    }
  }
  return samples;
}

double SumOfSquares(const std::vector<Sample>& samples, const Crossing& crossing) {
  double sum = 0;
  for (const Sample& sample : samples) {
    const double residual = crossing.At(sample.pixel, nullptr) - sample.brightness;
    sum += residual * residual;
  }
  return sum;
}

// For given edges, the model is linear in middle and contrast, which are solved here in closed form.
void FitBrightness(const std::vector<Sample>& samples, Crossing* crossing) {
  crossing->numbers[Crossing::kMiddle] = 0;
  crossing->numbers[Crossing::kContrast] = 1;
  Eigen::Matrix2d left = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  for (const Sample& sample : samples) {
    const Eigen::Vector2d row(1, crossing->At(sample.pixel, nullptr));
    left += row * row.transpose();
    right += row * sample.brightness;
  }
  crossing->numbers.segment<2>(Crossing::kMiddle) = left.ldlt().solve(right);
}

// Levenberg-Marquardt optimization. Returns the sum of squared residuals.
double Fit(const std::vector<Sample>& samples, Crossing* crossing) {
  constexpr int kIterations = 40;
  constexpr double kSharpest_px = 0.25, kSoftest_px = 5;
  double damping = 1e-2, least = SumOfSquares(samples, *crossing);
  for (int iteration = 0; iteration < kIterations && damping < 1e6; ++iteration) {
    Eigen::Matrix<double, Crossing::kCount, Crossing::kCount> normal;
    normal.setZero();
    Crossing::Numbers right = Crossing::Numbers::Zero(), slope;
    for (const Sample& sample : samples) {
      const double residual = crossing->At(sample.pixel, &slope) - sample.brightness;
      normal += slope * slope.transpose();
      right -= slope * residual;
    }
    normal.diagonal() *= 1 + damping;
    normal.diagonal().array() += 1e-9;
    const Crossing::Numbers step = normal.ldlt().solve(right);
    Crossing trial = *crossing;
    trial.numbers += step;
    trial.numbers[Crossing::kBlur] = std::clamp(trial.numbers[Crossing::kBlur], kSharpest_px, kSoftest_px);
    const double sum = SumOfSquares(samples, trial);
    if (!(sum < least)) {
      damping *= 8;
      continue;
    }
    *crossing = trial;
    damping = std::max(damping / 5, 1e-7);
    least = sum;
    if (step.head<2>().norm() < 1e-4) break;
  }
  return least;
}

}  // namespace

std::optional<Eigen::Vector2d> RefineCorner(const cv::Mat& grey, const CornerGuess& guess,
                                            double clear_ratio) {
  const std::vector<Sample> samples = SamplesOf(grey, guess, clear_ratio);
  if (samples.size() < 2 * Crossing::kCount) return std::nullopt;
  Crossing crossing;
  // The edges run along rows and columns, so their normals are perpendicular to these.
  const auto normal_of = [](const Eigen::Vector2d& along) { return std::atan2(along.x(), -along.y()); };
  crossing.numbers << guess.pixel, normal_of(guess.along_column), normal_of(guess.along_row), 0, 1, 1.2;
  FitBrightness(samples, &crossing);
  const double sum = Fit(samples, &crossing);
  // Contrast in grey levels, RMS residual over contrast, and correction over the side of the square.
  constexpr double kMinContrast = 6, kMaxResidualRatio = 0.35, kMaxCorrection = 0.34;
  const double contrast = std::abs(crossing.numbers[Crossing::kContrast]);
  const double residual = std::sqrt(sum / static_cast<double>(samples.size()));
  const double side = std::min(guess.along_row.norm(), guess.along_column.norm());
  if (!(contrast >= kMinContrast && residual <= kMaxResidualRatio * contrast)) return std::nullopt;
  if (!((crossing.corner() - guess.pixel).norm() <= kMaxCorrection * side)) return std::nullopt;
  return crossing.corner();
}

}  // namespace docent::app
