// SPDX-License-Identifier: Apache-2.0
// Tries every way in which an author's session writes to a map, against each policy.
#include "maps/storage/policy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "tests/app/support/simulated_session.h"
#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

using namespace simulated_session;
using maps::Policy;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// A library with one open map of the first seconds of a longer walk, with a signpost in it.
const std::string& LibraryBytes() {
  static const std::string bytes = [] {
    const TemporaryFolder folder;
    const auto simulation = Room(2.5);
    {
      auto library =
          maps::Library::Open(folder / "a.docent", maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
      Session session(Options(Pace::kLockstep, "Bay"), LensOf(*simulation), &library);
      CalibratedCamera camera = CameraOf(simulation);
      FrameLoopOptions loop;
      loop.pace = Pace::kLockstep;
      bool placed = false;
      RunFrames(
          &camera, &session, loop,
          [&](const engine::TrackedFrame& frame) {
            if (placed || !frame.map || frame.frame.time < FromSeconds(2)) return;
            placed = ErrorOf([&] { session.Execute(PlaceSignpost{"here", {320, 290}, ""}, frame); }).empty();
          },
          {});
      session.Finish();
    }
    return ReadAll(folder / "a.docent");
  }();
  return bytes;
}

class EveryPolicyInASession : public ::testing::TestWithParam<Policy> {
 protected:
  bool structure() const { return GetParam() == Policy::kOpen || GetParam() == Policy::kBounded; }
  bool content() const { return GetParam() != Policy::kReadOnly; }

  const TemporaryFolder folder_;
};

TEST_P(EveryPolicyInASession, IsObservedByTheMapperAndByEachEditOfContent) {
  std::ofstream(folder_ / "a.docent", std::ios::binary) << LibraryBytes();
  auto library = maps::Library::Open(folder_ / "a.docent", maps::Access::kReadWrite);
  ASSERT_EQ(library.List().size(), 1u);
  const std::uint64_t key = library.List()[0].key;
  const maps::StoredMap before = library.Load(key);
  ASSERT_THAT(before.scene.text, HasSubstr("sign-1"));
  // The policy is set by a command while the session runs, as a user would do it.
  const auto simulation = Room(5);
  Session session(Options(Pace::kLockstep, ""), LensOf(*simulation), &library);
  CalibratedCamera camera = CameraOf(simulation);
  FrameLoopOptions loop;
  loop.pace = Pace::kLockstep;
  std::uint64_t frames = 0;
  bool edited = false;
  RunFrames(&camera, &session, loop,
            [&](const engine::TrackedFrame& frame) {
              if (++frames == 1) session.Execute(SetPolicy{"Bay", GetParam()}, frame);
              if (edited || !engine::HasPose(frame.state) || frame.frame.time < FromSeconds(2)) return;
              edited = true;
              const Command edits[] = {MoveEntity{"sign-1", {0.01, 0, 0}, {}},
                                       ScaleEntity{"sign-1", 1.5},
                                       PlaceSignpost{"there", {330, 290}, ""},
                                       Undo{},
                                       Redo{},
                                       RemoveEntities{{"sign-1"}}};
              for (const Command& edit : edits) {
                const std::string error = ErrorOf([&] { session.Execute(edit, frame); });
                if (content()) {
                  EXPECT_EQ(error, "");
                } else {
                  EXPECT_THAT(error, HasSubstr("its content cannot be changed"));
                }
              }
            },
            {});
  session.Finish();
  EXPECT_TRUE(edited) << "the map was never entered";
  const maps::StoredMap after = library.Load(key);
  EXPECT_EQ(after.info.policy, GetParam());
  EXPECT_EQ(after.scene.text != before.scene.text, content());
  if (!structure()) {
    EXPECT_EQ(after.info.revision, before.info.revision);
    EXPECT_EQ(after.info.keyframes, before.info.keyframes);
    EXPECT_EQ(after.info.points, before.info.points);
    EXPECT_EQ(after.info.observations, before.info.observations);
    for (std::size_t i = 0; i < after.snapshot->points.size(); ++i)
      ASSERT_EQ(after.snapshot->points[i].point_in_map, before.snapshot->points[i].point_in_map);
  } else {
    EXPECT_GT(after.info.revision, before.info.revision) << "it must have been adjusted";
    int inside = 0, outside = 0;
    const maps::Bounds bounds = *maps::ComputeBounds(*before.snapshot);
    for (const engine::KeyFrame& keyframe : after.snapshot->keyframes) {
      if (keyframe.id < before.info.next_keyframe) continue;
      const bool in = maps::KeyFrameAllowed(Policy::kBounded, maps::Expanded(bounds, 0.05),
                                            keyframe.camera_from_map.OriginInSource());
      ++(in ? inside : outside);
    }
    if (GetParam() == Policy::kOpen) {
      EXPECT_GT(inside + outside, 0);
    } else {
      EXPECT_EQ(outside, 0);
    }
  }
  EXPECT_THAT(library.Verify(), IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(Policies, EveryPolicyInASession,
                         ::testing::Values(Policy::kOpen, Policy::kBounded, Policy::kAugmentOnly,
                                           Policy::kReadOnly),
                         [](const auto& tried) {
                           std::string name = maps::ToString(tried.param);
                           std::erase(name, '-');
                           return name;
                         });

}  // namespace
}  // namespace docent::app
