// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/keyframe_offers.h"

#include <gtest/gtest.h>

#include "tests/engine/tracking/tracked_image.h"

namespace docent::engine {
namespace {

using testing_world::Camera;
using testing_world::CameraAt;
using testing_world::ImageAt;

// A map with one keyframe at the origin, and a tracked frame a metre beside it at a depth of two metres.
class SidewaysStep : public ::testing::Test {
 protected:
  SidewaysStep() {
    KeyFrame keyframe;
    keyframe.id = 4;
    map_.keyframes.push_back(keyframe);
    map_.revision = 9;
    result_.camera_from_map = CameraAt({1, 0, 0});
    result_.median_depth = 2;
    result_.inliers = result_.finite_inliers = 300;
    result_.finite_coverage = result_.coverage = 1;
    matches_.resize(2);
    matches_[0].inlier = true;
    matches_[1].inlier = false;
  }
  // Whether the next frame is offered; the mapper accepts it if `accepted`.
  bool Offers(KeyFrameOffers* offers, bool accepted) {
    offers->BeginFrame();
    offers->Consider(image_, map_, {result_, matches_, kNoId, result_.median_depth});
    last_ = offers->Take();
    EXPECT_FALSE(offers->Take()) << "an offer is returned once";
    if (accepted) {
      EXPECT_EQ(offers->Accept().has_value(), last_.has_value());
    }
    return last_.has_value();
  }

  void AddToMap(Timestamp time) {
    KeyFrame keyframe = map_.keyframes.back();
    keyframe.id += 1;
    keyframe.time = time;
    map_.keyframes.push_back(keyframe);
  }

  MapSnapshot map_;
  MapTrackResult result_;
  std::vector<PointMatch> matches_;
  CameraImage image_ = ImageAt(CameraAt({1, 0, 0}), 30);
  std::optional<KeyFrameCandidate> last_;
};

TrackerOptions AtOnce() {
  TrackerOptions options;
  options.frames_between_keyframes = 1;
  return options;
}

TEST_F(SidewaysStep, IsOfferedWithItsPoseAndInliers) {
  KeyFrameOffers offers(AtOnce(), *Camera());
  ASSERT_TRUE(Offers(&offers, true));
  EXPECT_EQ(last_->choice, KeyFrameChoice::kSixDof);
  EXPECT_EQ(last_->time, image_.time);
  EXPECT_EQ(last_->features, image_.features);
  EXPECT_EQ(last_->matches.size(), 1u);
  EXPECT_EQ(last_->map_revision, 9u);
  EXPECT_EQ(last_->reference_keyframe, 4u);
}

TEST_F(SidewaysStep, IsOfferedAgainInTheNextFrameWhenItWasRefused) {
  TrackerOptions options;
  KeyFrameOffers offers(options, *Camera());
  int first = 0;
  while (first < 10 && !Offers(&offers, false)) ++first;
  ASSERT_LT(first, 10);
  EXPECT_TRUE(Offers(&offers, true));
  AddToMap(image_.time);
  for (int i = 1; i < options.frames_between_keyframes; ++i) EXPECT_FALSE(Offers(&offers, true)) << i;
  EXPECT_TRUE(Offers(&offers, true));
}

TEST_F(SidewaysStep, WaitsUntilTheLastKeyframeIsInTheMapUnlessItWasDropped) {
  TrackerOptions options;
  const auto frames_until_the_next = [&](int frames_until_in_map) {
    const MapSnapshot map = map_;
    KeyFrameOffers offers(options, *Camera());
    int frames = 0;
    while (frames < 10 && !Offers(&offers, true)) ++frames;
    EXPECT_LT(frames, 10);
    for (frames = 1; frames < 100; ++frames) {
      if (frames == frames_until_in_map) AddToMap(image_.time);
      if (Offers(&offers, true)) break;
    }
    map_ = map;
    return frames;
  };
  EXPECT_EQ(frames_until_the_next(1), options.frames_between_keyframes);
  EXPECT_EQ(frames_until_the_next(9), 9);
  EXPECT_EQ(frames_until_the_next(100), options.max_frames_without_keyframe);
  // The camera may be in another map after a restart.
  KeyFrameOffers offers(options, *Camera());
  int frames = 0;
  while (frames < 10 && !Offers(&offers, true)) ++frames;
  offers.Restart();
  for (frames = 1; frames < 100 && !Offers(&offers, true);) ++frames;
  EXPECT_EQ(frames, options.frames_between_keyframes);
  // A map from the library has times of another clock.
  AddToMap(image_.time + FromSeconds(100));
  map_.next_keyframe = map_.keyframes.back().id + 1;
  EXPECT_EQ(frames_until_the_next(9), 9);
}

TEST_F(SidewaysStep, IsOfferedAsSoonAsTheLastKeyframeIsInTheMapWhenPointsLeaveTheImage) {
  const auto offers_after_a_keyframe = [this](int inliers, bool in_map) {
    KeyFrameOffers offers({}, *Camera());
    MapSnapshot map = map_;
    matches_.assign(300, {.inlier = true});
    result_.inliers = result_.finite_inliers = 300;
    int frames = 0;
    while (frames < 10 && !Offers(&offers, true)) ++frames;
    EXPECT_LT(frames, 10);
    if (in_map) AddToMap(image_.time);
    result_.inliers = result_.finite_inliers = inliers;
    const bool offered = Offers(&offers, true);
    map_ = map;
    return offered;
  };
  EXPECT_TRUE(offers_after_a_keyframe(250, true));
  EXPECT_FALSE(offers_after_a_keyframe(250, false)) << "the map lacks the last keyframe";
  EXPECT_FALSE(offers_after_a_keyframe(290, true)) << "hardly any point has left the image";
}

TEST_F(SidewaysStep, OpensNoPanoramaMapWhenItsKeyFrameIsRefused) {
  result_.finite_coverage = result_.coverage = 0.3;
  result_.inliers = result_.finite_inliers = 40;  // the camera is about to leave the map
  for (const bool accepted : {false, true}) {
    KeyFrameOffers offers(AtOnce(), *Camera());
    ASSERT_TRUE(Offers(&offers, accepted));
    EXPECT_EQ(last_->choice, KeyFrameChoice::kLocalizedPanorama);
    EXPECT_EQ(offers.policy().mode() == KeyFramePolicy::Mode::kPanorama, accepted);
  }
}

TEST_F(SidewaysStep, CannotBeAcceptedInALaterFrame) {
  KeyFrameOffers offers(AtOnce(), *Camera());
  ASSERT_TRUE(Offers(&offers, false));
  offers.BeginFrame();
  EXPECT_FALSE(offers.Accept());
}

TEST_F(SidewaysStep, IsNotOfferedAfterItWasWithdrawn) {
  KeyFrameOffers offers(AtOnce(), *Camera());
  offers.BeginFrame();
  offers.Consider(image_, map_, {result_, matches_, kNoId, result_.median_depth});
  offers.Withdraw();
  EXPECT_FALSE(offers.Take());
}

// The points were lost from one frame to the next, and the whole image tells the rotation.
class PointsLostAtOnce : public SidewaysStep {
 protected:
  PointsLostAtOnce() {
    KeyFrame here;  // so that the step itself is no reason for a keyframe
    here.id = 5;
    here.camera_from_map = CameraAt({1, 0, 0});
    map_.keyframes.push_back(here);
    alone_.observed = ObservedMotion::kPanorama;
    alone_.camera_from_map = CameraAt({1, 0, 0}, {0, 10, 0});
  }
  // What is offered after a localized frame and, after this time, one without points.
  std::optional<KeyFrameCandidate> OfferedAfter(Timestamp time, KeyFrameOffers* offers) {
    EXPECT_FALSE(Offers(offers, false));
    CameraImage image = image_;
    image.time += time;
    offers->BeginFrame();
    offers->Consider(image, map_, {alone_, {}, kNoId, result_.median_depth});
    return offers->Take();
  }

