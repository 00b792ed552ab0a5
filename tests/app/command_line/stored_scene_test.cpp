// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/stored_scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "app/session/library_scene.h"
#include "content/edits.h"
#include "tests/app/support/temporary_folder.h"
#include "tests/support/error_of.h"

namespace docent::app {
namespace {

using ::testing::HasSubstr;

content::Scene SignThatSays(const std::string& text) {
  content::Scene scene;
  content::Entity sign;
  sign.name = "sign-1";
  sign.signpost.text = text;
  scene.entities = {sign};
  return scene;
}

// A map with one signpost.
class StoredScenes : public ::testing::Test {
 protected:
  StoredScenes() { Save(&library_, library_.NewKey(), "here"); }
  static void Save(maps::Library* library, std::uint64_t key, const std::string& text) {
    library->Save({key, "Desk", maps::Policy::kOpen, nullptr,
                   std::make_shared<maps::SceneRecord>(RecordFromScene(SignThatSays(text)))});
  }
  std::string StoredText() const {
    return StoredNames(library_, library_.FindByName("Desk")).entities.at(0).signpost.text;
  }

  const TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_ / "a.docent";
  maps::Library library_ = OpenLibrary(file_, maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
};

TEST_F(StoredScenes, AreEditedOneChangeAfterTheOther) {
  for (const std::string text : {"there", "nowhere"}) {
    const MakeEdit edits[] = {
        [&](const content::Scene& scene) { return content::TextEdit(scene, "sign-1", text, ""); }};
    EditStoredScene(&library_, library_.FindByName("Desk"), edits);
    EXPECT_EQ(StoredText(), text);
  }
}

TEST_F(StoredScenes, KeepWhatAnotherProgramSavesDuringAnEdit) {
  const maps::MapInfo map = library_.FindByName("Desk");
  maps::Library other = OpenLibrary(file_, maps::Access::kReadWrite);
  const MakeEdit edits[] = {[&](const content::Scene& scene) {
    Save(&other, map.key, "theirs");
    return content::TextEdit(scene, "sign-1", "ours", "");
  }};
  EXPECT_THAT(ErrorOf([&] { EditStoredScene(&library_, map, edits); }),
              HasSubstr("map 'Desk': it was changed by another program meanwhile"));
  EXPECT_EQ(StoredText(), "theirs");
}

}  // namespace
}  // namespace docent::app
