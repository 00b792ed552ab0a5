// SPDX-License-Identifier: Apache-2.0
// What a person sees belongs together: the video of a drawn image is that of its frame, and the content is
// drawn from the pose of this very frame, also when frames are dropped or late.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <thread>
#include <vector>

#include "app/command_line/run_guide.h"
#include "app/session/library_scene.h"
#include "content/asset.h"
#include "tests/app/support/simulated_map.h"
#include "tests/app/support/simulated_session.h"
#include "tests/app/support/temporary_folder.h"
#include "tests/support/must_run.h"
#include "tests/support/virtual_screen.h"

namespace docent::app {
namespace {

constexpr double kSide_m = 0.16;

// A map without error of the simulated table, with a green square over it, which is drawn by a tour.
class PoseOfImage : public ::testing::Test {
 protected:
  PoseOfImage() {
    const SimulationOptions options = Options();
    const auto simulation = MakeSimulation("room", options);
    const auto map = SimulatedMap(*simulation, EvenlySpacedFrames(*simulation, 16));
    const Eigen::Vector3d table = simulation->places()[0].anchor_in_world;
    square_ = table + Eigen::Vector3d(0, -0.35, 0);
    cv::imwrite((folder_ / "green.png").string(), cv::Mat(64, 64, CV_8UC3, cv::Scalar(0, 255, 0)));
    content::Entity entity;
    entity.name = "square";
    entity.kind = content::Entity::Kind::kImage;
    entity.model.asset = std::make_shared<content::Asset>(content::ImportImage(folder_ / "green.png"));
    entity.model.animation = -1;
    const Eigen::Vector3d to_viewer = simulation->world_from_camera(0).translation - square_;
    entity.model.map_from_model.rotation =
        engine::Rotation3(Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), to_viewer));
    entity.model.map_from_model.translation = square_;
    entity.model.map_from_model.scale = kSide_m;
    content::Scene scene;
    scene.entities = {entity};
    library_.Save({library_.NewKey(), "Table", maps::Policy::kReadOnly, map,
                   std::make_shared<maps::SceneRecord>(RecordFromScene(scene))});
  }

  // Motions of several pixels from frame to frame, so that the pose of another frame would be seen.
  static SimulationOptions Options() {
    SimulationOptions options;
    options.duration_s = 12;
    options.frame_rate_hz = 15;
    return options;
  }

  struct Drawn {
    int frame;  // Of the simulation, by its time.
    bool has_pose;
    cv::Mat image;
  };
  std::vector<Drawn> Tour(const SimulationOptions& options, Pace pace, bool headless,
                          std::chrono::milliseconds drawing_time = {}) {
    simulation_ = MakeSimulation("room", options);
    std::vector<CalibratedCamera> cameras;
    cameras.push_back(simulated_session::CameraOf(simulation_));
    GuideRequest request;
    request.library = &library_;
    request.pace = pace;
    request.headless = headless;
    request.occlusion = Occlusion::kOff;
    request.room_light = false;
    std::vector<Drawn> drawn;
    request.on_image = [&](const ShownFrame& frame, const cv::Mat& image) {
      int index = 0;
      while (index + 1 < simulation_->frame_count() && simulation_->time(index) < frame.tracked.frame.time)
        ++index;
      drawn.push_back({index, engine::HasPose(frame.tracked.state), image.clone()});
      std::this_thread::sleep_for(drawing_time);
    };
    RunGuide(request, cameras, Verbosity::kQuiet);
    return drawn;
  }

  // Where the middle of the square is in a frame; empty if it is not inside.
  std::optional<Eigen::Vector2d> TruePixel(int frame) const {
    if (frame < 0 || frame >= simulation_->frame_count()) return std::nullopt;
    const auto pixel =
        simulation_->camera().Project(simulation_->world_from_camera(frame).inverse() * square_);
    return pixel && simulation_->camera().IsInside(*pixel) ? pixel : std::nullopt;
  }

