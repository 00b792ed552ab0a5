// SPDX-License-Identifier: Apache-2.0
#include "app/calibration/calibrate.h"

#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "app/calibration/calibration_file.h"
#include "tests/app/support/board_camera.h"
#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

using engine::CameraModel;
using engine::LensModel;
using engine::Rigid3;
using ::testing::HasSubstr;
using ::testing::StartsWith;

// Camera models of the three types, with principal points off the image centre.
CameraModel LensOf(LensModel lens) {
  switch (lens) {
    case LensModel::kRadialTangential:
      return {lens, {640, 480, 452.0, 453.5, 325.3, 233.8}, {-0.21, 0.06, 0.0008, -0.0006, 0}};
    case LensModel::kFov:
      return {lens, {640, 480, 360.0, 361.0, 316.4, 244.9}, {0.92, 0, 0, 0, 0}};
    case LensModel::kKannalaBrandt:
      return {lens, {640, 480, 340.0, 340.8, 322.7, 236.1}, {-0.012, 0.006, -0.003, 0.0005, 0}};
  }
  return {};
}

BoardView Projected(const BoardSpec& board, const CameraModel& camera, const Rigid3& pose) {
  BoardView view;
  for (int i = 0; i < board.columns * board.rows; ++i) {
    view.points_on_board.emplace_back(board.square_m * (i % board.columns),
                                      board.square_m * (i / board.columns));
    const Eigen::Vector2d& point = view.points_on_board.back();
    view.pixels.push_back(*camera.Project(pose * Eigen::Vector3d(point.x(), point.y(), 0)));
  }
  return view;
}

std::vector<BoardView> RenderAndDetect(const BoardSpec& board, const CameraModel& camera, int count) {
  const BoardCamera renderer(board, camera);
  const BoardDetector detector(board);
  Random random(29);
  std::vector<BoardView> views;
  for (const Rigid3& pose : BoardPoses(board, camera, count)) {
    BoardView view = detector.Detect(renderer.Image(pose, &random));
    if (!view.pixels.empty()) views.push_back(std::move(view));
  }
  return views;
}

// Expects the focal length within a thousandth and the principal point within half a pixel.
void ExpectNear(const CameraModel& found, const CameraModel& truth) {
  EXPECT_EQ(found.lens(), truth.lens());
  const auto record = [](const char* what, double value) {
    testing::Test::RecordProperty(what, std::to_string(value));
  };
  record("fx_off_percent", 100 * (found.intrinsics().fx / truth.intrinsics().fx - 1));
  record("fy_off_percent", 100 * (found.intrinsics().fy / truth.intrinsics().fy - 1));
  record("cx_off_px", found.intrinsics().cx - truth.intrinsics().cx);
  record("cy_off_px", found.intrinsics().cy - truth.intrinsics().cy);
  EXPECT_NEAR(found.intrinsics().fx / truth.intrinsics().fx, 1, 0.001);
  EXPECT_NEAR(found.intrinsics().fy / truth.intrinsics().fy, 1, 0.001);
  EXPECT_NEAR(found.intrinsics().cx, truth.intrinsics().cx, 0.5);
  EXPECT_NEAR(found.intrinsics().cy, truth.intrinsics().cy, 0.5);
}

class EveryLens : public testing::TestWithParam<LensModel> {};

TEST_P(EveryLens, IsRecoveredExactlyFromExactCorners) {
  const BoardSpec board;
  const CameraModel truth = LensOf(GetParam());
  std::vector<BoardView> views;
  for (const Rigid3& pose : BoardPoses(board, truth, 12)) views.push_back(Projected(board, truth, pose));
  const auto solution = SolveLens(GetParam(), 640, 480, views);
  ASSERT_TRUE(solution);
  EXPECT_LT(solution->rms_px, 1e-5);
  EXPECT_NEAR(solution->camera.intrinsics().fx, truth.intrinsics().fx, 1e-3);
  EXPECT_NEAR(solution->camera.intrinsics().cy, truth.intrinsics().cy, 1e-3);
}

