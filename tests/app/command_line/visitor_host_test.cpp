// SPDX-License-Identifier: Apache-2.0
// How a tour notices that its visitor has left, and what becomes of the records of visits.
#include "app/command_line/visitor_host.h"

#include <gmock/gmock.h>
#include <stdlib.h>

#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "tests/app/support/simulated_session.h"
#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

using namespace simulated_session;
using ::testing::Contains;
using ::testing::DoubleEq;
using ::testing::ElementsAre;
using ::testing::Field;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

// A kiosk whose camera is fixed and always sees the first stop, so that only its screen tells that somebody
// is there. It has an image a second.
class KioskOnAStand : public ::testing::Test {
 protected:
  KioskOnAStand() {
    request_.kiosk_code = "1234";
    request_.language = "en";
    request_.visit_log = folder_.path();
    request_.tour = "Highlights";
    request_.route.emplace();
    request_.route->stops = {{1, "Desk"}, {2, "Door"}, {3, "Window"}};
    host_.emplace(request_, &session_, 2, [](const Event&) {});
  }
  void Stand(int duration_s) {
    for (int i = 0; i < duration_s; ++i, ++now_s_) {
      frame_ = std::make_shared<ShownFrame>();
      frame_->seconds = now_s_;
      frame_->tracked.frame.time = FromSeconds(now_s_);
      frame_->tracked.frame.image = cv::Mat(48, 64, CV_8UC1, cv::Scalar(120));
      frame_->tracked.state = engine::TrackingState::kSixDof;
      frame_->tracked.map_key = 1;
      frame_->shown.map_name = "Desk";
      host_->Guide(0, simulation_->camera(), frame_);
    }
  }
  void Touch(GuideVisitor::Step step) { host_->Lead(GuideVisitor{step, {}}, frame_->tracked); }
  std::vector<VisitRecord> Visits() {
    host_->Finish();
    std::vector<std::string> problems;
    std::vector<VisitRecord> visits = ReadVisits(folder_.path(), &problems);
    EXPECT_THAT(problems, IsEmpty());
    return visits;
  }

  const TemporaryFolder folder_;
  const std::shared_ptr<const Simulation> simulation_ = Room(3);
  Session session_{Options(Pace::kLockstep, "Desk"), LensOf(*simulation_), nullptr};
  GuideRequest request_;
  std::optional<VisitorHost> host_;
  std::shared_ptr<ShownFrame> frame_;
  int now_s_ = 0;
};

TEST_F(KioskOnAStand, RecordsTheVisitOfWhoOnlyTouchesIt) {
  Stand(200);
  Touch(GuideVisitor::Step::kSkip);
  Stand(100);
  Touch(GuideVisitor::Step::kBack);
  Stand(200);
  // The first one is counted from the start until nobody was there for two minutes.
  EXPECT_THAT(Visits(), UnorderedElementsAre(Field(&VisitRecord::duration_s, DoubleEq(119)),
                                             Field(&VisitRecord::duration_s, DoubleEq(219))));
}

TEST_F(KioskOnAStand, IsUsedByWhoTouchesTheSecondCamerasImageOrNothingThatLeads) {
  for (int i = 0; i < 3; ++i) {
    Stand(100);
    engine::TrackedFrame second;
    second.frame.camera = 1;
    host_->Lead(GuideVisitor{i % 2 == 0 ? GuideVisitor::Step::kSkip : GuideVisitor::Step::kBack, {}}, second);
    Stand(100);
    host_->Use();  // Such as by turning the model of a card.
  }
  Stand(1);
  EXPECT_EQ(frame_->visitors_before, 0);
}

TEST_F(KioskOnAStand, DoesNotBeginAnewWhileItIsTouched) {
  for (int i = 0; i < 5; ++i) {
    Stand(100);
    Touch(i % 2 == 0 ? GuideVisitor::Step::kSkip : GuideVisitor::Step::kBack);
  }
  Stand(1);
  EXPECT_EQ(frame_->visitors_before, 0);
  Stand(200);
  EXPECT_EQ(frame_->visitors_before, 1);
}

TEST(VisitorHost, WelcomesALaterVisitorWithoutTheLibrary) {
  const TemporaryFolder folder;
  maps::Library library =
      OpenLibrary(folder / "l.docent", maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
  for (const char* name : {"Hall", "Yard"})
    library.Save({library.NewKey(), name, maps::Policy::kOpen, nullptr, nullptr});
  const auto simulation = Room(3);
  SessionOptions options = Options(Pace::kLockstep, "");
  options.may_write = false;
  Session session(options, LensOf(*simulation), &library);
  GuideRequest request;
  request.language = "en";
  request.library = &library;
  VisitorHost host(request, &session, 1, [](const Event&) {});
  for (const std::uint64_t key : {1, 2}) library.Remove(key);
  engine::TrackedFrame first;
  host.Lead(GuideVisitor{GuideVisitor::Step::kRestart, {}}, first);
  std::shared_ptr<ShownFrame> frame;
  for (int i = 0; i < 100; ++i) {
    frame = std::make_shared<ShownFrame>();
    frame->seconds = i;
    frame->tracked.state = engine::TrackingState::kLost;
    host.Guide(0, simulation->camera(), frame);
  }
  EXPECT_THAT(frame->visitor->stops, ElementsAre("Hall", "Yard")) << "the maps of the session";
}

// A tour that is narrated, on a machine that has no program to speak with.
class NarratedTour : public ::testing::Test {
 protected:
  void SetUp() override {
    path_ = std::getenv("PATH") != nullptr ? std::getenv("PATH") : "";
    setenv("PATH", folder_.path().c_str(), 1);
  }
  void TearDown() override { setenv("PATH", path_.c_str(), 1); }

  const TemporaryFolder folder_;
  std::string path_;
};

TEST_F(NarratedTour, ReadsASignThatStaysInViewAlthoughImagesAreSkipped) {
  const auto simulation = Room(3);
  Session session(Options(Pace::kLockstep, "Desk"), LensOf(*simulation), nullptr);
  GuideRequest request;
  request.language = "en";
  request.narrate = true;
  std::vector<std::string> narrated;
  VisitorHost host(request, &session, 1, [&](const Event& event) {
    if (event.event == "narration") narrated.push_back(event.detail);
  });
  auto scene = std::make_shared<content::Scene>();
  content::Entity& label = scene->entities.emplace_back();
  label.name = "lions";
  label.kind = content::Entity::Kind::kLabel;
  label.label.text = "Ivory, about 1900";
  label.label.anchor = Eigen::Vector3d(0, 0, 1);
  label.label.text_height = 0.02;
  for (int i = 0; i < 40; ++i) {
    const auto frame = std::make_shared<ShownFrame>();
    frame->seconds = 0.1 * i;
    frame->tracked.state = i % 2 == 0 ? engine::TrackingState::kSixDof : engine::TrackingState::kDropped;
    if (engine::HasPose(frame->tracked.state)) {
      frame->tracked.map_key = 1;
      frame->shown.map_name = "Desk";
      frame->shown.scene = scene;
    }
    host.Guide(0, simulation->camera(), frame);
  }
  EXPECT_THAT(narrated, Contains("Ivory, about 1900"));
}

}  // namespace
}  // namespace docent::app