  // The median difference of the image from the simulator's own rendering of a frame, where there is no
  // content.
  double DifferenceFrom(int frame, const cv::Mat& image, const cv::Mat& content) const {
    cv::Mat rendered, difference, largest;
    simulation_->Render(frame, &rendered);
    cv::absdiff(rendered, image, difference);
    std::vector<int> counts(256, 0);
    int all = 0;
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < image.cols; ++x) {
        if (content.at<std::uint8_t>(y, x) != 0) continue;
        ++counts[static_cast<std::size_t>(difference.at<cv::Vec3b>(y, x)[1])];
        ++all;
      }
    }
    int level = 0;
    for (int below = counts[0]; below <= all / 2; below += counts[static_cast<std::size_t>(level)]) ++level;
    return level;
  }

  void ExpectThatTheyBelongTogether(const std::vector<Drawn>& drawn, int least) const {
    int with_content = 0, told_apart = 0;
    for (const Drawn& one : drawn) {
      cv::Mat content;
      cv::inRange(one.image, cv::Scalar(0, 230, 0), cv::Scalar(40, 255, 40), content);
      const cv::Moments moments = cv::moments(content, true);
      cv::dilate(content, content, cv::Mat::ones(5, 5, CV_8UC1));
      EXPECT_EQ(DifferenceFrom(one.frame, one.image, content), 0)
          << "the video is not that of frame " << one.frame;
      const auto expected = TruePixel(one.frame);
      if (!one.has_pose || !expected || moments.m00 < 200) continue;
      const Eigen::Vector2d seen(moments.m10 / moments.m00, moments.m01 / moments.m00);
      ++with_content;
      for (const int step : {-2, -1, 1, 2}) {
        const auto other = TruePixel(one.frame + step);
        // The error of tracking is below half a pixel, and the perspective moves the centroid as little.
        if (!other || (*other - *expected).norm() < 3) continue;
        ++told_apart;
        EXPECT_LT((seen - *expected).norm(), (seen - *other).norm())
            << "frame " << one.frame << " is drawn from the pose of frame " << one.frame + step;
      }
    }
    EXPECT_GE(with_content, least);
    EXPECT_GE(told_apart, least);
  }

  const TemporaryFolder folder_;
  maps::Library library_ =
      maps::Library::Open(folder_ / "a.docent", maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
  Eigen::Vector3d square_ = Eigen::Vector3d::Zero();
  std::shared_ptr<const Simulation> simulation_;
};

TEST_F(PoseOfImage, IsThatOfTheDrawnFrame) {
  ExpectThatTheyBelongTogether(Tour(Options(), Pace::kEager, true), 60);
}

TEST_F(PoseOfImage, IsThatOfTheDrawnFrameWhenTheCameraDropsFrames) {
  SimulationOptions options = Options();
  options.faults.dropped_share = 0.3;
  ExpectThatTheyBelongTogether(Tour(options, Pace::kEager, true), 30);
}

TEST_F(PoseOfImage, IsThatOfTheDrawnFrameWhenFramesAreLate) {
  // Each drawing takes longer than the time between two images, so that the tracker drops images. On a busy
  // machine only few are drawn while the recording lasts.
  const std::vector<Drawn> drawn = Tour(Options(), Pace::kRealtime, true, std::chrono::milliseconds(90));
  EXPECT_LT(static_cast<int>(drawn.size()), simulation_->frame_count() * 3 / 4) << "some must be dropped";
  ExpectThatTheyBelongTogether(drawn, 4);
}

TEST_F(PoseOfImage, IsThatOfTheDrawnFrameInASlowWindow) {
  if (std::system("command -v Xvfb > /dev/null 2>&1") != 0) SKIP_OR_FAIL("Xvfb is not installed");
  const VirtualScreen screen("800x600");
  ASSERT_TRUE(screen.works());
  // The window draws on a thread of its own and skips the frames for which it has no time. On a busy machine
  // only few are drawn while the recording lasts.
  const std::vector<Drawn> drawn = Tour(Options(), Pace::kRealtime, false, std::chrono::milliseconds(150));
  EXPECT_LT(static_cast<int>(drawn.size()), simulation_->frame_count() * 3 / 4) << "some must be skipped";
  ExpectThatTheyBelongTogether(drawn, 3);
}

}  // namespace
}  // namespace docent::app
