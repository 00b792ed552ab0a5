// SPDX-License-Identifier: Apache-2.0
// Tests of simulated camera faults against their exact mathematical effect.
#include "app/simulator/camera_faults.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <utility>
#include <vector>

#include "app/files/text_file.h"
#include "app/simulator/calibration_error.h"
#include "app/simulator/exposure_jumps.h"
#include "app/simulator/frame_drops.h"
#include "app/simulator/named_options.h"
#include "app/simulator/sensor.h"
#include "app/simulator/simulation.h"
#include "app/simulator/surface_renderer.h"
#include "app/simulator/tremor.h"
#include "engine/base/error.h"
#include "tests/app/support/error_of_scene.h"
#include "tests/app/support/rad_per_degree.h"

namespace docent::app {
namespace {

using engine::CameraModel;
using engine::LensModel;
using ::testing::HasSubstr;

constexpr double kPanRate = 60 * kRadPerDegree;  // radians per second

CameraModel Pinhole() {
  return {LensModel::kRadialTangential, {320, 240, 200, 200, 159.5, 119.5}, {}};
}

// A camera that pans to the right at a constant rate in front of a wall, which is black to the left and white
// to the right of a vertical edge. The edge is straight ahead at half a second.
Scene PannedEdge() {
  Scene scene;
  const int black = scene.surfaces.AddTexture(cv::Mat(8, 8, CV_8UC3, cv::Scalar::all(0)));
  const int white = scene.surfaces.AddTexture(cv::Mat(8, 8, CV_8UC3, cv::Scalar::all(255)));
  scene.surfaces.AddRectangle({-30, -30, 3}, {30, 0, 0}, {0, 60, 0}, black);
  scene.surfaces.AddRectangle({0, -30, 3}, {30, 0, 0}, {0, 60, 0}, white);
  Trajectory trajectory(1);
  trajectory.BeginSegment("rotation");
  for (int i = 0; i <= 10; ++i)
    trajectory.MoveTo(Eigen::Vector3d::Zero(), kPanRate * 0.1 * (i - 5), 0, 0.1, 0);
  scene.trajectory = trajectory;
  scene.camera = Pinhole();
  return scene;
}

Simulation Panned(const CameraFaults& faults) {
  SimulationOptions options = SimulationOptions::Clean();
  options.faults = faults;
  return {"panned", PannedEdge(), options};
}

// The x coordinate of the edge of PannedEdge in a row, from the number of white pixels.
double EdgeIn(const cv::Mat& bgr, int row) {
  double white = 0;
  for (int x = 0; x < bgr.cols; ++x) white += bgr.at<cv::Vec3b>(row, x)[0] / 255.0;
  return bgr.cols - 0.5 - white;
}

// Its true x coordinate at a time, by the pinhole projection.
double TrueEdge(double time_s) {
  return 159.5 - 200 * std::tan(kPanRate * (time_s - 0.5));
}

TEST(RollingShutter, SlantsAnEdgeByThePanRateTimesTheReadoutTime) {
  constexpr double kReadout_s = 0.03;
  const Simulation simulation = Panned({.readout_s = kReadout_s});
  cv::Mat image;
  simulation.Render(15, &image);  // at half a second
  for (int row = 0; row < 240; ++row)
    EXPECT_NEAR(EdgeIn(image, row), TrueEdge(0.5 + kReadout_s * ((row + 0.5) / 240 - 0.5)), 0.3) << row;
  const double slant = EdgeIn(image, 0) - EdgeIn(image, 239);
  EXPECT_NEAR(slant, 200 * kPanRate * kReadout_s * 239 / 240, 0.3);
  EXPECT_NEAR(EdgeIn(image, 120), TrueEdge(0.5), 0.3) << "the time of an image is that of its middle row";
}

TEST(RollingShutter, GroundTruthIsThePoseOfTheMiddleRow) {
  const Simulation rolling = Panned({.readout_s = 0.03}), global = Panned({});
  EXPECT_TRUE(engine::IsNear(rolling.world_from_camera(15), global.world_from_camera(15), 1e-12, 1e-12));
  // SurfaceAt uses the pose of the pixel's own row, so that the pixel of the edge gives the edge.
  cv::Mat image;
  rolling.Render(15, &image);
  for (const int row : {5, 120, 235}) {
    const auto point = rolling.SurfaceAt(15, {EdgeIn(image, row), static_cast<double>(row)});
    ASSERT_TRUE(point);
    EXPECT_NEAR(point->x(), 0, 0.006) << "metres; a third of a pixel is 5 mm there";
  }
}

TEST(RollingShutter, EqualsAGlobalShutterIfAllRowsHaveOnePose) {
  const auto simulation = MakeSimulation("room", SimulationOptions::Clean());
  const Scene scene = BuildRoom({});
  const SurfaceRenderer renderer(&scene.surfaces, simulation->camera());
  for (const int frame : {0, 100}) {
    const engine::Rigid3 pose = simulation->world_from_camera(frame).inverse();
    cv::Mat whole, by_rows;
    renderer.Render(pose, &whole);
    renderer.RenderRows(std::vector(480, pose), &by_rows);
    EXPECT_EQ(cv::norm(whole, by_rows, cv::NORM_INF), 0);
  }
}

TEST(RollingShutter, RendersEachRowFromItsOwnPose) {
  SimulationOptions options = SimulationOptions::Clean();
  options.faults.readout_s = 0.03;
  options.faults.interlaced = true;
  const auto simulation = MakeSimulation("room", options);
  const Scene scene = BuildRoom({.seed = options.seed});
  const SurfaceRenderer renderer(&scene.surfaces, simulation->camera());
  cv::Mat image, whole;
  simulation->Render(45, &image);
  for (const int row : {3, 150, 301, 476}) {
    const double offset_s = 0.03 * ((row + 0.5) / 480 - 0.5) + (row % 2) / 60.0;
    const engine::Rigid3 pose = scene.trajectory.WorldFromCamera(45 / 30.0 + offset_s);
    renderer.Render(pose.inverse(), &whole);
    // Object edges are averaged over neighbouring rows, so that a few pixels may differ.
    int differing = 0;
    for (int x = 0; x < 640; ++x)
      differing += image.at<cv::Vec3b>(row, x) != whole.at<cv::Vec3b>(row, x) ? 1 : 0;
    EXPECT_LT(differing, 32) << "row " << row;
  }
}

TEST(Interlacing, ShowsOddRowsHalfAFrameLater) {
  const Simulation simulation = Panned({.interlaced = true});
  cv::Mat image;
  simulation.Render(15, &image);
  for (int row = 0; row < 240; ++row)
    EXPECT_NEAR(EdgeIn(image, row), TrueEdge(0.5 + (row % 2) / 60.0), 0.3) << row;
}

TEST(CalibrationError, ChangesTheCalibrationButNotTheImages) {
  SimulationOptions options;
  options.camera = SimulatedCamera(320);
  const auto right = MakeSimulation("room", options);
  options.faults.focal_error = 0.01;
  const auto wrong = MakeSimulation("room", options);
  EXPECT_EQ(right->calibration(), right->camera());
  EXPECT_EQ(wrong->camera(), right->camera());
  EXPECT_DOUBLE_EQ(wrong->calibration().intrinsics().fx, 1.01 * right->camera().intrinsics().fx);
  EXPECT_DOUBLE_EQ(wrong->calibration().intrinsics().fy, 1.01 * right->camera().intrinsics().fy);
  EXPECT_EQ(wrong->calibration().intrinsics().cx, right->camera().intrinsics().cx);
  EXPECT_EQ(wrong->calibration().distortion(), right->camera().distortion());
  cv::Mat with_error, without_error;
  right->Render(3, &without_error);
  wrong->Render(3, &with_error);
  EXPECT_EQ(cv::norm(with_error, without_error, cv::NORM_INF), 0);
}

TEST(CalibrationError, DisplacesRaysByTheGivenPixels) {
  const CameraModel::Intrinsics intrinsics{640, 480, 400, 401, 321, 238};
  for (const CameraModel& lens :
       {CameraModel(LensModel::kRadialTangential, intrinsics, {-0.1, 0.01, 0, 0, 0}),
        CameraModel(LensModel::kFov, intrinsics, {0.9, 0, 0, 0, 0}),
        CameraModel(LensModel::kKannalaBrandt, intrinsics, {-0.02, 0.004, 0, 0, 0})}) {
    for (const double error_px : {-3.0, 0.5, 2.0}) {
      const CameraModel wrong = WrongCalibration(lens, 0, error_px);
      EXPECT_NEAR(MisplacementRms(wrong, lens).value(), std::abs(error_px), 1e-6);
      EXPECT_GT(error_px * (wrong.distortion()[0] - lens.distortion()[0]), 0);
    }
    EXPECT_EQ(WrongCalibration(lens, 0, 0), lens);
  }
}

TEST(CalibrationError, IsRefusedIfNoFileCouldHoldTheCalibration) {
  const CameraModel lens(LensModel::kRadialTangential, {640, 480, 400, 401, 321, 238}, {-0.3, 0, 0, 0, 0});
  ASSERT_FALSE(CameraModel::Validate(lens.lens(), lens.intrinsics(), lens.distortion()));
  EXPECT_THAT(ErrorOf([&] { WrongCalibration(lens, -0.5, 0); }), HasSubstr("calibration is invalid"));
}

TEST(FrameDrops, DropTheGivenRatioSinglyAndInBursts) {
  for (const double share : {0.05, 0.3, 0.8}) {
    constexpr int kFrames = 100000;
    const std::vector<int> kept = KeptFrames(kFrames, share, 7);
    EXPECT_EQ(kept.front(), 0);
    EXPECT_NEAR(1 - kept.size() / static_cast<double>(kFrames), share, 0.02);
    EXPECT_TRUE(std::is_sorted(kept.begin(), kept.end(), std::less_equal<>()));
  }
  const std::vector<int> kept = KeptFrames(100000, 0.1, 7);
  int alone = 0, in_bursts = 0;
  for (std::size_t i = 1; i < kept.size(); ++i) {
    const int lost = kept[i] - kept[i - 1] - 1;
    (lost < 3 ? alone : in_bursts) += lost;
  }
  EXPECT_NEAR(alone / static_cast<double>(alone + in_bursts), 0.5, 0.08);
  EXPECT_EQ(KeptFrames(100, 0, 7).size(), 100u);
}

TEST(FrameDrops, KeepTimesAndPosesOfTheRemainingFrames) {
  SimulationOptions options = SimulationOptions::Clean();
  options.camera = SimulatedCamera(160);
  const auto whole = MakeSimulation("room", options), lossy = MakeSimulation("room,drops=30", options);
  ASSERT_LT(lossy->frame_count(), whole->frame_count());
  cv::Mat image, expected;
  for (int frame = 0; frame < lossy->frame_count(); ++frame) {
    const auto original = static_cast<int>(std::lround(ToSeconds(lossy->time(frame)) * 30));
    EXPECT_EQ(lossy->time(frame), whole->time(original));
    EXPECT_TRUE(frame == 0 || lossy->time(frame) > lossy->time(frame - 1));
    EXPECT_TRUE(
        engine::IsNear(lossy->world_from_camera(frame), whole->world_from_camera(original), 1e-12, 1e-12));
    if (frame % 100 != 50) continue;
    lossy->Render(frame, &image);
    whole->Render(original, &expected);
    EXPECT_EQ(cv::norm(image, expected, cv::NORM_INF), 0);
  }
}

TEST(ExposureJumps, StepAndRecover) {
  const ExposureJumps jumps(1, 300, 5);
  ASSERT_NEAR(static_cast<double>(jumps.jumps().size()), 100, 40) << "one in three seconds";
  int up = 0;
  for (std::size_t i = 0; i < jumps.jumps().size(); ++i) {
    const auto& [time_s, stops] = jumps.jumps()[i];
    up += stops > 0 ? 1 : 0;
    EXPECT_GE(std::abs(stops), 0.5);
    EXPECT_LE(std::abs(stops), 1);
    EXPECT_NEAR(std::log2(jumps.Gain(time_s) / jumps.Gain(time_s - 1e-9)), stops, 1e-6);
    const double next_s = i + 1 < jumps.jumps().size() ? jumps.jumps()[i + 1].time_s : 1e9;
    if (next_s - time_s < ExposureJumps::kRecovery_s) continue;
    EXPECT_NEAR(std::log2(jumps.Gain(time_s + ExposureJumps::kRecovery_s - 1e-9)),
                std::log2(jumps.Gain(time_s)) / std::numbers::e, 1e-6);
  }
  EXPECT_GT(up, 20);
  EXPECT_LT(up, static_cast<int>(jumps.jumps().size()) - 20);
  EXPECT_EQ(jumps.Gain(0), 1);
  EXPECT_EQ(ExposureJumps().Gain(3), 1);
}

TEST(Sensor, ClipsHighlightsWhenTheGainIsHigh) {
  const Sensor sensor({.size = {64, 48}, .gain = 1.9});
  cv::Mat dark(48, 64, CV_8UC3, cv::Scalar::all(100)), bright(48, 64, CV_8UC3, cv::Scalar::all(140));
  sensor.Apply(0, 0, &dark);
  sensor.Apply(0, 0, &bright);
  EXPECT_EQ(dark.at<cv::Vec3b>(20, 20), cv::Vec3b(190, 190, 190));
  EXPECT_EQ(bright.at<cv::Vec3b>(20, 20), cv::Vec3b(255, 255, 255));
}

TEST(Sensor, NoiseVarianceGrowsWithSignalAndGain) {
  // Rounding to whole grey values adds a variance of 1/12.
  const auto variance = [](double light, double gain, double constant_sigma) {
    const Sensor sensor(
        {.size = {640, 480}, .noise_sigma = constant_sigma, .gain = gain, .gain_noise_sigma = 4});
    cv::Mat image(480, 640, CV_8UC3, cv::Scalar::all(light));
    sensor.Apply(0, 0, &image);
    cv::Scalar mean, deviation;
    cv::meanStdDev(image, mean, deviation);
    EXPECT_NEAR(mean[1], light * gain, 0.1);
    return deviation[1] * deviation[1] - 1.0 / 12;
  };
  for (const double light : {32.0, 64.0, 128.0})
    EXPECT_NEAR(variance(light, 1, 0), 16 * light / 128, 0.04 * 16 * light / 128) << light;
  EXPECT_NEAR(variance(64, 2, 0), 2 * 16, 0.04 * 32) << "a signal of 128 at a gain of 2";
  EXPECT_NEAR(variance(64, 1, 3), 8 + 9, 0.04 * 17) << "variances add";
}

// The RMS rotation about each axis and RMS translation, and the ratio of the rotation's power between two
// frequencies.
struct Motion {
  Eigen::Vector3d rotation_rms_rad, translation_rms_m;
  double power_ratio_in_band = 0;
};

Motion Analyse(const Tremor& tremor, double low_hz, double high_hz) {
  constexpr double kRate_hz = 40, kDuration_s = 30;
  constexpr int kCount = static_cast<int>(kRate_hz * kDuration_s);
  std::vector<double> about_x;
  Motion motion{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  for (int i = 0; i < kCount; ++i) {
    const engine::Rigid3 pose = tremor.SteadyFromTrembling(i / kRate_hz);
    motion.rotation_rms_rad += pose.rotation.Log().cwiseAbs2() / kCount;
    motion.translation_rms_m += pose.translation.cwiseAbs2() / kCount;
    about_x.push_back(pose.rotation.Log().x());
  }
  motion.rotation_rms_rad = motion.rotation_rms_rad.cwiseSqrt();
  motion.translation_rms_m = motion.translation_rms_m.cwiseSqrt();
  // The discrete Fourier transform with a Hann window.
  double all = 0, inside = 0;
  for (int k = 1; k < kCount / 2; ++k) {
    const double frequency_hz = k / kDuration_s;
    std::complex<double> sum;
    for (int i = 0; i < kCount; ++i) {
      const double window = 0.5 - 0.5 * std::cos(2 * std::numbers::pi * i / kCount);
      sum += window * about_x[static_cast<std::size_t>(i)] *
             std::polar(1.0, -2 * std::numbers::pi * k * i / kCount);
    }
    all += std::norm(sum);
    if (frequency_hz >= low_hz && frequency_hz <= high_hz) inside += std::norm(sum);
  }
  motion.power_ratio_in_band = inside / all;
  return motion;
}

TEST(HandTremor, HasTheGivenAmplitudeAndFrequencyBand) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    const Motion motion = Analyse(Tremor(0.2, seed), 3.9, 12.1);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(motion.rotation_rms_rad[axis], 0.2 * kRadPerDegree, 0.02 * kRadPerDegree)
          << "axis " << axis;
      EXPECT_NEAR(motion.translation_rms_m[axis], 0.2 * kRadPerDegree * Tremor::kLever_m, 4e-5)
          << "axis " << axis;
    }
    EXPECT_GT(motion.power_ratio_in_band, 0.999);
  }
  EXPECT_LT(Analyse(Tremor(0.2, 1), 8, 12.1).power_ratio_in_band, 0.3)
      << "low frequencies have larger amplitudes";
}

