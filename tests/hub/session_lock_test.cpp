// SPDX-License-Identifier: Apache-2.0
#include "maps/library/session_lock.h"

#include <gmock/gmock.h>
#include <signal.h>

#include <atomic>
#include <chrono>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/end_to_end/run_docent.h"
#include "tests/hub/hub_samples.h"
#include "tests/hub/private_server.h"
#include "tests/support/wait_until.h"

// Exchanges with a hub while an authoring session has the library open.
namespace docent::maps {
namespace {

using testing::HasSubstr;

class HubSessionLock : public WithHubServer {
 protected:
  void SetUp() override {
    WithHubServer::SetUp();
    if (IsSkipped() || HasFatalFailure()) return;
    {
      Library a = OpenSampleLibrary(folder_ / "a");
      AddSampleMap(&a, "Desk", 7);
    }
    Push(SampleSync(Url(), folder_ / "a"));
    Pull(SampleSync(Url(), folder_ / "b"));
  }
  void TearDown() override { KillAuthor(); }
  void KillAuthor() {
    if (author_ <= 0) return;
    kill(author_, SIGKILL);
    waitpid(std::exchange(author_, -1), nullptr, 0);
  }
  void AddSign(const std::string& device, const std::string& name, const std::string& text) {
    AddSampleSignpost(folder_ / device, "Desk", name, text);
  }
  std::string TextsOn(const std::string& device) {
    const Library library = OpenSampleLibrary(folder_ / device);
    std::string texts;
    for (const content::Entity& entity : SceneIn(library, library.FindByName("Desk").key).entities)
      texts += entity.signpost.text + ";";
    return texts;
  }

