// SPDX-License-Identifier: Apache-2.0
#include "app/output/engine_text.h"

#include <gtest/gtest.h>

#include <memory>
#include <numbers>
#include <set>
#include <string>

namespace docent::app {
namespace {

using engine::JoinRefusal;
using engine::MapOverlap;
using engine::MapperEvent;

// "event: detail" of an action in the map "Hall".
template <typename What>
std::string InHall(const What& what) {
  const std::optional<EventText> text = TextOf(MapperEvent{{}, what}, "Hall");
  return text ? text->event + ": " + text->detail : "none";
}

TEST(HintText, IsASentenceForEachHintButNone) {
  using engine::Hint;
  EXPECT_EQ(TextOf(Hint::kNone), "");
  EXPECT_EQ(TextOf(Hint::kMoveSideways), "Move sideways.");
  EXPECT_EQ(TextOf(Hint::kStartWhereThereIsDetail),
            "Too little detail here: point the camera at the exhibit.");
  EXPECT_EQ(TextOf(Hint::kLeftMap), "You have left the known area: look back.");
  std::set<std::string> texts;
  constexpr int kHints = static_cast<int>(Hint::kFollowOtherCamera) + 1;
  for (int i = 0; i < kHints; ++i) texts.insert(TextOf(static_cast<Hint>(i)));
  EXPECT_EQ(texts.size(), static_cast<std::size_t>(kHints)) << "two hints have the same text";
}

TEST(RigText, SaysWhetherTheRigIsRigidAndItsFigures) {
  engine::RigEstimate rig;
  rig.rigid = true;
  rig.second_from_first.translation = {0.25, 0, 0};
  rig.second_from_first.rotation = engine::Rotation3::Exp({0, std::numbers::pi / 6, 0});
  rig.position_sigma = 0.001;
  rig.rotation_sigma_deg = 0.05;
  EXPECT_EQ(TextOf(rig), "rigid, baseline 0.25 (sigma 0.001), rotation 30 degrees (sigma 0.05)");
  rig.rigid = false;
  EXPECT_EQ(TextOf(rig), "not rigid, baseline 0.25 (sigma 0.001), rotation 30 degrees (sigma 0.05)");
}

TEST(MapperEventText, SaysWhatWasDoneAndWhere) {
  EXPECT_EQ(InHall(MapperEvent::MapStarted{120}), "map: started Hall: 120 points");
  EXPECT_EQ(InHall(MapperEvent::StartFailed{31}),
            "warning: could not initialize Hall: only 31 points are consistent");
  EXPECT_EQ(InHall(MapperEvent::KeyFrameAdded{40, 900}),
            "keyframe: sixdof in Hall: 40 new points, 900 in total");
  EXPECT_EQ(InHall(MapperEvent::PanoramaOpened{300}), "panorama: opened in Hall: 300 infinite points");
  EXPECT_EQ(InHall(MapperEvent::PanoramaKeyFrameAdded{25}),
            "keyframe: panorama in Hall: 25 new infinite points");
  EXPECT_EQ(InHall(MapperEvent::KeyFrameLocalized{7, false}), "keyframe: localized in Hall: keyframe 7");
  EXPECT_EQ(InHall(MapperEvent::KeyFrameLocalized{7, true}),
            "keyframe: localized in Hall: keyframe 7, by its descriptors");
  EXPECT_EQ(InHall(MapperEvent::InfinitePointsTriangulated{12, 3}),
            "points: Hall: 12 infinite points triangulated, 3 fused");
  EXPECT_EQ(InHall(MapperEvent::KeyFrameRemoved{9}), "keyframe: removed from Hall as redundant: keyframe 9");
  EXPECT_EQ(InHall(MapperEvent::LensesEstimated{}), "none");
}

TEST(MapperEventText, GivesTheFiguresOfAnAdjustmentAndOfALoop) {
  engine::BundleSummary summary;
  summary.outcome = engine::BundleSummary::Outcome::kConverged;
  summary.iterations = 5;
  summary.initial_cost = 120.5;
  summary.final_cost = 80;
  summary.sigma = 0.5;
  summary.outliers = 3;
  EXPECT_EQ(InHall(MapperEvent::GloballyAdjusted{summary}),
            "adjustment: Hall: converged after 5 iterations, cost 120.5 -> 80, sigma 0.500, 3 outliers");
  engine::ClosedLoop loop;
  loop.keyframe = 40;
  loop.place = 2;
  loop.drift = 0.012;
  loop.rotation = std::numbers::pi / 90;
  loop.scale = 0.97;
  loop.found = 70;
  loop.expected = 200;
  loop.duplicates = 33;
  loop.reverse_inliers = 51;
  loop.fused = 99;
  EXPECT_EQ(InHall(MapperEvent::LoopClosed{loop}),
            "loop: closed in Hall: drift of 1.2 % of the path, 2.00 degrees, -3.0 % in scale; keyframe 40 "
            "matches keyframe 2: 70 of 200 map points found, 33 pairs of duplicate points, 51 inliers in the "
            "reverse check; 99 pairs fused in total");
}

TEST(MapperEventText, WarnsAboutACalibrationInWholeSentences) {
  EXPECT_EQ(InHall(MapperEvent::CalibrationContradicted{{620, 402.4}}),
            "warning: The calibration is probably wrong: its focal length is 620 px, but the map indicates "
            "about 400 px. Calibrate the camera with `docent calibrate`.");
}

TEST(JoinRefusalText, TellsAuthorsNoFigures) {
  using Outcome = engine::MapOverlap::Outcome;
  engine::MapOverlap overlap;
  for (const Outcome outcome :
       {Outcome::kNothingToCompare, Outcome::kNothingRecognized, Outcome::kTooFewConsecutive,
        Outcome::kTooFewConfirmed, Outcome::kTooFewPoints, Outcome::kSurfacesDiffer, Outcome::kAmbiguous,
        Outcome::kInterrupted}) {
    overlap.outcome = outcome;
    const std::string text = TextForAuthors(JoinRefusal::kNoOverlap, overlap);
    EXPECT_NE(text, "");
    EXPECT_EQ(text.find_first_of("0123456789%"), std::string::npos) << text;
    EXPECT_EQ(text.find("keyframe"), std::string::npos) << text;
  }
  EXPECT_EQ(TextForAuthors(JoinRefusal::kTooManyIds, {}), "together they are too large for one map");
  EXPECT_EQ(TextForAuthors(JoinRefusal::kNone, {}), "");
}

TEST(JoinRefusalText, SaysWhyTwoMapsWereNotJoined) {
  EXPECT_EQ(TextOf(JoinRefusal::kNone, {}), "");
  EXPECT_EQ(TextOf(JoinRefusal::kTooMuchDrift, {}), "one of the maps has drifted too far to fit the other");
  MapOverlap overlap;
  overlap.outcome = MapOverlap::Outcome::kTooFewConsecutive;
  overlap.consecutive = 2;
  EXPECT_EQ(TextOf(JoinRefusal::kNoOverlap, overlap),
            "only 2 consecutive keyframes are recognized at the same place");
  overlap.outcome = MapOverlap::Outcome::kTooFewConfirmed;
  overlap.with_view = 8;
  overlap.confirmed = 4;
  EXPECT_EQ(TextOf(JoinRefusal::kNoOverlap, overlap),
            "they look alike, but only 4 of 8 keyframes that should show the other map match it");
  overlap.outcome = MapOverlap::Outcome::kTooFewPoints;
  overlap.confirmed = 8;
  overlap.found_ratio = 0.17;
  EXPECT_EQ(TextOf(JoinRefusal::kNoOverlap, overlap),
            "they look alike, but keyframes that should show the other map find only 17 % of its points");
  overlap.outcome = MapOverlap::Outcome::kSurfacesDiffer;
  overlap.contradicted = 12;
  overlap.regions = 60;
  EXPECT_EQ(TextOf(JoinRefusal::kNoOverlap, overlap),
            "they look alike, but their surfaces differ in 12 of 60 image regions");
}

TEST(FocalLengthText, GivesPixelsAndPercent) {
  engine::EstimatedLens lens;
  lens.model = std::make_shared<const engine::CameraModel>(
      engine::LensModel::kRadialTangential,
      engine::CameraModel::Intrinsics{640, 480, 512.04, 512.04, 320, 240}, std::array<double, 5>{});
  lens.focal_sigma = 0.012;
  EXPECT_EQ(FormatFocalLength(lens), "512.0 px (+-1.2 %)");
}

}  // namespace
}  // namespace docent::app