TEST_P(EveryLens, IsRecoveredFromRenderedCheckerboards) {
  const BoardSpec board;
  const CameraModel truth = LensOf(GetParam());
  const std::vector<BoardView> views = RenderAndDetect(board, truth, 24);
  ASSERT_GE(views.size(), 15u);
  CalibrationOptions options;
  options.lens = GetParam();
  const Calibration calibration = Calibrate(views, 640, 480, options);
  ExpectNear(calibration.camera, truth);
  EXPECT_LT(calibration.cross_validated_px, 0.05);
  RecordProperty("cross_validated_px", std::to_string(calibration.cross_validated_px));
  EXPECT_THAT(calibration.assessment, StartsWith("Good"));
}

INSTANTIATE_TEST_SUITE_P(Calibrate, EveryLens,
                         testing::Values(LensModel::kRadialTangential, LensModel::kFov,
                                         LensModel::kKannalaBrandt));

TEST(Calibrate, SupportsPartlyVisibleCharucoBoards) {
  const BoardSpec board = ParseBoard("charuco:8x6:30");
  const CameraModel truth = LensOf(LensModel::kRadialTangential);
  const std::vector<BoardView> views = RenderAndDetect(board, truth, 20);
  ASSERT_GE(views.size(), 15u);
  const Calibration calibration = Calibrate(views, 640, 480, {});
  // Other models may fit this lens as well; the cross-validation error must be small.
  EXPECT_LT(calibration.cross_validated_px, 0.1);
  CalibrationOptions options;
  options.lens = LensModel::kRadialTangential;
  ExpectNear(Calibrate(views, 640, 480, options).camera, truth);
}

TEST(Calibrate, ChoosesTheModelByCrossValidation) {
  const BoardSpec board;
  Random random(3);
  for (const LensModel lens : {LensModel::kRadialTangential, LensModel::kFov, LensModel::kKannalaBrandt}) {
    const CameraModel truth = LensOf(lens);
    std::vector<BoardView> views;
    for (const Rigid3& pose : BoardPoses(board, truth, 20)) {
      views.push_back(Projected(board, truth, pose));
      for (Eigen::Vector2d& pixel : views.back().pixels)
        pixel += Eigen::Vector2d(random.Uniform(-0.05, 0.05), random.Uniform(-0.05, 0.05));
    }
    const Calibration calibration = Calibrate(views, 640, 480);
    EXPECT_LT(calibration.cross_validated_px, 0.06) << static_cast<int>(lens);
    EXPECT_NEAR(calibration.camera.intrinsics().cx, truth.intrinsics().cx, 0.5);
  }
}

TEST(Calibrate, RejectsAViewWithWrongCorners) {
  const BoardSpec board;
  const CameraModel truth = LensOf(LensModel::kFov);
  std::vector<BoardView> views;
  for (const Rigid3& pose : BoardPoses(board, truth, 14)) views.push_back(Projected(board, truth, pose));
  std::swap(views[4].pixels[0], views[4].pixels[30]);
  CalibrationOptions options;
  options.lens = LensModel::kFov;
  const Calibration calibration = Calibrate(views, 640, 480, options);
  EXPECT_EQ(calibration.views_used, 13u);
  EXPECT_NEAR(calibration.camera.intrinsics().fx, truth.intrinsics().fx, 0.01);
}

TEST(Calibrate, ChoosesInformativeViewsWithoutDuplicates) {
  const BoardSpec board;
  const CameraModel truth = LensOf(LensModel::kFov);
  std::vector<BoardView> views;
  const std::vector<Rigid3> poses = BoardPoses(board, truth, 6);
  for (int i = 0; i < 30; ++i) views.push_back(Projected(board, truth, poses[0]));  // thirty identical views
  for (std::size_t i = 1; i < poses.size(); ++i) views.push_back(Projected(board, truth, poses[i]));
  const auto solution = SolveLens(LensModel::kFov, 640, 480, views);
  ASSERT_TRUE(solution);
  const std::vector<std::size_t> chosen = ChooseViews(solution->information, 6);
  ASSERT_EQ(chosen.size(), 6u);
  EXPECT_GE(std::count_if(chosen.begin(), chosen.end(), [](std::size_t i) { return i >= 30; }), 4);
}