  TemporaryFolder folder_;
  pid_t author_ = -1;
};

TEST_F(HubSessionLock, APullReplacesNoMapOfASession) {
  AddSign("a", "sign-2", "from a");
  Push(SampleSync(Url(), folder_ / "a"));
  {
    const SessionLock session(folder_ / "b", SessionLockKind::kSession);
    const SyncReport report = Pull(SampleSync(Url(), folder_ / "b"));
    EXPECT_EQ(report.problems, 1);
    EXPECT_EQ(report.waiting, 1);
    EXPECT_THAT(LinesOf(report), HasSubstr("is open in docent author"));
    EXPECT_EQ(TextsOn("b"), "Hello;");
  }
  EXPECT_EQ(Pull(SampleSync(Url(), folder_ / "b")).problems, 0);
  EXPECT_EQ(TextsOn("b"), "Hello;from a;");
}

// Whether a session can begin when something is first transferred.
SyncOptions TryingASession(SyncOptions options, std::optional<bool>* can_begin) {
  options.is_stopped = [library = options.library, can_begin] {
    if (*can_begin) return false;
    try {
      const SessionLock session(library, SessionLockKind::kSession);
      *can_begin = true;
    } catch (const Error&) {
      *can_begin = false;
    }
    return false;
  };
  return options;
}

TEST_F(HubSessionLock, ASessionCanBeginDuringATransfer) {
  AddSign("a", "sign-2", "from a");
  Push(SampleSync(Url(), folder_ / "a"));
  std::optional<bool> can_begin;
  EXPECT_EQ(Pull(TryingASession(SampleSync(Url(), folder_ / "b"), &can_begin)).problems, 0);
  EXPECT_EQ(can_begin, true) << "a pull of a map that only the hub has changed";
  AddSign("a", "sign-3", "from a again");
  AddSign("b", "sign-4", "from b");
  Push(SampleSync(Url(), folder_ / "a"));
  can_begin.reset();
  EXPECT_EQ(Push(TryingASession(SampleSync(Url(), folder_ / "b"), &can_begin)).problems, 0);
  EXPECT_EQ(can_begin, true) << "a push of a map that both sides have changed";
  AddSign("b", "sign-5", "from b again");
  Push(SampleSync(Url(), folder_ / "b"));
  AddSign("a", "sign-6", "from a at last");
  can_begin.reset();
  EXPECT_EQ(Pull(TryingASession(SampleSync(Url(), folder_ / "a"), &can_begin)).problems, 0);
  EXPECT_EQ(can_begin, true) << "a pull of a map that both sides have changed";
}

TEST_F(HubSessionLock, ASessionCanBeginWhileTheKeyframesOfASecondMapAreSent) {
  {
    Library a = OpenSampleLibrary(folder_ / "a"), b = OpenSampleLibrary(folder_ / "b");
    ExtendMap(&a, a.FindByName("Desk").key, {0.1, 0, 0}, 51);
    ExtendMap(&b, b.FindByName("Desk").key, {0.2, 0, 0}, 52);
  }
  Push(SampleSync(Url(), folder_ / "a"));
  std::optional<bool> can_begin;
  const SyncReport report = Push(TryingASession(SampleSync(Url(), folder_ / "b"), &can_begin));
  EXPECT_EQ(report.problems, 0) << LinesOf(report);
  EXPECT_THAT(LinesOf(report), HasSubstr("both versions are kept"));
  EXPECT_EQ(can_begin, true);
}

TEST_F(HubSessionLock, APushDoesNotMergeWhatASessionWouldUndo) {
  AddSign("a", "sign-2", "from a");
  Push(SampleSync(Url(), folder_ / "a"));
  AddSign("b", "sign-3", "from b");
  {
    const SessionLock session(folder_ / "b", SessionLockKind::kSession);
    EXPECT_EQ(Push(SampleSync(Url(), folder_ / "b")).problems, 1);
    Pull(SampleSync(Url(), folder_ / "a"));
    EXPECT_EQ(TextsOn("a"), "Hello;from a;") << "the hub was changed";
  }
  EXPECT_EQ(Push(SampleSync(Url(), folder_ / "b")).problems, 0);
  Pull(SampleSync(Url(), folder_ / "a"));
  for (const char* device : {"a", "b"}) {
    EXPECT_THAT(TextsOn(device), HasSubstr("from a"));
    EXPECT_THAT(TextsOn(device), HasSubstr("from b"));
  }
}

TEST_F(HubSessionLock, APushWithoutAMergeGoesOnBesideASession) {
  AddSign("b", "sign-2", "from b");
  const SessionLock session(folder_ / "b", SessionLockKind::kSession);
  EXPECT_EQ(Push(SampleSync(Url(), folder_ / "b")).problems, 0);
  Pull(SampleSync(Url(), folder_ / "a"));
  EXPECT_EQ(TextsOn("a"), "Hello;from b;");
}

TEST_F(HubSessionLock, TheProgramSaysThatASessionHasTheLibraryOpen) {
  AddSign("a", "sign-2", "from a");
  Push(SampleSync(Url(), folder_ / "a"));
  // The images of an hour, so that the session lasts until it is killed.
  author_ = app::StartDocent({"author", "--headless", "--library", (folder_ / "b").string(), "--camera",
                              "sim:room,rest=3600,rest-at=1", "--pace", "realtime"},
                             (folder_ / "out").string(), (folder_ / "errors").string());
  ASSERT_TRUE(WaitUntil([this] { return std::filesystem::exists(folder_ / "b.session"); }));
  const app::Outcome during =
      app::RunDocent({"maps", "pull", "--library", (folder_ / "b").string(), "--hub", Url()});
  EXPECT_EQ(during.exit_status, 1);
  EXPECT_THAT(during.output + during.errors, HasSubstr("'Desk' was not updated: "));
  EXPECT_THAT(during.output + during.errors, HasSubstr("is open in docent author"));
  // The session would save the map as it knows it.
  const std::vector<std::vector<std::string>> changes = {
      {"content", "add", "--label", "A desk", "--map", "Desk", "--at", "0", "1", "2"},
      {"content", "remove", "sign-1", "--map", "Desk"},
      {"maps", "rename", "Desk", "Table"},
      {"maps", "remove", "Desk"}};
  for (std::vector<std::string> change : changes) {
    change.insert(change.end(), {"--library", (folder_ / "b").string()});
    const app::Outcome refused = app::RunDocent(change);
    EXPECT_EQ(refused.exit_status, 1) << change[1];
    EXPECT_THAT(refused.errors, HasSubstr("is open in docent author")) << change[1];
  }
  const app::Outcome second = app::RunDocent(
      {"author", "--headless", "--library", (folder_ / "b").string(), "--camera", "sim:room,duration=1"});
  EXPECT_EQ(second.exit_status, 1);
  EXPECT_THAT(second.errors, HasSubstr("is already open in docent author"));
  KillAuthor();  // A session that ended so leaves the file, but not the lock.
  const app::Outcome after =
      app::RunDocent({"maps", "pull", "--library", (folder_ / "b").string(), "--hub", Url()});
  EXPECT_EQ(after.exit_status, 0) << after.output << after.errors;
  EXPECT_EQ(TextsOn("b"), "Hello;from a;");
}

TEST(SessionLock, ASessionHasTheLibraryForItselfAndRemovesTheFile) {
  const TemporaryFolder folder;
  const std::filesystem::path library = folder / "m.docent";
  {
    const SessionLock session(library, SessionLockKind::kSession);
    EXPECT_THROW(SessionLock(library, SessionLockKind::kSession), LibraryInSession);
    EXPECT_THROW(SessionLock(library, SessionLockKind::kReplace), LibraryInSession);
  }
  EXPECT_EQ(FilesIn(folder.path()), "");
  { const SessionLock next(library, SessionLockKind::kSession); }
  { const SessionLock replacing(library, SessionLockKind::kReplace); }
  EXPECT_EQ(FilesIn(folder.path()), "");
}

TEST(SessionLock, WhoReplacesWaitsForOthersWhoDo) {
  const TemporaryFolder folder;
  const std::filesystem::path library = folder / "m.docent";
  std::optional<SessionLock> first(std::in_place, library, SessionLockKind::kReplace);
  std::atomic<bool> has_ended = false;
  std::thread other([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(400));
    has_ended = true;
    first.reset();
  });
  EXPECT_NO_THROW({
    const SessionLock second(library, SessionLockKind::kReplace);
    EXPECT_TRUE(has_ended);
  });
  other.join();
}

}  // namespace
}  // namespace docent::maps