TEST(HandTremor, IsIncludedInTheGroundTruth) {
  SimulationOptions options = SimulationOptions::Clean();
  options.camera = SimulatedCamera(320);
  options.duration_s = 2;
  const auto steady = MakeSimulation("room", options), trembling = MakeSimulation("room,tremor=0.5", options);
  double largest = 0;
  for (int i = 0; i < steady->frame_count(); ++i) {
    const engine::Rigid3 step = steady->world_from_camera(i).inverse() * trembling->world_from_camera(i);
    largest = std::max(largest, step.rotation.Angle());
    EXPECT_LT(step.translation.norm(), 0.01);
  }
  EXPECT_GT(largest, 0.5 * kRadPerDegree);
  EXPECT_LT(largest, 4 * kRadPerDegree);
  // The image must be the one from the true pose.
  cv::Mat image, from_truth;
  trembling->Render(7, &image);
  steady->RenderFrom(trembling->world_from_camera(7), 7, &from_truth);
  EXPECT_EQ(cv::norm(image, from_truth, cv::NORM_INF), 0);
}

TEST(HandTremor, DiffersBetweenTwoCamerasOfOnePerson) {
  SimulationOptions options = SimulationOptions::Clean();
  options.faults.tremor_deg = 0.5;
  const auto hand = MakeSimulation("hand:1", options), shoulder = MakeSimulation("shoulder:1", options);
  const engine::Rigid3 before = hand->world_from_camera(0).inverse() * shoulder->world_from_camera(0),
                       after = hand->world_from_camera(4).inverse() * shoulder->world_from_camera(4);
  EXPECT_FALSE(engine::IsNear(before, after, 1e-4, 1e-4));
}

