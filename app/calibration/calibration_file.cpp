// SPDX-License-Identifier: Apache-2.0
#include "app/calibration/calibration_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <vector>

#include "app/calibration/yaml_reader.h"
#include "app/files/checked_file.h"
#include "app/files/text_file.h"
#include "engine/base/error.h"

namespace docent::app {

namespace {

using engine::CameraModel;
using engine::LensModel;
using Distortion = std::array<double, 5>;

std::optional<LensModel> LensFromName(const std::string& name) {
  static constexpr std::array<std::pair<const char*, LensModel>, 12> kNames = {{
      {"pinhole", LensModel::kRadialTangential},
      {"radial-tangential", LensModel::kRadialTangential},
      {"radial_tangential", LensModel::kRadialTangential},
      {"radtan", LensModel::kRadialTangential},
      {"plumb_bob", LensModel::kRadialTangential},
      {"rational_polynomial", LensModel::kRadialTangential},
      {"none", LensModel::kRadialTangential},
      {"fov", LensModel::kFov},
      {"kannala_brandt", LensModel::kKannalaBrandt},
      {"equidistant", LensModel::kKannalaBrandt},
      {"fisheye", LensModel::kKannalaBrandt},
      {"equi", LensModel::kKannalaBrandt},
  }};
  for (const auto& [known, lens] : kNames) {
    if (name == known) return lens;
  }
  return std::nullopt;
}

LensModel NeedLens(const YamlReader& file, const std::string& field, const std::string& name) {
  const std::optional<LensModel> lens = LensFromName(name);
  if (!lens) {
    throw Error(file.name() + ": the field '" + field + "' names the lens model '" + name +
                "', which is not pinhole, fov or kannala_brandt.");
  }
  return *lens;
}

CameraModel Checked(const YamlReader& file, LensModel lens, const CameraModel::Intrinsics& intrinsics,
                    const Distortion& distortion) {
  if (const auto problem = CameraModel::Validate(lens, intrinsics, distortion)) {
    throw Error(file.name() + " does not describe a camera: " + *problem);
  }
  return CameraModel(lens, intrinsics, distortion);
}

// Converts a coefficient list of any length. Coefficients beyond those of the lens model must be zero.
Distortion NeedDistortion(const YamlReader& file, const std::string& field, LensModel lens,
                          const std::vector<double>& values) {
  const std::size_t used = lens == LensModel::kRadialTangential ? 5
                           : lens == LensModel::kKannalaBrandt  ? 4
                                                                : 1;
  Distortion distortion{};
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (i < used) {
      distortion[i] = values[i];
    } else if (values[i] != 0) {
      throw Error(file.name() + ": the field '" + field + "' has " + std::to_string(values.size()) +
                  " coefficients, but the lens model has only " + std::to_string(used) + ".");
    }
  }
  return distortion;
}

// The camera with the readout time that the file states, if it does.
CameraModel WithShutter(const YamlReader& file, const CameraModel& camera) {
  const char* const rows = "rolling_shutter_ms";
  const char* const columns = "rolling_shutter_columns_ms";
  if (!file.Has(rows) && !file.Has(columns)) return camera;
  const auto seconds = [&](const char* field) {
    constexpr double kMax_ms = 1000;  // as in a stored map
    const double value_ms = file.NumberOr(field, 0);
    if (!(std::abs(value_ms) <= kMax_ms))
      throw Error(file.name() + ": the field '" + field + "' must be from -1000 to 1000 milliseconds.");
    return value_ms / 1000;
  };
  const Eigen::Vector2d readout_s(seconds(columns), seconds(rows));
  if (readout_s.x() != 0 && readout_s.y() != 0) {
    throw Error(file.name() + ": only one of the fields '" + rows + "' and '" + columns +
                "' can differ from zero.");
  }
  return camera.WithKnownReadout(readout_s);
}

constexpr std::initializer_list<const char*> kCoefficientLists = {
    "distortion_coefficients", "distortion_coeffs", "dist_coeffs", "D", "d"};

// Throws Error for a coefficient that the lens model does not have, because the lens would lose it.
void RefuseOtherCoefficients(const YamlReader& file, std::initializer_list<const char*> used) {
  for (const char* name : {"k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2", "omega"}) {
    const bool is_used = std::any_of(used.begin(), used.end(),
                                     [name](const char* one) { return std::string_view(one) == name; });
    if (!is_used && file.NumberOr(name, 0) != 0) {
      throw Error(file.name() + ": the field '" + name +
                  "' is no coefficient of the file's lens model or stands beside a list of them.");
    }
  }
}

// The lens model of a file with scalars. Some tools write `model: pinhole` beside `distortion_model`.
LensModel OwnLens(const YamlReader& file) {
  const std::string model = file.TextOr("model", "pinhole");
  const LensModel lens = NeedLens(file, "model", model);
  if (!file.Has("distortion_model")) return lens;
  const LensModel distortion = NeedLens(file, "distortion_model", file.Text("distortion_model"));
  if (model != "pinhole" && distortion != lens) {
    throw Error(file.name() + ": the fields 'model' and 'distortion_model' name different lens models.");
  }
  return distortion;
}

CameraModel FromOwn(const YamlReader& file) {
  const LensModel lens = OwnLens(file);
  const CameraModel::Intrinsics intrinsics{file.Integer("width"), file.Integer("height"), file.Number("fx"),
                                           file.Number("fy"),     file.Number("cx"),      file.Number("cy")};
  if (const std::string list = file.FirstOf(kCoefficientLists); !list.empty()) {
    RefuseOtherCoefficients(file, {});
    return Checked(file, lens, intrinsics, NeedDistortion(file, list, lens, file.Numbers(list)));
  }
  Distortion distortion{};
  switch (lens) {
    case LensModel::kRadialTangential:
      RefuseOtherCoefficients(file, {"k1", "k2", "p1", "p2", "k3"});
      distortion = {file.NumberOr("k1", 0), file.NumberOr("k2", 0), file.NumberOr("p1", 0),
                    file.NumberOr("p2", 0), file.NumberOr("k3", 0)};
      break;
    case LensModel::kFov:
      RefuseOtherCoefficients(file, {"omega"});
      distortion[0] = file.Number("omega");
      break;
    case LensModel::kKannalaBrandt:
      RefuseOtherCoefficients(file, {"k1", "k2", "k3", "k4"});
      distortion = {file.Number("k1"), file.Number("k2"), file.Number("k3"), file.Number("k4"), 0};
      break;
  }
  return Checked(file, lens, intrinsics, distortion);
}

// Reads OpenCV's own files and ROS camera_info: a 3x3 camera matrix and a list of coefficients.
CameraModel FromMatrix(const YamlReader& file, const std::string& matrix_field) {
  const std::vector<double> k = file.Numbers(matrix_field);
  if (k.size() != 9) throw Error(file.name() + ": the field '" + matrix_field + "' is not a 3x3 matrix.");
  if (k[1] != 0 || k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1) {
    throw Error(file.name() + ": the field '" + matrix_field + "' has skew or is not a camera matrix.");
  }
  const auto need = [&](std::initializer_list<const char*> fields) {
    const std::string field = file.FirstOf(fields);
    return field.empty() ? std::string(*fields.begin()) : field;
  };
  const CameraModel::Intrinsics intrinsics{file.Integer(need({"image_width", "width"})),
                                           file.Integer(need({"image_height", "height"})),
                                           k[0],
                                           k[4],
                                           k[2],
                                           k[5]};
  LensModel lens = LensModel::kRadialTangential;
  if (const std::string field = file.FirstOf({"distortion_model", "model"}); !field.empty()) {
    lens = NeedLens(file, field, file.Text(field));
  } else if (file.NumberOr("fisheye_model", 0) != 0) {  // Written by OpenCV's calibration sample.
    lens = LensModel::kKannalaBrandt;
  }
  const std::string field = need(kCoefficientLists);
  return Checked(file, lens, intrinsics, NeedDistortion(file, field, lens, file.Numbers(field)));
}

CameraModel FromEuroc(const YamlReader& file) {
  const std::vector<double> focal_and_center = file.Numbers("intrinsics");
  if (focal_and_center.size() != 4)
    throw Error(file.name() + ": the field 'intrinsics' is not [fx, fy, cx, cy].");
  const std::vector<double> size = file.Numbers("resolution");
  if (size.size() != 2 || size[0] < 1 || size[1] < 1 || size[0] > 1e6 || size[1] > 1e6) {
    throw Error(file.name() + ": the field 'resolution' is not [width, height].");
  }
  const std::string camera_model = file.TextOr("camera_model", "pinhole");
  if (camera_model != "pinhole") {
    throw Error(file.name() + ": the field 'camera_model' is '" + camera_model +
                "', but only 'pinhole' is supported.");
  }
  const LensModel lens = NeedLens(file, "distortion_model", file.TextOr("distortion_model", "none"));
  const std::string field = file.Has("distortion_coeffs") ? "distortion_coeffs" : "distortion_coefficients";
  const CameraModel::Intrinsics intrinsics{static_cast<int>(size[0]), static_cast<int>(size[1]),
                                           focal_and_center[0],       focal_and_center[1],
                                           focal_and_center[2],       focal_and_center[3]};
  return Checked(file, lens, intrinsics, NeedDistortion(file, field, lens, file.Numbers(field)));
}

CameraModel LensOf(const YamlReader& file) {
  if (const std::string matrix = file.FirstOf({"camera_matrix", "Camera_Matrix", "K", "k"});
      !matrix.empty()) {
    return FromMatrix(file, matrix);
  }
  if (file.Has("intrinsics")) return FromEuroc(file);
  return FromOwn(file);
}

}  // namespace

