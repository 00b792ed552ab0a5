// SPDX-License-Identifier: Apache-2.0
// The parts that find the pose of a camera in known maps: retrieval, verification, hypotheses,
// relocalization.
#include "engine/tracking/pose_search.h"

#include <gtest/gtest.h>

#include "engine/tracking/better_map_search.h"
#include "engine/tracking/relocalizer.h"
#include "tests/engine/some_maps.h"
#include "tests/engine/tracking/tracked_image.h"

namespace docent::engine {
namespace {

using testing_world::Camera;
using testing_world::CameraAt;
using testing_world::ImageAt;
using testing_world::RenderedWorld;
using testing_world::SomeMaps;
using testing_world::World;

const RenderedWorld& OtherRoom() {
  static const RenderedWorld room = RenderedWorld::Room(7177);
  return room;
}

std::shared_ptr<const MapSnapshot> MapOf(const RenderedWorld& world) {
  return testing_world::TrueMap(world, Camera(),
                                {CameraAt({0, 0, 0}), CameraAt({0.1, 0, 0}), CameraAt({0.2, 0, 0})})
      .Snapshot();
}
const std::shared_ptr<const MapSnapshot>& TheMap() {
  static const auto map = MapOf(World());
  return map;
}
const std::shared_ptr<const MapSnapshot>& MapOfOtherRoom() {
  static const auto map = MapOf(OtherRoom());
  return map;
}

Rigid3 Here() {
  return CameraAt({0.12, 0.01, 0.02});
}

constexpr std::uint64_t kKey = 1, kOtherKey = 2;

// A camera in the room of map kKey; map kOtherKey shows another room.
class TwoRooms : public ::testing::Test {
 protected:
  TwoRooms() {
    maps_.Add(kKey, TheMap());
    maps_.Add(kOtherKey, MapOfOtherRoom());
  }
  // own: the map that the camera was in; 0 for none.
  PoseSearch Search(const CameraImage& image, std::uint64_t own) {
    return {.image = image,
            .finder = &maps_,
            .map = own != 0 ? maps_.At(own) : nullptr,
            .map_key = own,
            .policy = policy_,
            .criteria = criteria_,
            .pose = &pose_,
            .retrieval = &retrieval_,
            .verification = &verification_,
            .hypothesis = &hypothesis_,
            .random = &random_};
  }
  static bool IsHere(const Rigid3& camera_from_map) {
    return (camera_from_map.OriginInSource() - Here().OriginInSource()).norm() < 0.02;
  }

