// SPDX-License-Identifier: Apache-2.0
#include "app/calibration/calibration_file.h"

#include <gmock/gmock.h>

#include <opencv2/core.hpp>

#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

using engine::CameraModel;
using engine::LensModel;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr char kOwn[] =
    "# a comment\nwidth: 752\nheight: 480\nfx: 458.654\nfy: 457.296\ncx: 367.215\ncy: 248.375\n"
    "k1: -0.28340811\nk2: 0.07395907\np1: 0.00019359\np2: 1.76187114e-05\n";

const CameraModel kEuroc(LensModel::kRadialTangential, {752, 480, 458.654, 457.296, 367.215, 248.375},
                         {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05, 0});

std::string Without(const std::string& field) {
  std::string text = kOwn;
  const std::size_t begin = text.find(field + ":");
  return text.erase(begin, text.find('\n', begin) - begin + 1);
}

TEST(Calibration, ReadsDocentFiles) {
  EXPECT_EQ(ParseCalibration(kOwn, "own"), kEuroc);
}

TEST(Calibration, ReadsEurocSensorFilesDespiteTheirYamlDirective) {
  const std::string text =
      "%YAML:1.0\n# General\nsensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [1.0, 0.0, 0.0, 0.0,\n"
      "         0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]\nrate_hz: 20\nresolution: [752, "
      "480]\n"
      "camera_model: pinhole\nintrinsics: [458.654, 457.296, 367.215, 248.375] #fu, fv, cu, cv\n"
      "distortion_model: radial-tangential\n"
      "distortion_coefficients: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]\n";
  EXPECT_EQ(ParseCalibration(text, "sensor.yaml"), kEuroc);
}

TEST(Calibration, ReadsOpenCvFiles) {
  const TemporaryFolder folder;
  const auto path = folder / "opencv.yaml";
  {
    cv::FileStorage file(path.string(), cv::FileStorage::WRITE);
    const cv::Mat matrix = (cv::Mat_<double>(3, 3) << 458.654, 0, 367.215, 0, 457.296, 248.375, 0, 0, 1);
    const cv::Mat distortion =
        (cv::Mat_<double>(1, 5) << -0.28340811, 0.07395907, 0.00019359, 1.76187114e-05, 0);
    file << "image_width" << 752 << "image_height" << 480 << "camera_matrix" << matrix
         << "distortion_coefficients" << distortion;
  }
  EXPECT_EQ(ReadCalibration(path), kEuroc);
}

TEST(Calibration, ReadsRosCameraInfoFilesAndMessages) {
  const std::string file =
      "image_width: 752\nimage_height: 480\ncamera_name: left\ncamera_matrix:\n  rows: 3\n  cols: 3\n"
      "  data: [458.654, 0, 367.215, 0, 457.296, 248.375, 0, 0, 1]\ndistortion_model: plumb_bob\n"
      "distortion_coefficients:\n  rows: 1\n  cols: 5\n"
      "  data: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05, 0]\n";
  EXPECT_EQ(ParseCalibration(file, "camera_info"), kEuroc);
  const std::string message =
      "header:\n  seq: 1\nheight: 480\nwidth: 752\ndistortion_model: \"plumb_bob\"\n"
      "D: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05, 0.0]\n"
      "K: [458.654, 0.0, 367.215, 0.0, 457.296, 248.375, 0.0, 0.0, 1.0]\nbinning_x: 0\n";
  EXPECT_EQ(ParseCalibration(message, "message"), kEuroc);
}

TEST(Calibration, ReadsTheOtherLensModels) {
  const std::string head = "width: 640\nheight: 480\nfx: 300\nfy: 301\ncx: 320\ncy: 240\n";
  EXPECT_EQ(ParseCalibration(head + "model: fov\nomega: 0.9\n", "fov"),
            CameraModel(LensModel::kFov, {640, 480, 300, 301, 320, 240}, {0.9, 0, 0, 0, 0}));
  EXPECT_EQ(ParseCalibration(head + "model: kannala_brandt\nk1: 0.1\nk2: -0.02\nk3: 0.003\nk4: -0.0004\n",
                             "fisheye"),
            CameraModel(LensModel::kKannalaBrandt, {640, 480, 300, 301, 320, 240},
                        {0.1, -0.02, 0.003, -0.0004, 0}));
}