CameraModel ParseCalibration(const std::string& text, const std::string& name) {
  const YamlReader file(text, name);
  return WithShutter(file, LensOf(file));
}

CameraModel ReadCalibration(const std::filesystem::path& path) {
  return ParseCalibration(ReadTextFile(path, std::size_t{1} << 20), "'" + path.string() + "'");
}

std::string FormatCalibration(const CameraModel& camera) {
  const auto& in = camera.intrinsics();
  const auto& d = camera.distortion();
  std::string text;
  const auto line = [&text](const char* field, double value) {
    text += std::string(field) + ": " + FormatExactly(value) + "\n";
  };
  text += "width: " + std::to_string(in.width_px) + "\nheight: " + std::to_string(in.height_px) + "\n";
  line("fx", in.fx), line("fy", in.fy), line("cx", in.cx), line("cy", in.cy);
  switch (camera.lens()) {
    case LensModel::kRadialTangential:
      line("k1", d[0]), line("k2", d[1]), line("p1", d[2]), line("p2", d[3]), line("k3", d[4]);
      break;
    case LensModel::kFov:
      text += "model: fov\n";
      line("omega", d[0]);
      break;
    case LensModel::kKannalaBrandt:
      text += "model: kannala_brandt\n";
      line("k1", d[0]), line("k2", d[1]), line("k3", d[2]), line("k4", d[3]);
      break;
  }
  if (const auto& readout_s = camera.known_readout_s()) {
    if (readout_s->x() == 0) {
      line("rolling_shutter_ms", 1000 * readout_s->y());
    } else {
      line("rolling_shutter_columns_ms", 1000 * readout_s->x());
    }
  }
  return text;
}

