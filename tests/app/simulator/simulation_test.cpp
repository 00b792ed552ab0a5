// SPDX-License-Identifier: Apache-2.0
#include "app/simulator/simulation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <numbers>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <set>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "tests/app/support/error_of_scene.h"

namespace docent::app {
namespace {

using ::testing::HasSubstr;

SimulationOptions SmallAndClean() {
  SimulationOptions options = SimulationOptions::Clean();
  options.camera = SimulatedCamera(320);
  return options;
}

bool SameImage(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() && cv::norm(a, b, cv::NORM_INF) == 0;
}

// The labels in the order in which they begin.
std::vector<std::string> LabelSequence(const Simulation& simulation) {
  std::vector<std::string> labels;
  for (int i = 0; i < simulation.frame_count(); ++i) {
    if (labels.empty() || labels.back() != simulation.label(i)) labels.push_back(simulation.label(i));
  }
  return labels;
}

double GreyAt(const cv::Mat& grey, const Eigen::Vector2d& pixel) {
  const int x = static_cast<int>(pixel.x()), y = static_cast<int>(pixel.y());
  const double fx = pixel.x() - x, fy = pixel.y() - y;
  const auto at = [&](int column, int row) { return static_cast<double>(grey.at<uchar>(row, column)); };
  return (1 - fy) * ((1 - fx) * at(x, y) + fx * at(x + 1, y)) +
         fy * ((1 - fx) * at(x, y + 1) + fx * at(x + 1, y + 1));
}

class EveryScene : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Simulation, EveryScene,
                         ::testing::Values("room:1", "museum:2", "desks:2", "cylinder:10", "loop", "grass"),
                         [](const auto& scene) {
                           const std::string name = scene.param;
                           return name.substr(0, name.find(':'));
                         });

// The ground truth must match the images: the surface point that frame i shows at a pixel appears in frame j
// where the ground truth projects it. A position two pixels off must fit worse.
TEST_P(EveryScene, GroundTruthMatchesTheImages) {
  const auto simulation = MakeSimulation(GetParam(), SmallAndClean());
  const engine::CameraModel& camera = simulation->camera();
  const int step = 8;
  double difference_at_truth = 0, difference_beside_truth = 0;
  int compared = 0;
  for (int i = 5; i + step < simulation->frame_count(); i += simulation->frame_count() / 4) {
    const int j = i + step;
    cv::Mat image_i, image_j, grey_i, grey_j;
    simulation->Render(i, &image_i);
    simulation->Render(j, &image_j);
    cv::cvtColor(image_i, grey_i, cv::COLOR_BGR2GRAY);
    cv::cvtColor(image_j, grey_j, cv::COLOR_BGR2GRAY);
    for (int y = 12; y < camera.height_px() - 12; y += 9) {
      for (int x = 12; x < camera.width_px() - 12; x += 9) {
        const auto point = simulation->SurfaceAt(i, {x, y});
        if (!point || !simulation->IsVisible(j, *point)) continue;
        const auto pixel = camera.Project(simulation->world_from_camera(j).inverse() * *point);
        if (!pixel || !camera.IsInside(*pixel, 4)) continue;
        const double grey = grey_i.at<uchar>(y, x);
        difference_at_truth += std::abs(grey - GreyAt(grey_j, *pixel));
        difference_beside_truth += std::abs(grey - GreyAt(grey_j, *pixel + Eigen::Vector2d(2, 0)));
        ++compared;
      }
    }
  }
  ASSERT_GT(compared, 500);
  EXPECT_LT(difference_at_truth / compared, 6.0) << "grey levels";
  EXPECT_LT(difference_at_truth, 0.6 * difference_beside_truth);
}

TEST_P(EveryScene, IsBitIdenticalForASeedAndDiffersForAnother) {
  SimulationOptions options;
  options.camera = SimulatedCamera(160);
  options.blur_samples = 2;
  cv::Mat first, again, other;
  const auto simulation = MakeSimulation(GetParam(), options);
  simulation->Render(0, &again);
  simulation->Render(7, &first);
  const auto duplicate = MakeSimulation(GetParam(), options);
  duplicate->Render(7, &again);
  EXPECT_TRUE(SameImage(first, again)) << "an image must not depend on what was rendered before";
  EXPECT_TRUE(
      engine::IsNear(simulation->world_from_camera(7), duplicate->world_from_camera(7), 1e-12, 1e-12));
  options.seed = 2;
  MakeSimulation(GetParam(), options)->Render(7, &other);
  EXPECT_FALSE(SameImage(first, other));
}

TEST_P(EveryScene, HasManyKeypointsOnEveryLevelAllOverTheImage) {
  const auto simulation = MakeSimulation(GetParam(), SimulationOptions{});
  for (int part = 0; part < 5; ++part) {
    const int frame = (simulation->frame_count() - 1) * part / 4;
    cv::Mat image, grey;
    simulation->Render(frame, &image);
    cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
    constexpr int kMinCorners[] = {700, 400, 150, 50};
    for (int level = 0; level < 4; ++level) {
      std::vector<cv::KeyPoint> corners;
      cv::FAST(grey, corners, 10);
      std::set<std::pair<int, int>> cells;
      for (const cv::KeyPoint& corner : corners) {
        cells.insert({static_cast<int>(corner.pt.x * 8 / static_cast<float>(grey.cols)),
                      static_cast<int>(corner.pt.y * 6 / static_cast<float>(grey.rows))});
      }
      EXPECT_GT(static_cast<int>(corners.size()), kMinCorners[level])
          << "frame " << frame << ", level " << level;
      EXPECT_GT(cells.size(), 24u) << "of 48 cells, frame " << frame << ", level " << level;
      cv::pyrDown(grey, grey);
    }
  }
}

TEST_P(EveryScene, MovesAtWalkingSpeedAndHasLabelsAndPlaces) {
  const auto simulation = MakeSimulation(GetParam(), SmallAndClean());
  EXPECT_FALSE(simulation->places().empty());
  double fastest = 0, fastest_rotation = 0;
  for (int i = 0; i < simulation->frame_count(); ++i) {
    EXPECT_FALSE(simulation->label(i).empty());
    if (i == 0) continue;
    const engine::Rigid3 step =
        simulation->world_from_camera(i - 1).inverse() * simulation->world_from_camera(i);
    const double seconds = ToSeconds(simulation->time(i) - simulation->time(i - 1));
    fastest = std::max(fastest, step.translation.norm() / seconds);
    fastest_rotation = std::max(fastest_rotation, step.rotation.Angle() / seconds);
  }
  EXPECT_LT(fastest, 2.0) << "metres per second";
  EXPECT_LT(fastest_rotation, 2.6) << "radians per second";
}

TEST_P(EveryScene, FillsTheImage) {
  const auto simulation = MakeSimulation(GetParam(), SmallAndClean());
  cv::Mat image;
  for (int part = 0; part < 4; ++part) {
    const int frame = (simulation->frame_count() - 1) * part / 3;
    simulation->Render(frame, &image);
    ASSERT_EQ(image.type(), CV_8UC3);
    ASSERT_EQ(image.size(), cv::Size(320, 240));
    int black = 0;
    for (auto pixel = image.begin<cv::Vec3b>(); pixel != image.end<cv::Vec3b>(); ++pixel) {
      black += *pixel == cv::Vec3b() ? 1 : 0;
    }
    EXPECT_LT(black, 320 * 240 / 100) << "black pixels of frame " << frame;
  }
}

TEST(Simulation, LabelsAMuseumAsBuildTravelAndVisit) {
  const auto simulation = MakeSimulation("museum", SmallAndClean());
  const std::vector<std::string> expected = {"build0", "travel", "build1", "travel", "build2",
                                             "travel", "build3", "travel", "visit2", "travel",
                                             "visit0", "travel", "visit3", "travel", "visit1"};
  EXPECT_EQ(LabelSequence(*simulation), expected);
  EXPECT_EQ(simulation->places().size(), 4u);
}

TEST(Simulation, VisitsEveryPlaceOnceForAnyNumberOfPlaces) {
  for (int places = 1; places <= 5; ++places) {
    const auto simulation = MakeSimulation("desks:" + std::to_string(places), SmallAndClean());
    std::map<std::string, int> count;
    for (const std::string& label : LabelSequence(*simulation)) ++count[label];
    for (int k = 0; k < places; ++k) {
      EXPECT_EQ(count["build" + std::to_string(k)], 1) << places << " places, " << k;
      EXPECT_EQ(count["visit" + std::to_string(k)], 1) << places << " places, " << k;
    }
    EXPECT_EQ(count["travel"], 2 * places - 1);
  }
}

TEST(Simulation, MovesSidewaysAtTheStartOfEveryBuildSegment) {
  for (const char* scene : {"museum", "desks", "room"}) {
    const auto simulation = MakeSimulation(scene, SmallAndClean());
    for (int i = 0; i < simulation->frame_count(); ++i) {
      const bool begins = i == 0 || simulation->label(i) != simulation->label(i - 1);
      if (!begins || simulation->label(i).rfind("visit", 0) == 0 || simulation->label(i) == "travel")
        continue;
      const engine::Rigid3 start = simulation->world_from_camera(i);
      double sideways = 0;
      for (int j = i; j < i + 60; ++j) {
        sideways = std::max(sideways,
                            std::abs((start.inverse() * simulation->world_from_camera(j).translation).x()));
      }
      EXPECT_GT(sideways, 0.28) << scene << ", " << simulation->label(i) << ", metres";
      const auto middle = simulation->SurfaceAt(i, {160, 120});
      ASSERT_TRUE(middle);
      EXPECT_LT((*middle - start.translation).norm(), 3.5)
          << scene << ", " << simulation->label(i) << ", metres";
    }
  }
}

TEST(Simulation, ShowsEveryPlaceWhileItIsBuiltAndVisited) {
  for (const char* scene : {"museum:3", "desks:3"}) {
    const auto simulation = MakeSimulation(scene, SmallAndClean());
    for (const SimulatedPlace& place : simulation->places()) {
      int built = 0, seen = 0;
      for (int i = 0; i < simulation->frame_count(); ++i) {
        if (simulation->label(i) != "build" + place.name && simulation->label(i) != "visit" + place.name)
          continue;
        ++built;
        const auto pixel =
            simulation->camera().Project(simulation->world_from_camera(i).inverse() * place.anchor_in_world);
        if (pixel && simulation->camera().IsInside(*pixel)) ++seen;
      }
      EXPECT_GT(built, 200);
      EXPECT_GT(seen, built * 9 / 10) << scene << ", place " << place.name;
    }
  }
}

TEST(Simulation, RotatesInTheRoomWithoutTranslation) {
  EXPECT_EQ(LabelSequence(*MakeSimulation("room", SmallAndClean())), std::vector<std::string>{"general"});
  const auto simulation = MakeSimulation("room:2", SmallAndClean());
  const std::vector<std::string> expected = {"general", "rotation", "general", "rotation", "general"};
  EXPECT_EQ(LabelSequence(*simulation), expected);
  std::optional<engine::Rigid3> first;
  double max_rotation = 0;
  for (int i = 0; i < simulation->frame_count(); ++i) {
    if (simulation->label(i) != "rotation") {
      first.reset();
      continue;
    }
    const engine::Rigid3 pose = simulation->world_from_camera(i);
    if (!first) first = pose;
    EXPECT_LT((pose.translation - first->translation).norm(), 1e-9) << "frame " << i;
    max_rotation = std::max(max_rotation, (first->rotation.inverse() * pose.rotation).Angle());
  }
  EXPECT_GT(max_rotation, 1.9) << "radians";
}

TEST(Simulation, RotatesInTheCylinderAsInHybridSlam) {
  for (const int radius_cm : {0, 5, 30}) {
    const auto simulation = MakeSimulation("cylinder:" + std::to_string(radius_cm));
    ASSERT_EQ(simulation->frame_count(), 100);
    EXPECT_NEAR(2 * std::atan(320 / simulation->camera().intrinsics().fx) * 180 / std::numbers::pi, 64, 1e-9);
    for (const int frame : {0, 40, 99}) {
      const engine::Rigid3 pose = simulation->world_from_camera(frame);
      // camera_from_world is [R | (0, 0, -r)]: the camera centre is at distance r from the axis, in the
      // viewing direction.
      EXPECT_LT((pose.inverse().translation - Eigen::Vector3d(0, 0, -radius_cm / 100.0)).norm(), 2e-4);
      const auto wall = simulation->SurfaceAt(frame, {319.5, 239.5});
      ASSERT_TRUE(wall);
      EXPECT_NEAR(std::hypot(wall->x(), wall->z()), 0.5, 4e-4);
    }
    EXPECT_NEAR(simulation->world_from_camera(99).rotation.Angle(), std::numbers::pi / 2, 1e-6);
  }
}

TEST(Simulation, IdenticalPlacesHaveTheSameGeometry) {
  for (const bool identical : {true, false}) {
    SimulationOptions options = SmallAndClean();
    options.identical_places = identical;
    const auto simulation = MakeSimulation("desks:3", options);
    // The same view of the first desk and of the second, which is 2.1 m to the right.
    const engine::Rigid3 pose = simulation->world_from_camera(0);
    engine::Rigid3 beside = pose;
    beside.translation.x() +=
        simulation->places()[1].anchor_in_world.x() - simulation->places()[0].anchor_in_world.x();
    int same = 0, compared = 0;
    for (int y = 100; y < 240; y += 10) {
      for (int x = 60; x < 260; x += 10) {
        const auto a = simulation->SurfaceAlong(pose, {x, y}), b = simulation->SurfaceAlong(beside, {x, y});
        if (!a || !b) continue;
        ++compared;
        same += std::abs((*a - pose.translation).norm() - (*b - beside.translation).norm()) < 1e-6 ? 1 : 0;
      }
    }
    ASSERT_GT(compared, 200);
    if (identical) {
      EXPECT_EQ(same, compared);
    } else {
      EXPECT_LT(same, compared * 9 / 10);
    }
  }
}

TEST(Simulation, ARestCoversTheLensAndTheWalkGoesOnAfterIt) {
  SimulationOptions options = SmallAndClean();
  options.frame_rate_hz = 10;
  options.duration_s = 4;
  const auto walk = MakeSimulation("room", options);
  options.rest_at_s = 1;
  options.rest_s = 2;
  const auto rested = MakeSimulation("room", options);
  ASSERT_EQ(rested->frame_count(), 41);
  const auto mean_of = [](const Simulation& simulation, int frame) {
    cv::Mat image;
    simulation.Render(frame, &image);
    return cv::mean(image)[0];
  };
  EXPECT_GT(mean_of(*rested, 9), 30);
  EXPECT_LT(mean_of(*rested, 10), 1);
  EXPECT_LT(mean_of(*rested, 29), 1);
  EXPECT_GT(mean_of(*rested, 30), 30);
  EXPECT_FALSE(rested->SurfaceAt(20, {100, 100}));
  EXPECT_TRUE(rested->SurfaceAt(30, {100, 100}));
  for (const auto& [after, before] : {std::pair(9, 9), {20, 10}, {30, 10}, {40, 20}})
    EXPECT_TRUE(engine::IsNear(rested->world_from_camera(after), walk->world_from_camera(before), 1e-6, 1e-6))
        << after;
}

TEST(Simulation, AnotherWalkLeavesThePlacesAndTheirBuildsAsTheyAre) {
  SimulationOptions options = SmallAndClean();
  options.frame_rate_hz = 2;
  const auto visits_of = [](const Simulation& simulation) {
    std::vector<std::string> visits;
    for (int i = 0; i < simulation.frame_count(); ++i) {
      const std::string& label = simulation.label(i);
      if (label.starts_with("visit") && (visits.empty() || visits.back() != label)) visits.push_back(label);
    }
    return visits;
  };
  const auto usual = MakeSimulation("museum:6", options);
  std::set<std::vector<std::string>> orders = {visits_of(*usual)};
  std::set<int> lengths = {usual->frame_count()};
  for (const char* spec : {"museum:6,walk=1", "museum:6,walk=2", "museum:6,walk=3"}) {
    const auto other = MakeSimulation(spec, options);
    int frame = 0;
    for (; usual->label(frame) != "build5"; ++frame) {
      EXPECT_EQ(usual->label(frame), other->label(frame));
      EXPECT_TRUE(
          engine::IsNear(usual->world_from_camera(frame), other->world_from_camera(frame), 1e-9, 1e-9));
    }
    EXPECT_GT(frame, 60);
    cv::Mat image, same;
    usual->Render(10, &image);
    other->Render(10, &same);
    EXPECT_EQ(cv::norm(image, same, cv::NORM_INF), 0) << "the places are the same";
    EXPECT_EQ(visits_of(*other).size(), 6u);
    orders.insert(visits_of(*other));
    lengths.insert(other->frame_count());
  }
  EXPECT_GE(orders.size(), 3u);
  EXPECT_EQ(lengths.size(), 4u);
}

TEST(Simulation, BuildsForLongerAndVisitsInSeveralRounds) {
  SimulationOptions options = SmallAndClean();
  options.frame_rate_hz = 2;
  const auto usual = MakeSimulation("museum:3", options);
  const auto longer = MakeSimulation("museum:3,build=40,rounds=4", options);
  std::map<std::string, int> frames;
  std::vector<std::string> visits;
  for (int i = 0; i < longer->frame_count(); ++i) {
    const std::string& label = longer->label(i);
    ++frames[label];
    if (label.starts_with("visit") && (visits.empty() || visits.back() != label)) visits.push_back(label);
  }
  for (const char* place : {"build0", "build1", "build2"}) {
    EXPECT_GE(frames[place], 79) << place;
    EXPECT_LE(frames[place], 90) << place << ": the last step may take four seconds";
  }
  // Two rounds may meet at the same place, which is one visit then.
  EXPECT_GE(visits.size(), 9u);
  EXPECT_LE(visits.size(), 12u);
  std::set<std::vector<std::string>> orders;
  for (std::size_t i = 0; i + 3 <= visits.size(); ++i)
    orders.insert({visits.begin() + i, visits.begin() + i + 3});
  EXPECT_GT(orders.size(), 3u) << "a round that is repeated has three sequences of three places";
  for (int i = 0; usual->label(i) == "build0"; ++i) {
    EXPECT_TRUE(engine::IsNear(usual->world_from_camera(i), longer->world_from_camera(i), 2e-2, 2e-2))
        << "all but the end of the first build is the usual one";
    if (i == 8) break;
  }
}

TEST(Simulation, MotionBlurDoesNotShiftTheImage) {
  SimulationOptions options = SmallAndClean();
  options.frame_rate_hz = 10;
  const auto sharp = MakeSimulation("room", options);
  options.blur_samples = 12;
  options.exposure_s = 0.1;
  const auto blurred = MakeSimulation("room", options);
  cv::Mat sharp_image, blurred_image, edges;
  sharp->Render(8, &sharp_image);
  blurred->Render(8, &blurred_image);
  const auto detail = [&](const cv::Mat& image) {
    cv::Laplacian(image, edges, CV_32F);
    return cv::norm(edges, cv::NORM_L1);
  };
  EXPECT_LT(detail(blurred_image), 0.8 * detail(sharp_image));
  // After equal smoothing the two must agree, so that nothing was shifted.
  cv::GaussianBlur(sharp_image, sharp_image, {0, 0}, 4);
  cv::GaussianBlur(blurred_image, blurred_image, {0, 0}, 4);
  EXPECT_LT(cv::norm(sharp_image, blurred_image, cv::NORM_L1) / static_cast<double>(3 * sharp_image.total()),
            1.5);
}

TEST(Simulation, CountsFramesFromTheRateAndTheDuration) {
  SimulationOptions options = SmallAndClean();
  options.frame_rate_hz = 20;
  options.duration_s = 2.5;
  const auto simulation = MakeSimulation("room", options);
  EXPECT_EQ(simulation->frame_count(), 51);
  EXPECT_EQ(simulation->time(0), Timestamp{0});
  EXPECT_EQ(simulation->time(50), FromSeconds(2.5));
}

TEST(Simulation, ListsTheScenesForAnUnknownName) {
  const std::string message = ErrorOfScene("attic");
  EXPECT_THAT(message, HasSubstr("attic"));
  for (const char* scene : {"room", "museum", "desks", "cylinder", "loop", "grass", "head"})
    EXPECT_THAT(message, HasSubstr(scene));
  EXPECT_THAT(ErrorOfScene(""), HasSubstr("museum"));
}

TEST(Simulation, ReportsTheValidNumbersOfAScene) {
  for (const char* scene :
       {"museum:0", "museum:99", "museum:", "museum:two", "museum:2x", "museum:-1", "museum:99999999999"}) {
    EXPECT_THAT(ErrorOfScene(scene), HasSubstr("from 1 to 24")) << scene;
  }
  EXPECT_NE(ErrorOfScene("grass:1"), "");
}

TEST(Simulation, AllowsAnyFrameRateWithoutMotionBlur) {
  EXPECT_EQ(ErrorOfScene("grass,fps=120"), "");
  EXPECT_THAT(ErrorOfScene("grass,fps=120,blur=2"), HasSubstr("exposure"));
  EXPECT_EQ(ErrorOfScene("grass,fps=120,blur=2,exposure=8"), "");
}

TEST(Simulation, ReportsInvalidOptions) {
  const auto fault = [](auto change) {
    SimulationOptions options;
    change(options);
    return ErrorOfScene("grass", options);
  };
  EXPECT_THAT(fault([](auto& options) { options.frame_rate_hz = 0; }), HasSubstr("frame rate"));
  EXPECT_THAT(fault([](auto& options) { options.frame_rate_hz = std::nan(""); }), HasSubstr("frame rate"));
  EXPECT_THAT(fault([](auto& options) { options.duration_s = -1; }), HasSubstr("duration"));
  EXPECT_THAT(fault([](auto& options) { options.exposure_s = -1; }), HasSubstr("exposure"));
  EXPECT_THAT(fault([](auto& options) { options.exposure_s = 1, options.blur_samples = 2; }),
              HasSubstr("exposure"));
  EXPECT_THAT(fault([](auto& options) { options.blur_samples = 0; }), HasSubstr("blur"));
  EXPECT_THAT(fault([](auto& options) { options.noise_sigma = -1; }), HasSubstr("noise"));
  EXPECT_THAT(fault([](auto& options) { options.exposure_drift = 2; }), HasSubstr("drift"));
  EXPECT_THAT(fault([](auto& options) { options.vignetting = 1; }), HasSubstr("vignetting"));
  EXPECT_THAT(fault([](auto& options) { options.camera = SimulatedCamera(9000); }), HasSubstr("8192"));
}

TEST(Simulation, DrawsAnotherImageWhereTheCameraMovesAndReportsTheTime) {
  const auto simulation = MakeSimulation("museum:2");
  constexpr int kImages = 10;
  std::vector<cv::Mat> images(kImages);
  simulation->Render(0, &images[0]);
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < kImages; ++i) simulation->Render(i * 20, &images[static_cast<std::size_t>(i)]);
  const std::chrono::duration<double, std::milli> taken = std::chrono::steady_clock::now() - start;
  RecordProperty("milliseconds_per_image", std::to_string(taken.count() / kImages));
  for (std::size_t i = 0; i < images.size(); ++i) {
    ASSERT_EQ(images[i].size(), cv::Size(640, 480));
    if (i > 0) {
      EXPECT_GT(cv::norm(images[i], images[i - 1], cv::NORM_L1), 640 * 480) << "image " << i;
    }
  }
}

}  // namespace
}  // namespace docent::app
