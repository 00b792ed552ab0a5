// SPDX-License-Identifier: Apache-2.0
#include "app/simulator/paint_basics.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace docent::app {
namespace {

constexpr double kFullCircle = 2 * std::numbers::pi;
// OpenCV draws with a resolution of 1/16 pixel with this shift.
constexpr int kShift = 4;

cv::Point Fixed(cv::Point2d p) {
  return {static_cast<int>(std::lround(p.x * (1 << kShift))),
          static_cast<int>(std::lround(p.y * (1 << kShift)))};
}

void DrawLetter(cv::Point2d corner, double width, double height, int thickness, const cv::Scalar& color,
                Random* random, cv::Mat* image) {
  const int strokes = 2 + random->Below(2);
  cv::Point2d from = corner + cv::Point2d(width * random->Below(3) / 2.0, height * random->Below(3) / 2.0);
  for (int i = 0; i < strokes; ++i) {
    const cv::Point2d to =
        corner + cv::Point2d(width * random->Below(3) / 2.0, height * random->Below(3) / 2.0);
    cv::line(*image, Fixed(from), Fixed(to), color, thickness, cv::LINE_AA, kShift);
    from = to;
  }
}

}  // namespace

cv::Scalar ColorFromHue(double hue, double saturation, double brightness) {
  const auto channel = [&](double offset) {
    const double phase = hue + offset - std::floor(hue + offset);
    const double ramp = std::clamp(std::abs(phase * 6 - 3) - 1, 0.0, 1.0);
    return 255 * brightness * (1 - saturation + saturation * ramp);
  };
  return {channel(1.0 / 3), channel(2.0 / 3), channel(0)};
}

cv::Scalar RandomColor(Random* random, double low_brightness, double high_brightness) {
  const double hue = random->Uniform();
  const double saturation = 0.1 + 0.8 * random->Uniform() * random->Uniform();
  return ColorFromHue(hue, saturation, random->Uniform(low_brightness, high_brightness));
}

cv::Mat NoiseField(cv::Size size, int cells_x, int cells_y, int octaves, double persistence, Random* random) {
  cv::Mat sum = cv::Mat::zeros(size, CV_32FC1);
  double amplitude = 1, total = 0;
  for (int octave = 0; octave < octaves && cells_x <= size.width && cells_y <= size.height; ++octave) {
    cv::Mat grid(cells_y, cells_x, CV_32FC1), smooth;
    for (auto cell = grid.begin<float>(); cell != grid.end<float>(); ++cell) {
      *cell = static_cast<float>(random->Uniform(-1.6, 1.6) * amplitude);
    }
    cv::resize(grid, smooth, size, 0, 0, cv::INTER_CUBIC);
    sum += smooth;
    total += amplitude * amplitude;
    amplitude *= persistence;
    cells_x *= 2;
    cells_y *= 2;
  }
  return sum / std::max(1.0, std::sqrt(total));
}

void AddField(const cv::Mat& field, double strength, cv::Mat* image, const cv::Scalar& tint) {
  for (int y = 0; y < image->rows; ++y) {
    cv::Vec3b* out = image->ptr<cv::Vec3b>(y);
    const float* in = field.ptr<float>(y);
    for (int x = 0; x < image->cols; ++x) {
      for (int c = 0; c < 3; ++c) {
        out[x][c] = cv::saturate_cast<uchar>(out[x][c] + static_cast<float>(strength * tint[c]) * in[x]);
      }
    }
  }
}

cv::Mat ColorsAlong(const cv::Mat& field, const cv::Scalar& a, const cv::Scalar& b) {
  cv::Mat image(field.size(), CV_8UC3);
  const cv::Vec3f low(static_cast<float>(a[0]), static_cast<float>(a[1]), static_cast<float>(a[2]));
  const cv::Vec3f high(static_cast<float>(b[0]), static_cast<float>(b[1]), static_cast<float>(b[2]));
  for (int y = 0; y < field.rows; ++y) {
    cv::Vec3b* out = image.ptr<cv::Vec3b>(y);
    const float* in = field.ptr<float>(y);
    for (int x = 0; x < field.cols; ++x) {
      const float t = std::clamp(0.5f + 0.5f * in[x], 0.0f, 1.0f);
      for (int c = 0; c < 3; ++c) out[x][c] = cv::saturate_cast<uchar>(low[c] + t * (high[c] - low[c]));
    }
  }
  return image;
}

