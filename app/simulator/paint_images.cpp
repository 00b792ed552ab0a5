// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "app/simulator/paint.h"
#include "app/simulator/paint_basics.h"

namespace docent::app {
namespace {

cv::Point2d RandomPoint(const cv::Rect& area, Random* random) {
  return {area.x + random->Uniform() * area.width, area.y + random->Uniform() * area.height};
}

// Brush strokes whose colour comes from a background image and whose direction comes from a field.
void BrushOver(const cv::Rect& area, const cv::Mat& colors, const cv::Mat& direction, int strokes,
               Random* random, cv::Mat* image) {
  for (int i = 0; i < strokes; ++i) {
    const cv::Point from(area.x + random->Below(area.width), area.y + random->Below(area.height));
    const double angle = 3 * direction.at<float>(from) + random->Uniform(-0.3, 0.3);
    const double length = random->Uniform(0.01, 0.05) * area.width;
    const cv::Vec3b base = colors.at<cv::Vec3b>(from);
    const double shade = random->Uniform(0.78, 1.22);
    const cv::Point to = from + cv::Point(static_cast<int>(length * std::cos(angle)),
                                          static_cast<int>(length * std::sin(angle)));
    const int thickness =
        1 + static_cast<int>(area.width * 0.012 * random->Uniform() * random->Uniform() + 0.5);
    cv::line(*image, from, to, {base[0] * shade, base[1] * shade, base[2] * shade}, thickness, cv::LINE_AA);
  }
}

void DrawBarcode(const cv::Rect& area, Random* random, cv::Mat* image) {
  cv::rectangle(*image, area, cv::Scalar::all(240), cv::FILLED);
  for (int x = area.x + 2; x < area.x + area.width - 2;) {
    const int bar = 1 + static_cast<int>(random->Below(3));
    cv::rectangle(*image, {x, area.y + 2, bar, area.height - 4}, cv::Scalar::all(20), cv::FILLED);
    x += bar + 1 + static_cast<int>(random->Below(3));
  }
}

}  // namespace

cv::Mat PaintPoster(cv::Size size, std::uint64_t seed) {
  Random random(seed);
  const bool is_dark = random.Below(3) == 0;
  const cv::Scalar ink = is_dark ? RandomColor(&random, 0.8, 1.0) : RandomColor(&random, 0.05, 0.3);
  const cv::Mat cloud = NoiseField(size, 2, 3, 5, 0.6, &random);
  cv::Mat image = is_dark
                      ? ColorsAlong(cloud, RandomColor(&random, 0.05, 0.2), RandomColor(&random, 0.25, 0.5))
                      : ColorsAlong(cloud, RandomColor(&random, 0.6, 0.8), RandomColor(&random, 0.8, 1.0));
  const int margin = size.width / 20;
  const int heading = std::max(8, size.height / 11);
  const cv::Rect art(margin, 2 * margin + heading, size.width - 2 * margin,
                     static_cast<int>(size.height * 0.58));
  for (int i = 0; i < 70; ++i) {
    const double radius = art.width * (0.012 + 0.22 * std::pow(random.Uniform(), 3) * (1 - i / 90.0));
    DrawShape(RandomPoint(art, &random), radius, RandomColor(&random, 0.1, 1.0), &random, &image);
  }
  DrawWriting({margin, margin, size.width - 2 * margin, heading}, heading * 4 / 5, ink, &random, &image);
  const int text_top = art.y + art.height + margin;
  const int half = size.width / 2;
  DrawWriting({margin, text_top, half - 2 * margin, size.height - text_top - margin},
              std::max(5, size.height / 50), ink, &random, &image);
  DrawWriting({half, text_top, half - margin, size.height - text_top - margin}, std::max(5, size.height / 36),
              ink, &random, &image);
  cv::rectangle(image, {0, 0, size.width, size.height}, ink, std::max(1, margin / 3));
  AddField(NoiseField(size, size.width / 8, size.height / 8, 2, 0.6, &random), 6, &image);
  Weather(0.4, &random, &image);
  return image;
}

cv::Mat PaintPainting(cv::Size size, std::uint64_t seed) {
  Random random(seed);
  const int frame = std::max(4, std::min(size.width, size.height) / 12);
  cv::Mat image = PaintWood(
      size, ColorFromHue(random.Uniform(0.05, 0.13), random.Uniform(0.4, 0.8), random.Uniform(0.25, 0.65)),
      std::max(2, size.height / frame), random.Next());
  const cv::Rect canvas(frame, frame, size.width - 2 * frame, size.height - 2 * frame);
  const cv::Mat cloud = NoiseField(size, 3, 3, 5, 0.65, &random),
                relief = NoiseField(size, 4, 3, 4, 0.6, &random);
  const cv::Mat sky = ColorsAlong(cloud, RandomColor(&random, 0.4, 0.7), RandomColor(&random, 0.7, 1.0));
  const cv::Mat land = ColorsAlong(relief, RandomColor(&random, 0.05, 0.25), RandomColor(&random, 0.35, 0.8));
  cv::Mat colors = sky.clone();
  const double horizon = random.Uniform(0.3, 0.65) * size.height;
  for (int x = 0; x < size.width; ++x) {
    const double hill = horizon + 0.22 * size.height * cloud.at<float>(size.height / 2, x);
    for (int y = std::clamp(static_cast<int>(hill), 0, size.height); y < size.height; ++y) {
      colors.at<cv::Vec3b>(y, x) = land.at<cv::Vec3b>(y, x);
    }
  }
  for (int i = 0; i < 26; ++i) {
    const double radius = size.width * (0.015 + 0.16 * std::pow(random.Uniform(), 2.5));
    DrawShape(RandomPoint(canvas, &random), radius, RandomColor(&random, 0.1, 1.0), &random, &colors);
  }
  colors(canvas).copyTo(image(canvas));
  cv::Mat inside = image(canvas);
  BrushOver({0, 0, canvas.width, canvas.height}, colors(canvas), relief(canvas), canvas.area() / 90, &random,
            &inside);
  for (const int inset : {0, frame / 3, frame - 2}) {
    cv::rectangle(image, {inset, inset, size.width - 2 * inset, size.height - 2 * inset},
                  cv::Scalar(20, 30, 35), 2, cv::LINE_AA);
  }
  return image;
}

cv::Mat PaintCollage(cv::Size size, std::uint64_t seed) {
  Random random(seed);
  const cv::Rect area(0, 0, size.width, size.height);
  cv::Mat image(size, CV_8UC3, RandomColor(&random));
  const cv::Mat shading = NoiseField(size, 3, 3, 6, 0.7, &random);
  const double side = std::sqrt(static_cast<double>(size.area()));
  for (int i = 0; i < 700; ++i) {
    // Radii follow a power law. Large shapes are drawn first, so that they do not cover the small ones.
    const double t = std::pow((i + random.Uniform()) / 700, 1.6), low = 0.008, high = 0.35;
    const double radius = side / std::sqrt(1 / (high * high) + t * (1 / (low * low) - 1 / (high * high)));
    DrawShape(RandomPoint(area, &random), radius, RandomColor(&random, 0.05, 1.0), &random, &image);
  }
  AddField(shading, 20, &image);
  return image;
}

cv::Mat PaintBooks(cv::Size size, int shelves, std::uint64_t seed) {
  Random random(seed);
  const cv::Scalar wood = ColorFromHue(0.08, 0.5, random.Uniform(0.35, 0.6));
  cv::Mat image = PaintWood(size, wood * 0.5, 2 * shelves, random.Next());
  const int shelf_height = size.height / shelves, board = std::max(3, shelf_height / 14);
  for (int shelf = 0; shelf < shelves; ++shelf) {
    const int floor_y = (shelf + 1) * shelf_height - board;
    cv::rectangle(image, {0, floor_y, size.width, board}, wood, cv::FILLED);
    for (int x = board; x < size.width - board;) {
      const int thickness = std::max(5, static_cast<int>(shelf_height * random.Uniform(0.08, 0.24)));
      const int height = static_cast<int>((shelf_height - board) * random.Uniform(0.6, 0.94));
      if (random.Below(12) == 0) x += thickness;  // A gap between books.
      const cv::Rect spine(x, floor_y - height, std::min(thickness, size.width - board - x), height);
      const cv::Scalar color = RandomColor(&random, 0.2, 0.95), ink = RandomColor(&random, 0.1, 1.0);
      if (spine.width < 4) break;
      cv::rectangle(image, spine, color, cv::FILLED);
      for (int band = random.Below(4); band > 0; --band) {
        const int y = spine.y + static_cast<int>(random.Uniform(0.05, 0.95) * height);
        cv::rectangle(image, cv::Rect(spine.x, y, spine.width, 2 + height / 30) & spine, ink, cv::FILLED);
      }
      // The title runs down the spine, so it is drawn on a horizontal strip that is rotated.
      cv::Mat strip(spine.width, height, CV_8UC3, color), rotated;
      const int letter = std::max(3, spine.width / 2);
      DrawWriting({height / 8, (spine.width - letter) / 2, height * 5 / 8, letter}, letter, ink, &random,
                  &strip);
      cv::rotate(strip, rotated, cv::ROTATE_90_CLOCKWISE);
      rotated(cv::Rect(0, height / 8, spine.width, height * 6 / 8))
          .copyTo(image(cv::Rect(spine.x, spine.y + height / 8, spine.width, height * 6 / 8)));
      cv::rectangle(image, spine, color * 0.3, 1, cv::LINE_AA);
      x += spine.width;
    }
  }
  AddField(NoiseField(size, size.width / 8, size.height / 8, 2, 0.8, &random), 8, &image);
  Weather(0.4, &random, &image);
  return image;
}

cv::Mat PaintPackage(cv::Size size, std::uint64_t seed) {
  Random random(seed);
  const cv::Scalar ground = RandomColor(&random, 0.35, 0.95), ink = RandomColor(&random, 0.05, 0.3);
  const cv::Scalar accent = RandomColor(&random, 0.5, 1.0);
  cv::Mat image = ColorsAlong(NoiseField(size, 2, 2, 4, 0.6, &random), ground * 0.75, ground * 1.1);
  const int third = size.width / 3;
  for (int face = 0; face < 3; ++face) {
    const cv::Rect area(face * third, 0, third, size.height);
    cv::Mat panel = image(area);
    cv::rectangle(panel, {0, static_cast<int>(random.Uniform(0, 0.6) * size.height), third, size.height / 6},
                  accent, cv::FILLED);
    for (int i = 0; i < 12; ++i) {
      const double radius = third * (0.03 + 0.3 * std::pow(random.Uniform(), 3));
      DrawShape(RandomPoint({0, 0, third, size.height}, &random), radius, RandomColor(&random), &random,
                &panel);
    }
    const int big = std::max(6, size.height / 9), small = std::max(4, size.height / 30);
    DrawWriting({third / 10, size.height / 12, third * 8 / 10, big}, big, face == 0 ? ink : accent * 0.5,
                &random, &panel);
    DrawWriting({third / 10, size.height * 6 / 10, third * 8 / 10, size.height / 5}, small, ink, &random,
                &panel);
    if (face == 2)
      DrawBarcode({third / 8, size.height * 83 / 100, third * 6 / 8, size.height / 8}, &random, &panel);
    cv::line(panel, {0, 0}, {0, size.height}, ground * 0.5, 1);
  }
  AddField(NoiseField(size, size.width / 8, size.height / 8, 2, 0.6, &random), 6, &image);
  Weather(0.5, &random, &image);
  return image;
}

cv::Mat PaintScreen(cv::Size size, std::uint64_t seed) {
  Random random(seed);
  cv::Mat image = ColorsAlong(NoiseField(size, 2, 2, 5, 0.6, &random), RandomColor(&random, 0.1, 0.3),
                              RandomColor(&random, 0.4, 0.8));
  for (int window = 0; window < 4; ++window) {
    const cv::Point corner(random.Below(size.width * 6 / 10), random.Below(size.height * 6 / 10));
    const cv::Rect area(corner.x, corner.y, size.width * 35 / 100, size.height * 36 / 100);
    const bool is_dark = random.Below(2) == 0;
    cv::rectangle(image, area, cv::Scalar::all(is_dark ? 35 : 235), cv::FILLED);
    cv::rectangle(image, {area.x, area.y, area.width, size.height / 28}, RandomColor(&random, 0.3, 0.7),
                  cv::FILLED);
    const int letter = std::max(5, size.height / 45);
    for (int line = 2; (line + 1) * letter * 2 < area.height; ++line) {
      const int indent = letter * static_cast<int>(1 + random.Below(4));
      const int length = static_cast<int>(random.Uniform(0.2, 0.7) * area.width);
      DrawWriting({area.x + indent, area.y + line * letter * 2 - letter, length, letter}, letter,
                  is_dark ? RandomColor(&random, 0.6, 1.0) : RandomColor(&random, 0.05, 0.4), &random,
                  &image);
    }
    cv::rectangle(image, area, cv::Scalar::all(90), 1);
  }
  cv::rectangle(image, {0, 0, size.width, size.height}, cv::Scalar::all(25), std::max(2, size.height / 25));
  return image;
}

cv::Mat PaintPage(cv::Size size, std::uint64_t seed) {
  Random random(seed);
  cv::Mat image(size, CV_8UC3, RandomColor(&random, 0.85, 0.97));
  const cv::Scalar ink = RandomColor(&random, 0.05, 0.35);
  const int margin = size.width / 12, letter = std::max(4, size.height / 40);
  DrawWriting({margin, margin, size.width - 2 * margin, letter * 3}, letter * 2, ink, &random, &image);
  DrawWriting({margin, margin + letter * 5, size.width - 2 * margin, size.height / 3}, letter, ink, &random,
              &image);
  const cv::Rect figure(margin, size.height / 2, size.width - 2 * margin, size.height * 2 / 5);
  cv::rectangle(image, figure, ink, 1, cv::LINE_AA);
  for (int i = 0; i < 24; ++i) {
    DrawShape(RandomPoint(figure, &random), figure.width * random.Uniform(0.015, 0.1), RandomColor(&random),
              &random, &image);
  }
  AddField(NoiseField(size, 4, 4, 5, 0.6, &random), 7, &image);
  return image;
}

cv::Mat PaintCabinet(cv::Size size, const cv::Scalar& color, std::uint64_t seed) {
  Random random(seed);
  cv::Mat image = PaintWood(size, color, 6, random.Next());
  const int columns = 3, rows = 2, gap = size.width / 60;
  const int width = size.width / columns, height = size.height / rows;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const cv::Rect door(column * width + gap, row * height + gap, width - 2 * gap, height - 2 * gap);
      const cv::Rect panel(door.x + width / 8, door.y + height / 8, door.width - width / 4,
                           door.height - height / 4);
      cv::rectangle(image, door, color * 0.25, std::max(1, gap / 2), cv::LINE_AA);
      cv::rectangle(image, panel, color * 0.4, std::max(1, gap / 3), cv::LINE_AA);
      const cv::Point2d middle(panel.x + panel.width / 2.0, panel.y + panel.height / 2.0);
      for (int carving = 0; carving < 7; ++carving) {
        DrawShape(middle, panel.height * (0.42 - 0.055 * carving), color * random.Uniform(0.3, 1.5), &random,
                  &image);
      }
      for (int i = 0; i < 16; ++i) {
        DrawShape(RandomPoint(panel, &random), width * random.Uniform(0.01, 0.05),
                  color * random.Uniform(0.25, 1.6), &random, &image);
      }
      cv::circle(image, {door.x + door.width - width / 16, static_cast<int>(middle.y)},
                 std::max(2, width / 30), cv::Scalar(90, 170, 200), cv::FILLED, cv::LINE_AA);
      cv::circle(image, {door.x + door.width - width / 16, static_cast<int>(middle.y)},
                 std::max(2, width / 30), cv::Scalar(20, 40, 50), 1, cv::LINE_AA);
    }
  }
  return image;
}

}  // namespace docent::app
