// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "app/simulator/paint.h"
#include "app/simulator/paint_basics.h"

namespace docent::app {
namespace {

// Brightens `area` of the image by a random amount: one brick, plank or tile.
void Tone(const cv::Rect& area, double low, double high, Random* random, cv::Mat* image) {
  const cv::Rect inside = area & cv::Rect(0, 0, image->cols, image->rows);
  if (inside.empty()) return;
  cv::Mat patch = (*image)(inside);
  patch.convertTo(patch, -1, random->Uniform(low, high), 0);
}

// Draws a disc that wraps around the image borders.
void DrawWrapped(cv::Point center, int radius, const cv::Scalar& color, cv::Mat* image) {
  for (const int dx : {-image->cols, 0, image->cols}) {
    for (const int dy : {-image->rows, 0, image->rows}) {
      cv::circle(*image, center + cv::Point(dx, dy), radius, color, cv::FILLED, cv::LINE_AA);
    }
  }
}

}  // namespace

cv::Mat PaintPlaster(cv::Size size, const cv::Scalar& color, std::uint64_t seed) {
  Random random(seed);
  cv::Mat image(size, CV_8UC3, color);
  AddField(NoiseField(size, 4, 4, 6, 0.7, &random), 15, &image);
  AddField(NoiseField(size, size.width / 4, size.height / 4, 1, 0.8, &random), 2.5, &image);
  Weather(0.5, &random, &image);
  return image;
}

cv::Mat PaintWood(cv::Size size, const cv::Scalar& color, int planks, std::uint64_t seed) {
  Random random(seed);
  const cv::Mat rings = NoiseField(size, 2, std::max(8, size.height / 24), 3, 0.7, &random);
  const cv::Mat fibres =
      NoiseField(size, std::max(4, size.width / 48), std::max(8, size.height / 3), 1, 0.7, &random);
  cv::Mat image(size, CV_8UC3, color);
  AddField(rings, 26, &image, {0.8, 0.9, 1.0});
  AddField(fibres, 8, &image);
  const double plank_height = static_cast<double>(size.height) / planks;
  for (int plank = 0; plank < planks; ++plank) {
    const int top = static_cast<int>(plank * plank_height),
              bottom = static_cast<int>((plank + 1) * plank_height);
    int left = -static_cast<int>(random.Uniform(0, 0.5) * size.width);
    while (left < size.width) {
      const int length = static_cast<int>(random.Uniform(0.3, 0.8) * size.width);
      Tone({left, top, length, bottom - top}, 0.75, 1.2, &random, &image);
      cv::rectangle(image, {left, top, length, bottom - top}, color * 0.3, 1, cv::LINE_AA);
      for (const int nail_x : {left + 6, left + length - 6}) {
        cv::circle(image, {nail_x, (top + bottom) / 2}, 2, color * 0.25, cv::FILLED, cv::LINE_AA);
      }
      for (int knot = random.Below(3); knot > 0; --knot) {
        const cv::Point center(left + static_cast<int>(random.Uniform(0.1, 0.9) * length),
                               top + static_cast<int>(random.Uniform(0.25, 0.75) * plank_height));
        const double reach = random.Uniform(0.05, 0.16) * plank_height;
        for (int ring = 3; ring >= 1; --ring) {
          cv::ellipse(image, center,
                      cv::Size(static_cast<int>(reach * ring) + 1, static_cast<int>(reach * ring * 0.6) + 1),
                      0, 0, 360, color * (0.25 + 0.15 * ring), ring == 1 ? cv::FILLED : 1, cv::LINE_AA);
        }
      }
      left += length;
    }
  }
  Weather(0.7, &random, &image);
  return image;
}

cv::Mat PaintBricks(cv::Size size, const cv::Scalar& color, int rows, std::uint64_t seed) {
  Random random(seed);
  const double height = static_cast<double>(size.height) / rows, length = 2.2 * height;
  cv::Mat image(size, CV_8UC3, color);
  const int joint = std::max(2, static_cast<int>(height * 0.09));
  for (int row = 0; row < rows; ++row) {
    for (double left = row % 2 == 0 ? 0 : -length / 2; left < size.width; left += length) {
      const cv::Rect brick(static_cast<int>(left) + joint, static_cast<int>(row * height) + joint,
                           static_cast<int>(length) - joint, static_cast<int>(height) - joint);
      Tone(brick, 0.6, 1.3, &random, &image);
    }
  }
  AddField(NoiseField(size, rows, rows, 5, 0.8, &random), 22, &image, {0.8, 0.9, 1.0});
  for (int row = 0; row < rows; ++row) {
    const int y = static_cast<int>(row * height);
    cv::rectangle(image, {0, y, size.width, joint}, cv::Scalar(150, 160, 165), cv::FILLED);
    for (double left = row % 2 == 0 ? 0 : -length / 2; left < size.width; left += length) {
      cv::rectangle(image, {static_cast<int>(left), y, joint, static_cast<int>(height) + 1},
                    cv::Scalar(148, 156, 162), cv::FILLED);
    }
  }
  Weather(0.9, &random, &image);
  return image;
}

cv::Mat PaintTiles(cv::Size size, int tiles_across, std::uint64_t seed) {
  Random random(seed);
  const int side = std::max(4, size.width / tiles_across);
  const cv::Scalar first = RandomColor(&random, 0.65, 0.9), second = RandomColor(&random, 0.25, 0.5);
  const cv::Scalar third = RandomColor(&random, 0.4, 0.8);
  cv::Mat image(size, CV_8UC3, first);
  for (int y = 0; y * side < size.height; ++y) {
    for (int x = 0; x * side < size.width; ++x) {
      const cv::Rect tile(x * side, y * side, side, side);
      if ((x + y) % 2 == 1) cv::rectangle(image, tile, second, cv::FILLED);
      const std::uint32_t ornament = random.Below(4);
      const cv::Point2d middle(tile.x + side / 2.0, tile.y + side / 2.0);
      if (ornament == 0) DrawShape(middle, side * 0.3, third, &random, &image);
      if (ornament == 1) DrawShape(middle, side * 0.2, (x + y) % 2 == 1 ? first : second, &random, &image);
      Tone(tile, 0.85, 1.1, &random, &image);
      cv::rectangle(image, tile, cv::Scalar(70, 75, 80), std::max(1, side / 40), cv::LINE_AA);
    }
  }
  AddField(NoiseField(size, 6, 6, 6, 0.75, &random), 14, &image);
  Weather(0.8, &random, &image);
  return image;
}

cv::Mat PaintStone(cv::Size size, const cv::Scalar& color, std::uint64_t seed) {
  Random random(seed);
  const cv::Mat cloud = NoiseField(size, 4, 4, 6, 0.7, &random);
  cv::Mat image = ColorsAlong(cloud, color * 0.6, color * 1.3);
  // Veins are drawn where a second field crosses zero.
  const cv::Mat vein_field = NoiseField(size, 3, 3, 5, 0.65, &random);
  cv::Mat veins = 1.0 - cv::abs(vein_field) * 14.0;
  cv::max(veins, 0.0, veins);
  AddField(veins, -65, &image, {0.9, 1.0, 1.0});
  AddField(NoiseField(size, size.width / 4, size.height / 4, 1, 0.8, &random), 5, &image);
  Weather(0.8, &random, &image);
  return image;
}

cv::Mat PaintCarpet(cv::Size size, std::uint64_t seed) {
  Random random(seed);
  const cv::Scalar ground = RandomColor(&random, 0.3, 0.6);
  const cv::Scalar colors[3] = {RandomColor(&random, 0.1, 0.4), RandomColor(&random, 0.6, 0.95),
                                RandomColor(&random)};
  cv::Mat image(size, CV_8UC3, ground);
  const int border = size.height / 10;
  for (int ring = 0; ring < 4; ++ring) {
    const int inset = ring * border / 3;
    cv::rectangle(image, {inset, inset, size.width - 2 * inset, size.height - 2 * inset}, colors[ring % 3],
                  std::max(1, border / 8), cv::LINE_AA);
  }
  for (int i = 0; i < 160; ++i) {
    const cv::Point2d center(random.Uniform(border, size.width - border),
                             random.Uniform(border, size.height - border));
    const double radius = size.height * (0.012 + 0.09 * std::pow(random.Uniform(), 3));
    DrawShape(center, radius, colors[random.Below(3)], &random, &image);
  }
  AddField(NoiseField(size, size.width / 4, size.height / 4, 1, 0.7, &random), 6, &image);
  Weather(0.6, &random, &image);
  return image;
}

cv::Mat PaintGrass(cv::Size size, std::uint64_t seed) {
  Random random(seed);
  cv::Mat image(size, CV_8UC3, cv::Scalar(25, 60, 45));
  // Bare earth, moss and clover in patches of all sizes, then grass blades, then flowers and leaves on top.
  for (int i = 0; i < 90; ++i) {
    const int radius = static_cast<int>(size.width * (0.012 + 0.1 * std::pow(random.Uniform(), 2)));
    const cv::Scalar color = random.Below(3) == 0
                                 ? ColorFromHue(random.Uniform(0.06, 0.11), 0.5, random.Uniform(0.15, 0.55))
                                 : ColorFromHue(random.Uniform(0.18, 0.36), 0.6, random.Uniform(0.12, 0.8));
    DrawWrapped({static_cast<int>(random.Below(size.width)), static_cast<int>(random.Below(size.height))},
                radius, color, &image);
  }
  const int blades = size.width * size.height / 60;
  for (int i = 0; i < blades; ++i) {
    const double shade = 0.3 + 0.7 * i / blades;  // Later blades are on top and brighter.
    // Half of the blades take the colour below them.
    const cv::Point root(random.Below(size.width), random.Below(size.height));
    const cv::Vec3b below = image.at<cv::Vec3b>(root);
    cv::Scalar color =
        ColorFromHue(random.Uniform(0.17, 0.33), random.Uniform(0.3, 0.8), shade * random.Uniform(0.5, 1.0));
    if (random.Below(4) != 0) color = 0.6 * cv::Scalar(below[0], below[1], below[2]) + 0.4 * color;
    const cv::Point tip(static_cast<int>(random.Uniform(-9, 9)), static_cast<int>(random.Uniform(-22, -6)));
    const int thickness = 1 + static_cast<int>(random.Below(2));
    // Each blade is drawn again at the opposite border that it may cross, so that the texture is tileable.
    for (const int dx : {0, size.width, -size.width}) {
      for (const int dy : {0, size.height}) {
        const cv::Point from = root + cv::Point(dx, dy);
        if (from.x < -12 || from.x > size.width + 12 || from.y > size.height + 24) continue;
        cv::line(image, from, from + tip, color, thickness, cv::LINE_AA);
      }
    }
  }
  for (int i = 0; i < size.width / 8; ++i) {
    const int radius = 2 + static_cast<int>(size.width * 0.011 * std::pow(random.Uniform(), 2));
    const cv::Scalar color =
        ColorFromHue(random.Uniform(-0.2, 0.17), random.Uniform(0, 0.9), random.Uniform(0.5, 1.0));
    const cv::Point center(random.Below(size.width), random.Below(size.height));
    DrawWrapped(center, radius, color, &image);
    DrawWrapped(center, std::max(1, radius / 3), color * 0.4, &image);
  }
  return image;
}

}  // namespace docent::app