TEST(NamedOptions, FollowTheSceneNameAfterCommas) {
  const auto simulation = MakeSimulation(
      "museum:2,rolling-shutter=20,focal-error=1,distortion-error=-0.5,gain=1.5,exposure-jumps=1,gain-noise="
      "3,"
      "drops=10,tremor=0.1,blur=2,exposure=10,fps=20,duration=3,noise=2,interlaced,identical-places,walk=4,"
      "rest=2,rest-at=1,build=9,rounds=2");
  const SimulationOptions& options = simulation->options();
  EXPECT_DOUBLE_EQ(options.faults.readout_s, 0.02);
  EXPECT_DOUBLE_EQ(options.faults.focal_error, 0.01);
  EXPECT_EQ(options.faults.distortion_error_px, -0.5);
  EXPECT_EQ(options.faults.gain, 1.5);
  EXPECT_EQ(options.faults.exposure_jump_stops, 1);
  EXPECT_EQ(options.faults.gain_noise_sigma, 3);
  EXPECT_DOUBLE_EQ(options.faults.dropped_share, 0.1);
  EXPECT_EQ(options.faults.tremor_deg, 0.1);
  EXPECT_EQ(options.blur_samples, 2);
  EXPECT_DOUBLE_EQ(options.exposure_s, 0.01);
  EXPECT_EQ(options.frame_rate_hz, 20);
  EXPECT_EQ(options.duration_s, 3);
  EXPECT_EQ(options.noise_sigma, 2);
  EXPECT_TRUE(options.faults.interlaced);
  EXPECT_TRUE(options.identical_places);
  EXPECT_EQ(options.walk, 4u);
  EXPECT_EQ(options.rest_s, 2);
  EXPECT_EQ(options.rest_at_s, 1);
  EXPECT_EQ(options.build_s, 9);
  EXPECT_EQ(options.rounds, 2);
  EXPECT_EQ(simulation->scene_name(), "museum");
  EXPECT_EQ(simulation->places().size(), 2u);
}

