// SPDX-License-Identifier: Apache-2.0
#include "app/calibration/display_file.h"

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "app/calibration/yaml_reader.h"
#include "app/files/text_file.h"
#include "engine/base/error.h"

namespace docent::app {

namespace {

std::vector<double> NeedNumbers(const YamlReader& file, const std::string& field, std::size_t count) {
  std::vector<double> numbers = file.Numbers(field);
  if (numbers.size() == count) return numbers;
  throw Error(file.name() + ": the field '" + field + "' has " + std::to_string(numbers.size()) +
              " numbers instead of " + std::to_string(count) + ".");
}

Eigen::Vector3d VectorOf(const YamlReader& file, const std::string& field) {
  const std::vector<double> numbers = NeedNumbers(file, field, 3);
  return {numbers[0], numbers[1], numbers[2]};
}

DisplayEye ReadEye(const YamlReader& file, const std::string& side) {
  constexpr double kMostApart_m = 1;  // An eye that is further from the camera is on another head.
  constexpr double kMostTurned_deg = 360;
  const std::vector<double> lens = NeedNumbers(file, side, 4);
  const engine::CameraModel::Intrinsics intrinsics{
      file.Integer("width"), file.Integer("height"), lens[0], lens[1], lens[2], lens[3]};
  const auto model = engine::LensModel::kRadialTangential;
  if (const auto problem = engine::CameraModel::Validate(model, intrinsics, {}))
    throw Error(file.name() + " does not describe a display: " + *problem);
  const Eigen::Vector3d position = VectorOf(file, side + "_position");
  if (position.norm() > kMostApart_m)
    throw Error(file.name() + ": the field '" + side +
                "_position' is more than a metre away from the camera.");
  Eigen::Vector3d rotation_deg = Eigen::Vector3d::Zero();
  if (file.Has(side + "_rotation")) rotation_deg = VectorOf(file, side + "_rotation");
  // The square of a huge angle is infinite, and the rotation not a number.
  if (rotation_deg.norm() > kMostTurned_deg)
    throw Error(file.name() + ": the field '" + side + "_rotation' turns the eye by more than 360 degrees.");
  DisplayEye eye;
  eye.camera = engine::CameraModel(model, intrinsics, {});
  eye.eye_from_camera.rotation =
      engine::Rotation3::Exp(Eigen::Vector3d(rotation_deg * (std::numbers::pi / 180))).inverse();
  eye.eye_from_camera.translation = -(eye.eye_from_camera.rotation * position);
  return eye;
}

}  // namespace

DisplayCalibration ReadDisplayCalibration(const std::filesystem::path& path) {
  constexpr std::size_t kMaxBytes = 1 << 20;
  return ParseDisplayCalibration(ReadTextFile(path, kMaxBytes), path.string());
}

DisplayCalibration ParseDisplayCalibration(const std::string& text, const std::string& name) {
  const YamlReader file(text, name);
  return {{ReadEye(file, "left"), ReadEye(file, "right")}};
}

}  // namespace docent::app