TEST(Calibration, KeepsTheLensModelAndTheListOfCoefficientsBesideScalars) {
  const std::string head = "width: 640\nheight: 480\nfx: 300\nfy: 301\ncx: 320\ncy: 240\n";
  const CameraModel fisheye(LensModel::kKannalaBrandt, {640, 480, 300, 301, 320, 240},
                            {0.1, -0.02, 0.003, -0.0004, 0});
  const std::string coefficients = "k1: 0.1\nk2: -0.02\nk3: 0.003\nk4: -0.0004\n";
  const auto read = [&](const std::string& text) { return ParseCalibration(head + text, "file"); };
  EXPECT_EQ(read("distortion_model: equidistant\n" + coefficients), fisheye);
  EXPECT_EQ(read("model: pinhole\ndistortion_model: equidistant\n" + coefficients), fisheye);
  EXPECT_EQ(read("model: fisheye\ndistortion_coefficients: [0.1, -0.02, 0.003, -0.0004]\n"), fisheye);
  EXPECT_EQ(read("distortion_coefficients: [-0.28, 0.07, 0.001, 0.002, 0.01]\n").distortion(),
            (std::array<double, 5>{-0.28, 0.07, 0.001, 0.002, 0.01}));
  EXPECT_EQ(read("k1: -0.05\nk4: 0\nomega: 0\n").distortion()[0], -0.05);
  const auto error = [&](const std::string& text) { return ErrorOf([&] { read(text); }); };
  EXPECT_THAT(error("model: fov\nomega: 0.9\ndistortion_model: equidistant\n"), HasSubstr("different"));
  EXPECT_THAT(error("distortion_model: thin_prism\n"), HasSubstr("'thin_prism'"));
  EXPECT_THAT(error("k1: 0.1\nk4: 0.01\n"), HasSubstr("'k4'"));
  EXPECT_THAT(error("omega: 0.9\n"), HasSubstr("'omega'"));
  EXPECT_THAT(error("model: fov\nomega: 0.9\nk1: 0.1\n"), HasSubstr("'k1'"));
  EXPECT_THAT(error("model: kannala_brandt\np1: 0.1\n" + coefficients), HasSubstr("'p1'"));
  EXPECT_THAT(error("k1: 0.1\ndistortion_coefficients: [0.2, 0, 0, 0]\n"), HasSubstr("'k1'"));
}

TEST(Calibration, ReadsTheExampleOfThePackage) {
  const engine::CameraModel camera = ReadCalibration(DOCENT_SOURCE_DIR "/packaging/camera.yaml");
  EXPECT_EQ(camera.width_px(), 640);
  EXPECT_EQ(camera.height_px(), 480);
}

TEST(Calibration, RoundTripsThroughAFile) {
  const TemporaryFolder folder;
  for (const CameraModel& camera :
       {kEuroc, CameraModel(LensModel::kFov, {640, 480, 300.1, 1e3 / 3, 320, 240}, {0.9, 0, 0, 0, 0}),
        CameraModel(LensModel::kKannalaBrandt, {640, 480, 300, 301, 320, 240},
                    {0.1, -0.02, 0.003, -0.0004, 0})}) {
    WriteCalibration(folder / "camera.yaml", camera);
    EXPECT_EQ(ReadCalibration(folder / "camera.yaml"), camera);
  }
}

TEST(Calibration, ReadsAndWritesTheReadoutTimeOfARollingShutter) {
  const std::string head = "width: 640\nheight: 480\nfx: 300\nfy: 301\ncx: 320\ncy: 240\n";
  const auto read = [&](const std::string& text) {
    return ParseCalibration(head + text, "file").known_readout_s();
  };
  EXPECT_FALSE(read(""));
  EXPECT_EQ(read("rolling_shutter_ms: 20\n"), Eigen::Vector2d(0, 0.02));
  EXPECT_EQ(read("rolling_shutter_columns_ms: -15\n"), Eigen::Vector2d(-0.015, 0));
  EXPECT_EQ(read("rolling_shutter_ms: 0\n"), Eigen::Vector2d(0, 0)) << "a global shutter";
  for (const char* text :
       {"", "rolling_shutter_ms: 20\n", "rolling_shutter_columns_ms: -15\n", "rolling_shutter_ms: 0\n"}) {
    const CameraModel camera = ParseCalibration(head + text, "file");
    const CameraModel again = ParseCalibration(FormatCalibration(camera), "again");
    EXPECT_EQ(again.known_readout_s(), camera.known_readout_s()) << text;
  }
  for (const char* text : {"rolling_shutter_ms: 2000\n", "rolling_shutter_columns_ms: -1e9\n",
                           "rolling_shutter_ms: .nan\n", "rolling_shutter_ms: fast\n"}) {
    EXPECT_THAT(ErrorOf([&] { read(text); }), HasSubstr("rolling_shutter")) << text;
  }
  EXPECT_THAT(ErrorOf([&] { read("rolling_shutter_ms: 20\nrolling_shutter_columns_ms: 20\n"); }),
              HasSubstr("only one"));
}

