// SPDX-License-Identifier: Apache-2.0
#include "maps/hub/hub_pusher.h"

#include <gmock/gmock.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "maps/library/session_lock.h"
#include "tests/hub/hub_samples.h"
#include "tests/hub/private_server.h"

// Libraries of authoring sessions that save on a hub.
namespace docent::maps {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using testing::HasSubstr;

// What takes a moment takes longer on a machine that is loaded tenfold.
constexpr auto kLongest = 60s;

class HubPush : public WithHubServer {
 protected:
  // What was told so far.
  std::string Told() {
    const std::scoped_lock lock(mutex_);
    return testing::PrintToString(sentences_);
  }
  HubPusher::Tell Tell() {
    return [this](const std::string& sentence) {
      const std::scoped_lock lock(mutex_);
      sentences_.push_back(sentence);
    };
  }
  bool WaitUntilTold(const std::string& part) {
    const auto end = Clock::now() + kLongest;
    while (Told().find(part) == std::string::npos) {
      if (Clock::now() > end) return false;
      std::this_thread::sleep_for(5ms);
    }
    return true;
  }
  void ChangeText(const std::string& text) {
    Library a = OpenSampleLibrary(folder_ / "a");
    EditScene(&a, a.FindByName("Desk").key,
              [&](content::Scene* scene) { scene->entities[0].signpost.text = text; });
  }
  // The text that another device gets from the hub.
  std::string TextElsewhere() {
    Pull(SampleSync(Url(), folder_ / "b"));
    const Library b = OpenToRead(folder_ / "b");
    return SceneIn(b, b.FindByName("Desk").key).entities.at(0).signpost.text;
  }

  TemporaryFolder folder_;

 private:
  std::mutex mutex_;
  std::vector<std::string> sentences_;
};

TEST_F(HubPush, WhatASessionSavesIsSoonOnTheHub) {
  {
    Library a = OpenSampleLibrary(folder_ / "a");
    AddSampleMap(&a, "Desk", 7);
  }
  const SessionLock session(folder_ / "a", SessionLockKind::kSession);
  HubPusher pusher(SampleSync(Url(), folder_ / "a"), Tell());
  EXPECT_TRUE(WaitUntilTold("was added to the hub")) << Told();
  ChangeText("first");
  pusher.LibraryWasSaved();
  EXPECT_TRUE(WaitUntilTold("as revision 2")) << Told();
  EXPECT_EQ(TextElsewhere(), "first");
  ChangeText("last");
  pusher.LibraryWasSaved();
  EXPECT_TRUE(pusher.Finish());
  EXPECT_EQ(TextElsewhere(), "last") << "the end waits for what was saved";
}

TEST_F(HubPush, AHubThatIsGoneGetsTheChangesWhenItIsBack) {
  {
    Library a = OpenSampleLibrary(folder_ / "a");
    AddSampleMap(&a, "Desk", 7);
  }
  HubPusher pusher(SampleSync(Url(), folder_ / "a"), Tell());
  ASSERT_TRUE(WaitUntilTold("was added to the hub")) << Told();
  server().Stop();
  ChangeText("during the cut");
  pusher.LibraryWasSaved();
  EXPECT_TRUE(WaitUntilTold("sent to the hub later")) << Told();
  server().Start();
  EXPECT_TRUE(WaitUntilTold("as revision 2")) << Told();
  EXPECT_EQ(TextElsewhere(), "during the cut");
  EXPECT_TRUE(pusher.Finish());
}

TEST_F(HubPush, AnEndThatIsInterruptedSaysThatSomethingIsMissing) {
  {
    Library a = OpenSampleLibrary(folder_ / "a");
    AddSampleMap(&a, "Desk", 7);
  }
  SyncOptions options = SampleSync(Url(), folder_ / "a");
  options.is_stopped = [] { return true; };
  HubPusher pusher(options, Tell());
  EXPECT_FALSE(pusher.Finish());
  EXPECT_EQ(Told().find("was added to the hub"), std::string::npos) << Told();
}

TEST_F(HubPush, AnEndThatTakesLongSaysSoOnce) {
  {
    Library a = OpenSampleLibrary(folder_ / "a");
    AddSampleMap(&a, "Desk", 7);
  }
  std::atomic<bool> is_told = false;
  SyncOptions options = SampleSync(Url(), folder_ / "a");
  options.is_stopped = [&] {
    while (!is_told) std::this_thread::sleep_for(1ms);  // As on a slow line.
    return false;
  };
  HubPusher pusher(options, Tell());
  int count = 0;
  EXPECT_TRUE(pusher.Finish([&] {
    ++count;
    is_told = true;
  }));
  EXPECT_EQ(count, 1);
}

TEST_F(HubPush, AnEndWithoutAHubSaysThatSomethingIsMissing) {
  {
    Library a = OpenSampleLibrary(folder_ / "a");
    AddSampleMap(&a, "Desk", 7);
  }
  const auto start = Clock::now();
  HubPusher pusher(SampleSync("postgresql://x@%2Fnowhere/docent", folder_ / "a"), Tell());
  pusher.LibraryWasSaved();
  EXPECT_FALSE(pusher.Finish());
  EXPECT_THAT(Told(), HasSubstr("changes are saved in the library"));
  EXPECT_LT(Clock::now() - start, kLongest);
}

TEST_F(HubPush, AMapThatWasChangedOnBothSidesWaitsForTheEndOfTheSession) {
  {
    Library a = OpenSampleLibrary(folder_ / "a");
    AddSampleMap(&a, "Desk", 7);
  }
  Push(SampleSync(Url(), folder_ / "a"));
  Pull(SampleSync(Url(), folder_ / "b"));
  {
    Library b = OpenSampleLibrary(folder_ / "b");
    EditScene(&b, b.FindByName("Desk").key, [](content::Scene* scene) {
      scene->entities.push_back(SampleSignpost("sign-of-b", "theirs"));
    });
  }
  Push(SampleSync(Url(), folder_ / "b"));
  ChangeText("mine");
  {
    const SessionLock session(folder_ / "a", SessionLockKind::kSession);
    HubPusher pusher(SampleSync(Url(), folder_ / "a"), Tell());
    EXPECT_FALSE(pusher.Finish()) << Told();
  }
  EXPECT_THAT(Told(), HasSubstr("session"));
  Push(SampleSync(Url(), folder_ / "a"));
  EXPECT_EQ(TextElsewhere(), "mine");
  const Library a = OpenToRead(folder_ / "a");
  EXPECT_NE(SceneIn(a, a.FindByName("Desk").key).Find("sign-of-b"), nullptr) << "nothing is lost";
}

}  // namespace
}  // namespace docent::maps