TEST(NamedOptions, SayTheirDefaultsInTheHelp) {
  const SimulationOptions defaults;
  for (const auto& [name, value] : {std::pair<std::string, double>{"fps", defaults.frame_rate_hz},
                                    {"noise", defaults.noise_sigma},
                                    {"exposure", 1000 * defaults.exposure_s}}) {
    for (const NamedOption& option : NamedOptions()) {
      if (option.name != name) continue;
      EXPECT_THAT(option.meaning, HasSubstr("(default " + FormatNumber(value, 3) + ")")) << name;
    }
  }
}

TEST(NamedOptions, ReportWhatIsWrong) {
  EXPECT_THAT(ErrorOfScene("room,fog=1"), ::testing::AllOf(HasSubstr("'fog'"), HasSubstr("rolling-shutter"),
                                                           HasSubstr("tremor"), HasSubstr("drops")));
  EXPECT_THAT(ErrorOfScene("room,"), HasSubstr("no option ''"));
  EXPECT_THAT(ErrorOfScene("room,drops"), HasSubstr("needs a number"));
  EXPECT_THAT(ErrorOfScene("room,drops="), HasSubstr("from 0 to 90"));
  EXPECT_THAT(ErrorOfScene("room,drops=many"), HasSubstr("'many'"));
  EXPECT_THAT(ErrorOfScene("room,drops=91"), HasSubstr("from 0 to 90"));
  EXPECT_THAT(ErrorOfScene("room,blur=1.5"), HasSubstr("whole number"));
  EXPECT_THAT(ErrorOfScene("room,interlaced=1"), HasSubstr("takes no number"));
  EXPECT_THAT(ErrorOfScene("room,gain=2,gain=3"), HasSubstr("twice"));
  EXPECT_THAT(ErrorOfScene("room,rolling-shutter=40"), HasSubstr("between two frames"));
  EXPECT_THAT(ErrorOfScene("room,distortion-error=nan"), HasSubstr("from -20 to 20"));
  EXPECT_THAT(ErrorOfScene("attic,drops=1"), HasSubstr("attic"));
}