TEST(Calibration, NamesTheFileAndTheMissingField) {
  for (const char* field : {"width", "height", "fx", "fy", "cx", "cy"}) {
    EXPECT_THAT(ErrorOf([&] { ParseCalibration(Without(field), "'desk.yaml'"); }),
                AllOf(HasSubstr("'desk.yaml'"), HasSubstr(std::string("'") + field + "'")));
  }
}

TEST(Calibration, IsRejectedWithAnErrorIfInvalid) {
  const auto error = [](const std::string& text) { return ErrorOf([&] { ParseCalibration(text, "file"); }); };
  EXPECT_THAT(error(Without("fx") + "fx: nan\n"), HasSubstr("'fx'"));
  EXPECT_THAT(error(Without("fx") + "fx: wide\n"), HasSubstr("'fx'"));
  EXPECT_THAT(error(Without("fx") + "fx: -500\n"), HasSubstr("file"));
  EXPECT_THAT(error(Without("width") + "width: 0\n"),
              AllOf(HasSubstr("file does not describe a camera"), ::testing::EndsWith("pixels.")));
  EXPECT_THAT(error(Without("width") + "width: 752.5\n"), HasSubstr("'width'"));
  EXPECT_THAT(error(std::string(kOwn) + "model: omnidirectional\n"), HasSubstr("'omnidirectional'"));
  EXPECT_THAT(error("- 1\n- 2\n"), HasSubstr("not a calibration"));
  EXPECT_THAT(error(""), HasSubstr("not a calibration"));
  EXPECT_THAT(error("fx: [1, 2"), HasSubstr("YAML"));
  EXPECT_THAT(error(std::string(100'000, '[')), HasSubstr("nested"));
  EXPECT_THAT(error("camera_matrix: [1, 2, 3]\n"), HasSubstr("3x3"));
}

TEST(Calibration, IsRejectedIfItHasUnsupportedCoefficients) {
  const std::string head =
      "image_width: 752\nimage_height: 480\ncamera_matrix: [458, 0, 367, 0, 457, 248, 0, 0, 1]\n"
      "distortion_model: rational_polynomial\ndistortion_coefficients: [-0.28, 0.07, 0, 0, 0, ";
  EXPECT_THAT(ParseCalibration(head + "0, 0, 0]\n", "file").distortion(), ElementsAre(-0.28, 0.07, 0, 0, 0));
  EXPECT_THAT(ErrorOf([&] { ParseCalibration(head + "0, 0.5, 0]\n", "file"); }), HasSubstr("8 coefficients"));
}

TEST(Calibration, IsRejectedForImagesOfAnotherSize) {
  EXPECT_NO_THROW(CheckImageSize(kEuroc, 752, 480, "desk", "camera.yaml"));
  EXPECT_THAT(
      ErrorOf([] { CheckImageSize(kEuroc, 640, 480, "desk", "camera.yaml"); }),
      AllOf(HasSubstr("640x480"), HasSubstr("752x480"), HasSubstr("camera.yaml"), HasSubstr("aspect ratio")));
  EXPECT_THAT(ErrorOf([] { CheckImageSize(kEuroc, 1504, 960, "desk", "camera.yaml"); }),
              AllOf(HasSubstr("--camera-format 752x480"), HasSubstr("docent calibrate")));
}

TEST(Calibration, IsFoundInSequenceFolders) {
  const TemporaryFolder folder;
  EXPECT_FALSE(FindCalibration(folder.path()));
  const auto sensor = folder.Write("mav0/cam0/sensor.yaml", "");
  EXPECT_EQ(FindCalibration(folder.path()), sensor);
  const auto own = folder.Write("calibration.yaml", kOwn);
  EXPECT_EQ(FindCalibration(folder.path()), own);
}

TEST(Calibration, IsReadForEveryRecordedSequence) {
  const std::filesystem::path sequences = DOCENT_SOURCE_DIR "/../shared/sequences";
  if (!std::filesystem::exists(sequences)) GTEST_SKIP() << "the recorded sequences are not on this machine";
  int read = 0;
  for (const auto& entry : std::filesystem::directory_iterator(sequences)) {
    if (!entry.is_directory()) continue;
    const auto path = FindCalibration(entry.path());
    ASSERT_TRUE(path) << entry.path();
    EXPECT_GT(ReadCalibration(*path).width_px(), 0) << *path;
    ++read;
  }
  EXPECT_GT(read, 0) << "the folder is empty";
}

}  // namespace
}  // namespace docent::app
