// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/run_sounds.h"

#include <gmock/gmock.h>

namespace docent::app {
namespace {

// A camera at a sound of ten seconds.
ShownFrame FrameAtSound(double seconds) {
  auto asset = std::make_shared<content::Asset>();
  asset->id = "roar";
  asset->kind = content::AssetKind::kSound;
  asset->seconds = 10;
  content::Entity sound;
  sound.name = "roar";
  sound.kind = content::Entity::Kind::kSound;
  sound.sound.asset = std::move(asset);
  sound.sound.caption = "A lion roars.";
  sound.sound.range = 2;
  ShownFrame frame;
  frame.seconds = seconds;
  frame.tracked.state = engine::TrackingState::kSixDof;
  frame.tracked.map_key = 1;
  frame.shown.scene = std::make_shared<const content::Scene>(content::Scene{{sound}});
  return frame;
}

TEST(RunSounds, ASoundGoesOnWhileThePoseIsNotBelieved) {
  const GuideRequest request;
  RunSounds sounds(request);
  ShownFrame frame = FrameAtSound(0);
  EXPECT_EQ(sounds.Add(&frame).size(), 1u) << "it begins";
  frame = FrameAtSound(1);
  frame.held_camera_from_map.emplace();
  frame.tracked.camera_from_map = {engine::Rotation3(), {0, 0, 9}};
  sounds.Add(&frame);
  EXPECT_EQ(frame.caption, "A lion roars.");
  frame = FrameAtSound(4);
  frame.shown.scene.reset();
  sounds.Add(&frame);
  EXPECT_EQ(frame.caption, "A lion roars.");
  frame = FrameAtSound(5);
  EXPECT_TRUE(sounds.Add(&frame).empty()) << "it does not begin anew";
  EXPECT_EQ(frame.caption, "A lion roars.");
  frame = FrameAtSound(6);
  frame.tracked.camera_from_map = {engine::Rotation3(), {0, 0, 9}};
  sounds.Add(&frame);
  EXPECT_EQ(frame.caption, "") << "the camera has left it";
}

TEST(RunSounds, TheNextVisitorHearsWhatTheOneBeforeHasHeard) {
  const GuideRequest request;
  RunSounds sounds(request);
  ShownFrame frame = FrameAtSound(0);
  EXPECT_EQ(sounds.Add(&frame).size(), 1u);
  frame = FrameAtSound(30);
  EXPECT_TRUE(sounds.Add(&frame).empty());
  frame = FrameAtSound(31);
  frame.visitors_before = 1;
  EXPECT_EQ(sounds.Add(&frame).size(), 1u);
  frame = FrameAtSound(32);
  frame.visitors_before = 1;
  EXPECT_TRUE(sounds.Add(&frame).empty());
}

}  // namespace
}  // namespace docent::app