TEST(Calibrate, ReportsMissingViews) {
  EXPECT_THAT(ErrorOf([] { Calibrate(std::vector<BoardView>(2), 640, 480); }), HasSubstr("only 2 images"));
  const BoardSpec board;
  const CameraModel truth = LensOf(LensModel::kFov);
  Coverage coverage(640, 480);
  EXPECT_THAT(coverage.Advice(), HasSubstr("show the board"));
  for (const Rigid3& pose : BoardPoses(board, truth, 1)) coverage.Add(Projected(board, truth, pose));
  EXPECT_GT(coverage.Ratio(), 0.05);
  EXPECT_LT(coverage.Ratio(), 0.9);
}

TEST(Calibrate, RoundTripsThroughAFileWithItsAssessment) {
  Calibration calibration;
  calibration.camera = LensOf(LensModel::kKannalaBrandt);
  calibration.assessment = "Good: it is.";
  const std::string text = FormatCalibration(calibration, BoardSpec());
  EXPECT_EQ(ParseCalibration(text, "file"), calibration.camera);
  EXPECT_THAT(text, HasSubstr("assessment: \"Good: it is.\""));
}

TEST(Boards, ParseValidTextAndRejectInvalidText) {
  EXPECT_EQ(FormatBoard(ParseBoard("checkerboard:9x6:24.5")), "checkerboard:9x6:24.5");
  EXPECT_EQ(FormatBoard(ParseBoard("charuco:8x6:30")), "charuco:8x6:30");
  for (const char* text : {"", "charuco", "charuco:8x6", "board:8x6:30", "charuco:8:30", "charuco:2x6:30",
                           "charuco:8x6:0", "charuco:8x6:nan", "checkerboard:9x-6:20"}) {
    EXPECT_THAT(ErrorOf([&] { ParseBoard(text); }), HasSubstr("calibration board")) << text;
  }
}

// The left of the image has too little contrast, so that corners of the last columns alone can be refined.
TEST(Boards, AreNotFoundWhereMostCornersCannotBeRefined) {
  const BoardSpec board;
  const cv::Mat sheet = PaintBoard(board, 40);
  Random random(5);
  cv::Mat image(sheet.size(), CV_8UC1);
  const auto paint = [&](double left_contrast, double right_contrast) {
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < image.cols; ++x) {
        const double contrast = x < 0.62 * image.cols ? left_contrast : right_contrast;
        const double brightness = 110 + contrast * (sheet.at<uchar>(y, x) / 127.5 - 1);
        image.at<uchar>(y, x) = static_cast<uchar>(std::lround(brightness + random.Uniform(-0.5, 0.5)));
      }
    }
  };
  const BoardDetector detector(board);
  paint(11, 20);
  EXPECT_EQ(detector.Detect(image).pixels.size(), 54u) << "all corners have enough contrast";
  paint(2, 20);
  std::vector<cv::Point2f> corners;
  ASSERT_TRUE(
      cv::findChessboardCornersSB(image, {board.columns, board.rows}, corners, cv::CALIB_CB_NORMALIZE_IMAGE));
  EXPECT_TRUE(detector.Detect(image).pixels.empty());
}

TEST(Boards, AreWrittenAsPdf) {
  const TemporaryFolder folder;
  for (const char* text : {"checkerboard:9x6:25", "charuco:8x6:30"}) {
    PrintBoard(ParseBoard(text), folder / "board.pdf");
    std::ifstream file(folder / "board.pdf", std::ios::binary);
    std::string start(5, ' ');
    file.read(start.data(), 5);
    EXPECT_EQ(start, "%PDF-");
  }
  EXPECT_THAT(ErrorOf([&] { PrintBoard(BoardSpec(), folder / "no/board.pdf"); }), HasSubstr("Cannot write"));
}