void WriteCalibration(const std::filesystem::path& path, const CameraModel& camera) {
  CheckedFile file(path);
  file.Write(FormatCalibration(camera));
  file.Close();
}

std::optional<std::filesystem::path> FindCalibration(const std::filesystem::path& folder) {
  for (const char* name : {"calibration.yaml", "camera.yaml", "camera_info.yaml", "sensor.yaml",
                           "mav0/cam0/sensor.yaml", "cam0/sensor.yaml"}) {
    std::filesystem::path path = folder / name;
    if (std::filesystem::is_regular_file(path)) return path;
  }
  return std::nullopt;
}

void CheckImageSize(const CameraModel& camera, int width_px, int height_px, const std::string& source,
                    const std::string& calibration) {
  if (camera.width_px() == width_px && camera.height_px() == height_px) return;
  const auto size = [](int width, int height) {
    return std::to_string(width) + "x" + std::to_string(height);
  };
  const std::string own = size(camera.width_px(), camera.height_px());
  // Codecs round image sizes, which changes the aspect ratio by a few thousandths.
  const double shape = static_cast<double>(camera.width_px()) * height_px / camera.height_px() / width_px;
  const std::string advice = std::abs(shape - 1) < 0.005
                                 ? "use images of that size (--camera-format " + own +
                                       ") or calibrate at the image size (docent calibrate)"
                                 : "their aspect ratio differs too, so calibrate at the image size (docent "
                                   "calibrate)";
  throw Error("The images of " + source + " are " + size(width_px, height_px) + " pixels, but " +
              calibration + " is for " + own + "; " + advice + ".");
}

}  // namespace docent::app