  TrackerOptions options_;
  SomeMaps maps_;
  KeyFramePolicy policy_{KeyFramePolicyOptions(), 1.3};
  PoseCriteria criteria_{options_};
  PoseTracker pose_{options_, Camera()};
  PlaceRetrieval retrieval_{options_};
  PlaceVerification verification_{options_, Camera()};
  MapHypothesis hypothesis_;
  Random random_{1};
  Relocalizer relocalizer_{options_};
  TrackedFrame out_;
};

TEST_F(TwoRooms, AreRetrievedByThumbnailBestAlignmentFirst) {
  const CameraImage image = ImageAt(Here());
  const auto places = retrieval_.ByThumbnail(image, maps_);
  ASSERT_GE(places.size(), 2u);
  EXPECT_EQ(places.front().candidate.map_key, kKey);
  for (std::size_t i = 1; i < places.size(); ++i)
    EXPECT_LE(places[i - 1].alignment_error, places[i].alignment_error);
  for (const AlignedPlace& place : retrieval_.ByThumbnail(image, maps_, kOtherKey))
    EXPECT_EQ(place.candidate.map_key, kKey);
  EXPECT_TRUE(retrieval_.ByThumbnail(image, maps_, kKey).empty()) << "the most similar keyframe is excluded";
}

TEST_F(TwoRooms, AreRetrievedByWordsWithoutTheKeyFramesTriedBefore) {
  const CameraImage image = ImageAt(Here());
  const auto all = retrieval_.ByWords(image, maps_, {});
  ASSERT_FALSE(all.empty());
  for (const AlignedPlace& place : retrieval_.ByWords(image, maps_, {all.front()}))
    EXPECT_FALSE(place.candidate.map_key == all.front().candidate.map_key &&
                 place.candidate.keyframe == all.front().candidate.keyframe);
}

TEST_F(TwoRooms, AreVerifiedWhereTheImageWasTakenOnly) {
  const CameraImage image = ImageAt(Here());
  RelocalizationResult rejection;
  const PoseSearch search = Search(image, 0);
  const auto found = verification_.Verify(search.Query(&rejection), retrieval_.ByThumbnail(image, maps_));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found.front().place.candidate.map_key, kKey);
  EXPECT_TRUE(IsHere(found.front().result.camera_from_map));
}

TEST_F(TwoRooms, GiveTheReasonWhenNoPlaceIsVerified) {
  const CameraImage image = ImageAt(Here(), 0, RenderedWorld::Room(99));
  RelocalizationResult rejection;
  const PoseSearch search = Search(image, 0);
  EXPECT_TRUE(verification_.Verify(search.Query(&rejection), retrieval_.ByThumbnail(image, maps_)).empty());
  EXPECT_EQ(rejection.rejection, RejectionReason::kFewPoints);
}

TEST_F(TwoRooms, HaveACompetitorWhenTwoMapsShowTheSameRoom) {
  maps_.Add(kOtherKey, TheMap());
  const CameraImage image = ImageAt(Here());
  RelocalizationResult rejection;
  const PoseSearch search = Search(image, 0);
  const auto found = verification_.Verify(search.Query(&rejection), retrieval_.ByThumbnail(image, maps_));
  ASSERT_EQ(found.size(), 2u);
  EXPECT_GE(found[0].result.Quality(), found[1].result.Quality());
  EXPECT_NE(found[0].place.candidate.map_key, found[1].place.candidate.map_key);
}

TEST_F(TwoRooms, AreFoundAtOnceNearTheLastPose) {
  pose_.Begin(Timestamp{}, Here(), ObservedMotion::kSixDof);
  relocalizer_.Lose(Timestamp{});
  const auto found = relocalizer_.Search(Search(ImageAt(Here(), 1), kKey), &out_);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->how, FoundPose::How::kNearby);
  EXPECT_TRUE(IsHere(found->result.camera_from_map));
}

TEST_F(TwoRooms, AreReturnedToAtOnceByPlaceRecognition) {
  relocalizer_.LoseLongAgo();
  const auto found = relocalizer_.Search(Search(ImageAt(Here()), kKey), &out_);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->how, FoundPose::How::kReturned);
  EXPECT_EQ(found->map_key, kKey);
  EXPECT_TRUE(IsHere(found->result.camera_from_map));
}

// Another map shows the same room, as a place that looks alike would.
TEST_F(TwoRooms, AreNotSearchedWhereTheMapConfirmsOdometry) {
  options_.min_relocalization_cells = 17;  // more than there are: the points of every pose are clustered
  criteria_ = PoseCriteria(options_);
  SomeMaps others;
  others.Add(kOtherKey, TheMap());
  for (const bool has_odometry : {false, true}) {
    pose_.Begin(Timestamp{}, Here(), ObservedMotion::kSixDof);
    relocalizer_.Lose(Timestamp{});
    hypothesis_.Clear();
    out_ = {};
    const CameraImage image = ImageAt(Here(), 1);
    PoseSearch search = Search(image, kKey);
    search.finder = &others;
    search.has_odometry = has_odometry;
    EXPECT_FALSE(relocalizer_.Search(search, &out_));
    EXPECT_EQ(hypothesis_.exists(), !has_odometry);
    EXPECT_EQ(out_.relocalization.rejection,
              has_odometry ? RejectionReason::kClustered : RejectionReason::kUnconfirmed);
  }
}

