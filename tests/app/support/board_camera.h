// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "app/calibration/board.h"
#include "engine/base/random.h"
#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"

// Rendered images of calibration boards with exactly known corners.
namespace docent::app {

// Random camera_from_board poses of a board in front of the camera: all over the image, near and far, tilted
// in every direction.
inline std::vector<engine::Rigid3> BoardPoses(const BoardSpec& board, const engine::CameraModel& camera,
                                              int count) {
  Random random(11);
  std::vector<engine::Rigid3> poses;
  const Eigen::Vector2d size = board.square_m * Eigen::Vector2d(board.columns - 1, board.rows - 1);
  const Eigen::Vector3d middle(size.x() / 2, size.y() / 2, 0);
  while (static_cast<int>(poses.size()) < count) {
    const double turn = random.Uniform(0, 2 * std::numbers::pi), tilt = random.Uniform(0.2, 0.75);
    const engine::Rotation3 rotation =
        engine::Rotation3::Exp({tilt * std::cos(turn), tilt * std::sin(turn), 0}) *
        engine::Rotation3::Exp({0, 0, random.Uniform(-0.5, 0.5)});
    const Eigen::Vector2d pixel(random.Uniform(0.2, 0.8) * 639, random.Uniform(0.2, 0.8) * 479);
    const Eigen::Vector3d place = random.Uniform(0.28, 0.5) * *camera.Unproject(pixel);
    const engine::Rigid3 pose(rotation, place - rotation * middle);
    bool inside = true;
    for (const double x : {-board.square_m, size.x() + board.square_m}) {
      for (const double y : {-board.square_m, size.y() + board.square_m}) {
        const auto corner = camera.Project(pose * Eigen::Vector3d(x, y, 0));
        inside = inside && corner && camera.IsInside(*corner, 6);
      }
    }
    if (inside) poses.push_back(pose);
  }
  return poses;
}

// Renders a board exactly, by ray casting: every pixel is the mean of sixteen rays through the lens, followed
// by a slight lens blur and a little noise.
class BoardCamera {
 public:
  BoardCamera(const BoardSpec& board, const engine::CameraModel& camera)
      : board_(board), size_(camera.width_px(), camera.height_px()), sheet_(PaintBoard(board, kTexels)) {
    // One ray per pixel corner; within a pixel, rays are linear to a thousandth of a pixel.
    for (int y = 0; y <= size_.height; ++y) {
      for (int x = 0; x <= size_.width; ++x) {
        const auto ray = camera.Unproject({x - 0.5, y - 0.5});
        rays_.push_back(ray.value_or(Eigen::Vector3d::Zero()).cast<float>());
      }
    }
  }

  cv::Mat Image(const engine::Rigid3& camera_from_board, Random* random) const {
    // The inverse of the plane's homography maps a ray to its intersection with the sheet.
    Eigen::Matrix3d plane = camera_from_board.rotation.matrix();
    plane.col(2) = camera_from_board.translation;
    const Eigen::Matrix3f board_from_ray = plane.inverse().cast<float>();
    // Squares between the edge of the sheet and the origin: the border is one square wide, and a
    // checkerboard's first inner corner is one square further in.
    const float margin_squares = board_.kind == BoardSpec::Kind::kCharuco ? 1 : 2;
    const auto scale = static_cast<float>(1 / board_.square_m);
    cv::Mat fine(size_ * kOversampling, CV_8UC1);
    for (int y = 0; y < fine.rows; ++y) {
      for (int x = 0; x < fine.cols; ++x) {
        const Eigen::Vector3f hit = board_from_ray * Ray(x, y);
        uchar brightness = 120;
        if (hit.z() > 0) {
          const float u = (hit.x() / hit.z() * scale + margin_squares) * kTexels;
          const float v = (hit.y() / hit.z() * scale + margin_squares) * kTexels;
          if (u >= 0 && v >= 0 && u < sheet_.cols && v < sheet_.rows)
            brightness = sheet_.at<uchar>(static_cast<int>(v), static_cast<int>(u)) > 127 ? 210 : 30;
        }
        fine.at<uchar>(y, x) = brightness;
      }
    }
    cv::Mat exact, image;
    cv::resize(fine, exact, size_, 0, 0, cv::INTER_AREA);
    exact.convertTo(exact, CV_32F);
    cv::GaussianBlur(exact, exact, {}, 0.6);
    for (int i = 0; i < size_.area(); ++i) exact.at<float>(i) += static_cast<float>(random->Uniform(-3, 3));
    exact.convertTo(image, CV_8U);
    return image;
  }

 private:
  static constexpr int kOversampling = 4, kTexels = 200;

  Eigen::Vector3f Ray(int x, int y) const {
    const float u = (static_cast<float>(x % kOversampling) + 0.5f) / kOversampling;
    const float v = (static_cast<float>(y % kOversampling) + 0.5f) / kOversampling;
    const Eigen::Vector3f* upper =
        &rays_[static_cast<std::size_t>(y / kOversampling) * (size_.width + 1) + x / kOversampling];
    const Eigen::Vector3f* lower = upper + size_.width + 1;
    return (1 - v) * ((1 - u) * upper[0] + u * upper[1]) + v * ((1 - u) * lower[0] + u * lower[1]);
  }

  BoardSpec board_;
  cv::Size size_;
  cv::Mat sheet_;
  std::vector<Eigen::Vector3f> rays_;
};

}  // namespace docent::app
