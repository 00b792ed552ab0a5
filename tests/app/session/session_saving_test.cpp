// SPDX-License-Identifier: Apache-2.0
#include "app/session/session_saving.h"

#include <gmock/gmock.h>

#include <atomic>
#include <chrono>
#include <future>
#include <mutex>
#include <thread>

#include "app/session/library_scene.h"
#include "tests/app/support/simulated_session.h"
#include "tests/app/support/temporary_folder.h"
#include "tests/maps/map_samples.h"

namespace docent::app {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// A session with two maps that are not saved yet.
class SavingSession : public ::testing::Test {
 protected:
  SavingSession() {
    for (const char* name : {"Hall", "Yard"}) {
      SessionMap& map = state_.AddMap(keys_.Take(), name);
      map.snapshot = maps::MakeSampleMap(map.key, {.keyframes = 2, .points = 10});
    }
    saving_.Start();
  }
  void AddSign(const std::string& map, const std::string& text) {
    content::Scene scene = *state_.FindByName(map)->scene;
    content::Entity sign;
    sign.name = "sign-1";
    sign.signpost.text = text;
    scene.entities = {sign};
    state_.FindByName(map)->scene = std::make_shared<const content::Scene>(std::move(scene));
  }
  void Save() {
    {
      const std::scoped_lock lock(mutex_);
      saving_.SaveAll({});
    }
    saving_.Flush();
  }
  std::vector<std::string> Warnings() const {
    std::vector<std::string> warnings;
    for (const Event& event : state_.events) {
      if (event.event == "warning") warnings.push_back(event.detail);
    }
    return warnings;
  }
  std::vector<std::string> Stored() const {
    std::vector<std::string> names;
    for (const maps::MapInfo& info : library_.List()) names.push_back(info.name);
    return names;
  }

  const TemporaryFolder folder_;
  maps::Library library_ =
      OpenLibrary(folder_ / "l.docent", maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
  SessionOptions options_ = simulated_session::Options(Pace::kLockstep, "");
  const std::vector<std::shared_ptr<const engine::CameraModel>> cameras_ =
      simulated_session::LensOf(*simulated_session::Room(1));
  engine::System system_{options_, cameras_};
  std::mutex mutex_;
  SessionState state_{cameras_};
  MapKeys keys_{&library_};
  SessionSaving saving_{options_, &library_, &keys_, &system_, &mutex_, &state_};
};

TEST_F(SavingSession, ContentThatCannotBeStoredKeepsNoOtherMapFromBeingSaved) {
  AddSign("Hall", "Caf\xE9");  // No UTF-8.
  AddSign("Yard", "Hello");
  Save();
  Save();
  EXPECT_THAT(Stored(), ElementsAre("Yard"));
  EXPECT_THAT(Warnings(), ElementsAre(HasSubstr("the map 'Hall' cannot be saved: ")));
  EXPECT_TRUE(saving_.Status().unsaved);
  EXPECT_EQ(saving_.DescribeUnsaved(), "Lost: the map 'Hall'.");
  AddSign("Hall", "Caf\xC3\xA9");
  Save();
  EXPECT_THAT(Stored(), ElementsAre("Hall", "Yard"));
  EXPECT_EQ(saving_.DescribeUnsaved(), "");
}

TEST_F(SavingSession, WhoQuitsWithoutSavingHasLostNothing) {
  AddSign("Hall", "Caf\xE9");
  Save();
  saving_.DiscardChanges();
  EXPECT_EQ(saving_.DescribeUnsaved(), "");
}

TEST_F(SavingSession, WhatCouldNotBeWrittenStaysUnsaved) {
  constexpr std::uint64_t kForeignKey = 1'000'000;  // The library refuses it.
  state_.AddMap(kForeignKey, "Attic").snapshot =
      maps::MakeSampleMap(kForeignKey, {.keyframes = 2, .points = 10});
  Save();
  EXPECT_THAT(Stored(), ElementsAre("Hall", "Yard"));
  EXPECT_TRUE(saving_.Status().unsaved);
  state_.FindByName("Attic")->Discard();
  EXPECT_FALSE(saving_.Status().unsaved);
}

TEST_F(SavingSession, AFailedSaveIsReportedWithoutAutomaticSavingToo) {
  options_.autosave_interval = {};
  constexpr std::uint64_t kForeignKey = 1'000'000;
  state_.AddMap(kForeignKey, "Attic").snapshot =
      maps::MakeSampleMap(kForeignKey, {.keyframes = 2, .points = 10});
  Save();
  {
    const std::scoped_lock lock(mutex_);
    saving_.Autosave(std::chrono::seconds(1));
    saving_.Autosave(std::chrono::seconds(20));
  }
  EXPECT_THAT(Warnings(), ElementsAre(HasSubstr("map 'Attic'")));
  EXPECT_TRUE(saving_.Status().unsaved);
}

// What a command does in the library next must not be undone by a save.
TEST_F(SavingSession, ACommandWaitsAlsoForWhatAnotherThreadSubmitsMeanwhile) {
  std::atomic<int> saved = 0;
  std::promise<void> first_is_saved, mutex_is_taken;
  options_.on_saved = [&] {
    if (++saved > 1) return;
    first_is_saved.set_value();
    mutex_is_taken.get_future().wait();
  };
  std::thread other([&] {
    first_is_saved.get_future().wait();
    const std::scoped_lock lock(mutex_);
    mutex_is_taken.set_value();
    saving_.Flush();  // The first save does not need the mutex any more.
    // Meanwhile the first thread comes to wait for the mutex; if it is late, it finds what was submitted
    // anyway.
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    saving_.SaveMap(state_.FindByName("Yard"), {});
  });
  {
    std::unique_lock lock(mutex_);
    SessionMap* const hall = state_.FindByName("Hall");
    saving_.SaveMap(hall, {});
    EXPECT_TRUE(saving_.FlushToLibrary(hall->key, "Hall", {}, &lock));
    EXPECT_EQ(saved.load(), 2);
  }
  other.join();
  saving_.Flush();
}

}  // namespace
}  // namespace docent::app