void DrawWriting(const cv::Rect& area, int letter_px, const cv::Scalar& color, Random* random,
                 cv::Mat* image) {
  const double width = 0.6 * letter_px, advance = 0.95 * letter_px;
  const int thickness = std::max(1, letter_px / 7);
  for (double y = area.y; y + letter_px <= area.y + area.height; y += 1.7 * letter_px) {
    const double end = area.x + area.width * (random->Below(4) == 0 ? random->Uniform(0.4, 0.9) : 1.0);
    int letters_left = 2 + random->Below(7);
    for (double x = area.x; x + width <= end; x += advance) {
      if (letters_left-- == 0) {
        letters_left = 2 + random->Below(7);
        continue;
      }
      DrawLetter({x, y}, width, letter_px, thickness, color, random, image);
    }
  }
}

void DrawShape(cv::Point2d center, double radius, const cv::Scalar& color, Random* random, cv::Mat* image) {
  const double rotation = random->Uniform(0, kFullCircle);
  const int kind = random->Below(6);
  const int thickness = std::max(1, static_cast<int>(radius * 0.15));
  if (kind == 0) {
    cv::circle(*image, Fixed(center), static_cast<int>(radius * (1 << kShift)), color, cv::FILLED,
               cv::LINE_AA, kShift);
    return;
  }
  if (kind == 1) {
    cv::ellipse(*image, Fixed(center),
                {static_cast<int>(radius * (1 << kShift)), static_cast<int>(radius * 0.6 * (1 << kShift))},
                rotation * 57, 0, 360, color, thickness, cv::LINE_AA, kShift);
    return;
  }
  std::vector<cv::Point> corners;
  const bool is_bar = kind == 2, is_star = kind == 3;
  const int count = is_bar ? 4 : is_star ? 10 : 3 + static_cast<int>(random->Below(3));
  for (int i = 0; i < count; ++i) {
    double angle = rotation + kFullCircle * i / count, reach = radius;
    if (is_bar)
      angle = rotation + (i < 2 ? -0.22 : 0.22) +
              (i == 1 || i == 2 ? std::numbers::pi - (i == 1 ? -0.44 : 0.44) : 0);
    if (is_star && i % 2 == 1) reach *= 0.45;
    if (kind >= 4) reach *= random->Uniform(0.7, 1.2);
    corners.push_back(Fixed(center + reach * cv::Point2d(std::cos(angle), std::sin(angle))));
  }
  if (kind == 5) {
    cv::polylines(*image, corners, true, color, thickness, cv::LINE_AA, kShift);
  } else {
    cv::fillPoly(*image, std::vector<std::vector<cv::Point>>{corners}, color, cv::LINE_AA, kShift);
  }
}

void Weather(double amount, Random* random, cv::Mat* image) {
  const double side = std::sqrt(static_cast<double>(image->cols) * image->rows);
  AddField(NoiseField(image->size(), 3, 3, 4, 0.6, random), 9 * amount, image);
  const int specks = static_cast<int>(amount * side * 0.25),
            scratches = static_cast<int>(amount * side * 0.02);
  for (int i = 0; i < specks; ++i) {
    const cv::Point2d center(random->Uniform(0, image->cols), random->Uniform(0, image->rows));
    const double radius = 0.6 + 2.2 * std::pow(random->Uniform(), 4);
    const cv::Scalar color =
        cv::Scalar::all(random->Below(3) == 0 ? random->Uniform(170, 235) : random->Uniform(20, 90));
    cv::circle(*image, Fixed(center), static_cast<int>(radius * (1 << kShift)), color, cv::FILLED,
               cv::LINE_AA, kShift);
  }
  for (int i = 0; i < scratches; ++i) {
    cv::Point2d from(random->Uniform(0, image->cols), random->Uniform(0, image->rows));
    double angle = random->Uniform(0, kFullCircle);
    const cv::Scalar color = cv::Scalar::all(random->Uniform(40, 200));
    for (int piece = 2 + random->Below(5); piece > 0; --piece) {
      angle += random->Uniform(-0.7, 0.7);
      const cv::Point2d to =
          from + random->Uniform(0.005, 0.03) * side * cv::Point2d(std::cos(angle), std::sin(angle));
      cv::line(*image, Fixed(from), Fixed(to), color, 1, cv::LINE_AA, kShift);
      from = to;
    }
  }
}

}  // namespace docent::app