TEST(CameraFaults, ReportWhatIsWrong) {
  const auto sentence = [](auto change) {
    CameraFaults faults;
    change(faults);
    return faults.Validate(30).value_or("");
  };
  EXPECT_EQ(sentence([](auto&) {}), "");
  EXPECT_THAT(sentence([](auto& faults) { faults.readout_s = std::nan(""); }), HasSubstr("readout"));
  EXPECT_THAT(sentence([](auto& faults) { faults.focal_error = -0.6; }), HasSubstr("focal length"));
  EXPECT_THAT(sentence([](auto& faults) { faults.distortion_error_px = 30; }), HasSubstr("distortion"));
  EXPECT_THAT(sentence([](auto& faults) { faults.gain = 0; }), HasSubstr("gain"));
  EXPECT_THAT(sentence([](auto& faults) { faults.exposure_jump_stops = 5; }), HasSubstr("stops"));
  EXPECT_THAT(sentence([](auto& faults) { faults.gain_noise_sigma = -1; }), HasSubstr("gain noise"));
  EXPECT_THAT(sentence([](auto& faults) { faults.dropped_share = 1; }), HasSubstr("dropped frames"));
  EXPECT_THAT(sentence([](auto& faults) { faults.tremor_deg = 6; }), HasSubstr("tremor"));
}

}  // namespace
}  // namespace docent::app