TEST_F(TwoRooms, AreEnteredAfterSeveralFramesAgree) {
  relocalizer_.LoseLongAgo();
  std::optional<FoundPose> found;
  int frames = 0;
  while (!found && frames < 10) {
    found = relocalizer_.Search(Search(ImageAt(Here(), frames), kOtherKey), &out_);
    ++frames;
    EXPECT_EQ(hypothesis_.frames(), found ? 0 : frames);
    if (!found) {
      EXPECT_EQ(out_.relocalization.rejection, RejectionReason::kUnconfirmed);
    }
  }
  ASSERT_TRUE(found);
  EXPECT_EQ(frames, options_.confirming_frames);
  EXPECT_EQ(found->how, FoundPose::How::kEntered);
  EXPECT_EQ(found->map_key, kKey);
  EXPECT_EQ(found->map, TheMap());
}

TEST_F(TwoRooms, ForgetAHypothesisThatAFrameContradicts) {
  relocalizer_.LoseLongAgo();
  EXPECT_FALSE(relocalizer_.Search(Search(ImageAt(Here(), 0), kOtherKey), &out_));
  ASSERT_TRUE(hypothesis_.exists());
  EXPECT_FALSE(relocalizer_.Search(Search(ImageAt(Here(), 1, RenderedWorld::Room(99)), kOtherKey), &out_));
  EXPECT_FALSE(hypothesis_.exists());
}

TEST_F(TwoRooms, ConfirmAPlaceThatIsRecognizedAgainAwayFromItsPrediction) {
  relocalizer_.LoseLongAgo();
  const auto search = [&](int frame) {
    return relocalizer_.Search(Search(ImageAt(Here(), frame), kOtherKey), &out_);
  };
  // Too far for a pose to be found from there.
  const auto away = [](double metres) {
    return Rigid3(Rotation3::Exp({0.1, 0.2, 0.1}), {metres, 0, 0}) * Here();
  };
  hypothesis_.Begin(kKey, away(0.5), kNoId);
  EXPECT_FALSE(search(0));
  EXPECT_EQ(hypothesis_.frames(), 2);
  EXPECT_EQ(out_.relocalization.frames, 2);
  EXPECT_TRUE(IsHere(hypothesis_.camera_from_map()));

  hypothesis_.Begin(kKey, Here(), kNoId);
  hypothesis_.Confirm(away(0.5));
  EXPECT_FALSE(search(1));
  EXPECT_EQ(hypothesis_.frames(), 2) << "the last frame must be found from the prediction";
  const auto found = search(2);
  ASSERT_TRUE(found);
  EXPECT_TRUE(IsHere(found->result.camera_from_map));

  hypothesis_.Begin(kKey, away(2), kNoId);
  EXPECT_FALSE(search(3));
  EXPECT_EQ(hypothesis_.frames(), 1) << "another place";
  EXPECT_TRUE(IsHere(hypothesis_.camera_from_map()));
}

TEST_F(TwoRooms, LetTheAuthorReturnNearTheLastPoseInSpiteOfAHypothesisElsewhere) {
  options_.poor_visible_ratio = 2;  // so that every pose needs confirmation
  for (const bool build_maps : {true, false}) {
    options_.build_maps = build_maps;
    relocalizer_ = Relocalizer(options_);
    pose_.Begin(Timestamp{}, Here(), ObservedMotion::kSixDof);
    relocalizer_.Lose(Timestamp{});
    maps_.Add(kOtherKey, TheMap());  // explains the image as well
    hypothesis_.Begin(kOtherKey, Here(), kNoId);
    EXPECT_FALSE(relocalizer_.Search(Search(ImageAt(Here(), 1), kKey), &out_));
    if (!build_maps) {
      EXPECT_FALSE(hypothesis_.exists());
      EXPECT_EQ(out_.relocalization.rejection, RejectionReason::kAmbiguous);
      continue;
    }
    EXPECT_EQ(hypothesis_.map_key(), kKey);
    EXPECT_EQ(hypothesis_.frames(), 1);
    maps_.Add(kOtherKey, MapOfOtherRoom());
    EXPECT_FALSE(relocalizer_.Search(Search(ImageAt(Here(), 2), kKey), &out_));
    EXPECT_EQ(hypothesis_.map_key(), kKey);
    EXPECT_EQ(hypothesis_.frames(), 2) << "a hypothesis of this place goes on";
  }
}

