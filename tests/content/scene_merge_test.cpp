// SPDX-License-Identifier: Apache-2.0
#include "content/scene_merge.h"

#include <gmock/gmock.h>

namespace docent::content {
namespace {

Entity SignOf(const std::string& name, const std::string& text) {
  Entity entity;
  entity.name = name;
  entity.signpost.text = text;
  return entity;
}

// "a=1 b=2".
std::string EntitiesOf(const Scene& scene) {
  std::string text;
  for (const Entity& entity : scene.entities)
    text += (text.empty() ? "" : " ") + entity.name + "=" + entity.signpost.text;
  return text;
}

TEST(SceneMerge, TakesWhatEitherSideChanged) {
  const Scene base{{SignOf("a", "1"), SignOf("b", "1"), SignOf("c", "1")}};
  const Scene mine{{SignOf("a", "2"), SignOf("b", "1"), SignOf("d", "mine")}};
  const Scene theirs{{SignOf("a", "1"), SignOf("b", "3"), SignOf("c", "1"), SignOf("e", "theirs")}};
  const SceneMerge merge = MergeScenes(base, mine, theirs);
  EXPECT_EQ(EntitiesOf(merge.scene), "a=2 b=3 e=theirs d=mine");
  EXPECT_THAT(merge.conflicts, testing::IsEmpty());
}

TEST(SceneMerge, KeepsBothVersionsOfWhatBothChanged) {
  const Scene base{{SignOf("a", "1")}};
  const SceneMerge merge = MergeScenes(base, Scene{{SignOf("a", "mine")}}, Scene{{SignOf("a", "theirs")}});
  EXPECT_EQ(EntitiesOf(merge.scene), "a=theirs a-2=mine");
  ASSERT_EQ(merge.conflicts.size(), 1u);
  EXPECT_THAT(merge.conflicts[0], testing::HasSubstr("'a-2'"));
  const SceneMerge again = MergeScenes(base, Scene{{SignOf("a", "mine")}}, merge.scene);
  EXPECT_EQ(EntitiesOf(again.scene), "a=theirs a-2=mine") << "an interrupted merge was made twice";
}

TEST(SceneMerge, AChangeCountsMoreThanARemoval) {
  const Scene base{{SignOf("a", "1"), SignOf("b", "1")}};
  const SceneMerge merge = MergeScenes(base, Scene{{SignOf("a", "2")}}, Scene{{SignOf("b", "2")}});
  EXPECT_EQ(EntitiesOf(merge.scene), "b=2 a=2");
  EXPECT_THAT(merge.conflicts, testing::IsEmpty());
}

TEST(SceneMerge, EqualChangesAreOne) {
  const SceneMerge merge = MergeScenes({}, Scene{{SignOf("a", "1")}}, Scene{{SignOf("a", "1")}});
  EXPECT_EQ(EntitiesOf(merge.scene), "a=1");
  EXPECT_THAT(merge.conflicts, testing::IsEmpty());
}

Entity SignIn(const std::string& group, const std::string& name, const std::string& text = "1") {
  Entity entity = SignOf(name, text);
  entity.group = group;
  return entity;
}

// "a:group-1 b:".
std::string GroupsOf(const Scene& scene) {
  std::string text;
  for (const Entity& entity : scene.entities)
    text += (text.empty() ? "" : " ") + entity.name + ":" + entity.group;
  return text;
}

TEST(SceneMerge, KeepsGroupsOfTheSameNameApart) {
  const Scene base{{SignOf("a", "1"), SignOf("b", "1"), SignOf("c", "1"), SignOf("d", "1")}};
  const Scene mine{{SignIn("group-1", "a"), SignIn("group-1", "b"), SignOf("c", "1"), SignOf("d", "1")}};
  const Scene theirs{{SignOf("a", "1"), SignOf("b", "1"), SignIn("group-1", "c"), SignIn("group-1", "d")}};
  const SceneMerge merge = MergeScenes(base, mine, theirs);
  EXPECT_EQ(GroupsOf(merge.scene), "a:group-1-2 b:group-1-2 c:group-1 d:group-1");
  EXPECT_THAT(merge.conflicts, testing::IsEmpty());
  const SceneMerge again = MergeScenes(base, mine, merge.scene);
  EXPECT_EQ(GroupsOf(again.scene), GroupsOf(merge.scene)) << "an interrupted merge was made twice";
  EXPECT_THAT(again.conflicts, testing::IsEmpty());
}

TEST(SceneMerge, KeepsGroupsOfNewEntitiesOfTheSameNamesApart) {
  const Scene mine{{SignIn("group-1", "a", "my a"), SignIn("group-1", "b", "my b")}};
  const Scene theirs{{SignIn("group-1", "a", "their a"), SignIn("group-1", "b", "their b")}};
  const SceneMerge merge = MergeScenes({}, mine, theirs);
  EXPECT_EQ(GroupsOf(merge.scene), "a:group-1 b:group-1 a-2:group-1-2 b-2:group-1-2");
  EXPECT_EQ(GroupsOf(MergeScenes({}, mine, merge.scene).scene), GroupsOf(merge.scene));
}

TEST(SceneMerge, DoesNotUniteGroupsThatTheOtherSideHasUnited) {
  const Scene base{{SignOf("a", "1"), SignOf("b", "b"), SignOf("x", "1"), SignOf("y", "1")}};
  const Scene mine{
      {SignIn("group-1", "a"), SignIn("group-2", "b", "b"), SignIn("group-1", "x"), SignIn("group-2", "y")}};
  const Scene theirs{
      {SignIn("group-1", "a"), SignIn("group-1", "b", "b"), SignOf("x", "1"), SignOf("y", "1")}};
  const SceneMerge merge = MergeScenes(base, mine, theirs);
  EXPECT_EQ(GroupsOf(merge.scene), "a:group-1 b:group-1 x:group-1 y:group-2 b-2:group-2");
  EXPECT_EQ(merge.conflicts.size(), 1u) << "of b";
}

TEST(SceneMerge, LeavesGroupsThatBothSidesHave) {
  // Before, or since.
  const Scene base{{SignIn("group-1", "a"), SignOf("b", "1"), SignOf("c", "1"), SignOf("d", "1")}};
  const Scene mine{
      {SignIn("group-1", "a"), SignIn("group-1", "b"), SignIn("group-2", "c"), SignIn("group-2", "d", "2")}};
  const Scene theirs{
      {SignIn("group-1", "a", "2"), SignOf("b", "1"), SignIn("group-2", "c"), SignOf("d", "1")}};
  const SceneMerge merge = MergeScenes(base, mine, theirs);
  EXPECT_EQ(GroupsOf(merge.scene), "a:group-1 b:group-1 c:group-2 d:group-2");
  EXPECT_EQ(EntitiesOf(merge.scene), "a=2 b=1 c=1 d=2");
  EXPECT_THAT(merge.conflicts, testing::IsEmpty());
}

TEST(SceneMerge, OfSettingsThatBothChangedTheOthersCount) {
  Scene base, mine, theirs;
  mine.settings.metres_per_unit = 2;
  EXPECT_EQ(MergeScenes(base, mine, theirs).scene.settings.metres_per_unit, 2);
  EXPECT_EQ(MergeScenes(base, theirs, mine).scene.settings.metres_per_unit, 2);
  theirs.settings.metres_per_unit = 3;
  const SceneMerge merge = MergeScenes(base, mine, theirs);
  EXPECT_EQ(merge.scene.settings.metres_per_unit, 3);
  ASSERT_EQ(merge.conflicts.size(), 1u);
  EXPECT_THAT(merge.conflicts[0], testing::HasSubstr("2.0"));
}

}  // namespace
}  // namespace docent::content