  MapTrackResult alone_;
};

TEST_F(PointsLostAtOnce, MakesTheLastLocalizedFrameTheReferenceOfAPanoramaMap) {
  KeyFrameOffers offers(AtOnce(), *Camera());
  const auto offered = OfferedAfter(std::chrono::milliseconds(33), &offers);
  ASSERT_TRUE(offered);
  EXPECT_EQ(offered->choice, KeyFrameChoice::kLocalizedPanorama);
  EXPECT_EQ(offered->time, image_.time);
  EXPECT_EQ(offered->features, image_.features);
  EXPECT_EQ(offered->matches.size(), 1u);
  EXPECT_EQ(offered->map_revision, 9u);
  EXPECT_EQ(offers.Accept(), image_.time);
  EXPECT_EQ(offers.policy().mode(), KeyFramePolicy::Mode::kPanorama);
}

TEST_F(PointsLostAtOnce, OffersNothingOnceTheLastLocalizedFrameIsOld) {
  KeyFrameOffers offers(AtOnce(), *Camera());
  EXPECT_FALSE(OfferedAfter(std::chrono::milliseconds(300), &offers));
}

TEST_F(PointsLostAtOnce, OffersNothingWhereThatPanoramaMapExists) {
  KeyFrame reference = map_.keyframes.back();
  reference.id = 6;
  reference.panorama = 1;
  map_.keyframes.push_back(reference);
  PanoramaMap panorama;
  panorama.id = 1;
  panorama.reference = 6;
  map_.panoramas.push_back(panorama);
  KeyFrameOffers offers(AtOnce(), *Camera());
  EXPECT_FALSE(OfferedAfter(std::chrono::milliseconds(33), &offers));
}

TEST_F(PointsLostAtOnce, OffersNothingAfterThePoseHasJumped) {
  KeyFrameOffers offers(AtOnce(), *Camera());
  EXPECT_FALSE(Offers(&offers, false));
  offers.Restart();
  offers.BeginFrame();
  offers.Consider(image_, map_, {alone_, {}, kNoId, result_.median_depth});
  EXPECT_FALSE(offers.Take());
}

TEST(KeyFrameOffers, OfferTheFirstImageOfAMap) {
  KeyFrameOffers offers(TrackerOptions(), *Camera());
  offers.BeginFrame();
  const CameraImage image = ImageAt(CameraAt({0, 0, 0}), 3);
  offers.OfferFirst(image);
  const auto first = offers.Take();
  ASSERT_TRUE(first);
  EXPECT_EQ(first->choice, KeyFrameChoice::kFirst);
  EXPECT_EQ(offers.Accept(), image.time);
  EXPECT_EQ(offers.policy().mode(), KeyFramePolicy::Mode::kPanorama);
  offers.Reset();
  EXPECT_EQ(offers.policy().mode(), KeyFramePolicy::Mode::kSixDof);
}

}  // namespace
}  // namespace docent::engine