TEST_F(TwoRooms, AreReturnedToFromAMapThatWasStartedAfterALoss) {
  // The new map has another origin, so that a pose in the known map can be told from it.
  BetterMapSearch better(options_);
  std::optional<FoundPose> found;
  int frames = 0;
  for (; frames < 30 && !found; ++frames)
    found = better.SearchKnownMaps(Search(ImageAt(Here(), frames), kOtherKey));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->how, FoundPose::How::kEntered);
  EXPECT_EQ(found->map_key, kKey);
  EXPECT_TRUE(IsHere(found->result.camera_from_map));
  EXPECT_GE(frames, 8) << "searches are rationed";
}

TEST(MapHypothesis, IsOfThePlaceOfPosesThatAreNear) {
  MapHypothesis hypothesis;
  hypothesis.Begin(kKey, Here(), kNoId);
  const CameraImage image = ImageAt(Here());
  const auto is_of_place = [&](std::uint64_t map_key, const Rigid3& camera_from_here) {
    MapTrackResult result;
    result.camera_from_map = camera_from_here * Here();
    result.median_depth = 2;
    return hypothesis.IsOfPlace(image, map_key, result);
  };
  const auto moved = [](double x) { return Rigid3(Rotation3(), {x, 0, 0}); };
  const auto turned = [](double angle) {
    return Rigid3(Rotation3::Exp({0, angle, 0}), Eigen::Vector3d::Zero());
  };
  EXPECT_TRUE(is_of_place(kKey, moved(0.49)));
  EXPECT_FALSE(is_of_place(kKey, moved(0.51))) << "farther than a quarter of the depth";
  EXPECT_TRUE(is_of_place(kKey, turned(0.29)));
  EXPECT_FALSE(is_of_place(kKey, turned(0.31)));
  EXPECT_FALSE(is_of_place(kOtherKey, moved(0)));
}

TEST(MapHypothesis, ResumesWithTheFramesOfThePreviousOne) {
  MapHypothesis previous, hypothesis;
  previous.Begin(kKey, Here(), kNoId);
  previous.Confirm(Here());
  hypothesis.Begin(kKey, Here(), kNoId);
  hypothesis.Resume(previous, 0);
  EXPECT_EQ(hypothesis.frames(), 1) << "the present frame counts in any case";
  hypothesis.Resume(previous, 2);
  EXPECT_EQ(hypothesis.frames(), 2);
  hypothesis.Begin(kKey, Here(), kNoId);
  hypothesis.Resume(previous, 5);
  EXPECT_EQ(hypothesis.frames(), 3);
}

TEST(MapHypothesis, CountsConsecutiveFrames) {
  MapHypothesis hypothesis;
  EXPECT_FALSE(hypothesis.exists());
  hypothesis.Begin(7, CameraAt({0, 0, 0}), 3);
  hypothesis.Confirm(CameraAt({0.1, 0, 0}));
  EXPECT_EQ(hypothesis.frames(), 2);
  EXPECT_EQ(hypothesis.panorama(), 3u);
  MapTrackResult result;
  result.inliers = 50;
  const RelocalizationResult unconfirmed = hypothesis.Unconfirmed(result);
  EXPECT_EQ(unconfirmed.rejection, RejectionReason::kUnconfirmed);
  EXPECT_EQ(unconfirmed.map_key, 7u);
  EXPECT_EQ(unconfirmed.frames, 2);
  EXPECT_EQ(unconfirmed.inliers, 50);
  const CameraImage first = ImageAt(CameraAt({0, 0, 0}));
  EXPECT_NEAR(hypothesis.Predict(first).OriginInSource().x(), 0.1, 1e-12);
  hypothesis.Clear();
  EXPECT_FALSE(hypothesis.exists());
}

}  // namespace
}  // namespace docent::engine