// The RMS error of OpenCV's own pipeline: its corner detection, its refinement with the window of its sample
// program, and its calibration.
double OpenCvRms(const std::vector<cv::Mat>& images, const BoardSpec& board) {
  std::vector<std::vector<cv::Point3f>> points;
  std::vector<std::vector<cv::Point2f>> pixels;
  const cv::Size size(board.columns, board.rows);
  for (const cv::Mat& image : images) {
    std::vector<cv::Point2f> corners;
    if (!cv::findChessboardCorners(image, size, corners,
                                   cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE))
      continue;
    cv::cornerSubPix(image, corners, {11, 11}, {-1, -1},
                     {cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 30, 1e-4});
    pixels.push_back(corners);
    points.emplace_back();
    for (int i = 0; i < size.area(); ++i)
      points.back().emplace_back(static_cast<float>(board.square_m * (i % board.columns)),
                                 static_cast<float>(board.square_m * (i / board.columns)), 0.0f);
  }
  cv::Mat camera, distortion;
  std::vector<cv::Mat> rotations, translations;
  return cv::calibrateCamera(points, pixels, images.front().size(), camera, distortion, rotations,
                             translations);
}

// The RMS error of OpenCV's calibration with our corners.
double OpenCvRms(const std::vector<BoardView>& views, const cv::Size& size) {
  std::vector<std::vector<cv::Point3f>> points(views.size());
  std::vector<std::vector<cv::Point2f>> pixels(views.size());
  for (std::size_t i = 0; i < views.size(); ++i) {
    for (std::size_t k = 0; k < views[i].pixels.size(); ++k) {
      const Eigen::Vector2f point = views[i].points_on_board[k].cast<float>();
      const Eigen::Vector2f pixel = views[i].pixels[k].cast<float>();
      points[i].emplace_back(point.x(), point.y(), 0.0f);
      pixels[i].emplace_back(pixel.x(), pixel.y());
    }
  }
  cv::Mat camera, distortion;
  std::vector<cv::Mat> rotations, translations;
  return cv::calibrateCamera(points, pixels, size, camera, distortion, rotations, translations);
}

// Uses OpenCV's sample images, where Debian's opencv-doc is installed.
TEST(Calibrate, IsAtLeastAsGoodAsOpenCvOnItsSampleImages) {
  const std::filesystem::path folder = "/usr/share/doc/opencv-doc/examples/data";
  const BoardSpec board = ParseBoard("checkerboard:9x6:25");
  const BoardDetector detector(board);
  for (const char* side : {"left", "right"}) {
    std::vector<cv::Mat> images;
    std::vector<BoardView> views;
    for (int i = 1; i <= 14; ++i) {
      const std::string name = side + std::string(i < 10 ? "0" : "") + std::to_string(i) + ".jpg";
      const cv::Mat image = cv::imread((folder / name).string(), cv::IMREAD_GRAYSCALE);
      if (image.empty()) continue;
      images.push_back(image);
      BoardView view = detector.Detect(image);
      if (!view.pixels.empty()) views.push_back(std::move(view));
    }
    if (images.empty()) GTEST_SKIP() << "Debian's opencv-doc, which has the images, is not installed";
    ASSERT_GE(views.size(), 12u) << side;
    const cv::Size size = images.front().size();
    const auto solution = SolveLens(LensModel::kRadialTangential, size.width, size.height, views);
    ASSERT_TRUE(solution);
    const double opencv_px = OpenCvRms(images, board), same_corners_px = OpenCvRms(views, size);
    RecordProperty(std::string(side) + "_views", std::to_string(views.size()));
    RecordProperty(std::string(side) + "_docent_rms_px", std::to_string(solution->rms_px));
    RecordProperty(std::string(side) + "_opencv_rms_px", std::to_string(opencv_px));
    RecordProperty(std::string(side) + "_opencv_rms_px_with_docents_corners",
                   std::to_string(same_corners_px));
    EXPECT_LE(solution->rms_px, opencv_px) << side;
    EXPECT_LE(solution->rms_px, same_corners_px * (1 + 1e-4)) << side;
  }
}

}  // namespace
}  // namespace docent::app
