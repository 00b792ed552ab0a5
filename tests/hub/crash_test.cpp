// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <stop_token>
#include <thread>

#include "maps/hub/hub_connection.h"
#include "tests/hub/hub_samples.h"
#include "tests/hub/private_server.h"
#include "tests/support/wait_until.h"

// Kills the program while it pushes, and the server while it saves. DOCENT_HUB_KILLS sets how often.
namespace docent::maps {
namespace {

class HubCrash : public WithHubServer {
 protected:
  // Edits and pushes until it is killed, and writes the number of each push that was acknowledged.
  [[noreturn]] void PushForever(int acknowledged) {
    for (int round = first_;; ++round) {
      {
        Library library = OpenSampleLibrary(folder_ / "own");
        const std::uint64_t key = library.FindByName("Desk").key;
        EditScene(&library, key,
                  [&](content::Scene* scene) { scene->entities[0].signpost.text = std::to_string(round); });
        if (round % 3 == 0)
          ExtendMap(&library, key, {0.001 * round, 0, 0}, static_cast<std::uint64_t>(round));
      }
      Push(SampleSync(Url(), folder_ / "own"));
      if (write(acknowledged, &round, sizeof round) != sizeof round) _exit(1);
    }
  }
  // The number in the map that a new device gets.
  int NumberOnHub() {
    const std::filesystem::path fresh = folder_ / ("fresh" + std::to_string(++fresh_));
    EXPECT_EQ(Pull(SampleSync(Url(), fresh)).problems, 0);
    const Library library = OpenSampleLibrary(fresh);
    EXPECT_EQ(NamesIn(library), "Desk");
    EXPECT_THAT(library.Verify(), testing::IsEmpty());
    return std::stoi(SceneIn(library, library.FindByName("Desk").key).entities.at(0).signpost.text);
  }
  // Up to this many milliseconds, so that each time something else is interrupted.
  void SleepAtRandom(std::uint32_t longest_ms) {
    random_ = random_ * 1664525 + 1013904223;
    usleep(random_ / 65536 % longest_ms * 1000);
  }
  static int Kills(int by_default) {
    const char* wanted = std::getenv("DOCENT_HUB_KILLS");
    return wanted ? std::atoi(wanted) : by_default;
  }
  void ShareMap() {
    {
      Library library = OpenSampleLibrary(folder_ / "own");
      const std::uint64_t key = AddSampleMap(&library, "Desk", 5);
      EditScene(&library, key, [](content::Scene* scene) { scene->entities[0].signpost.text = "0"; });
    }
    Push(SampleSync(Url(), folder_ / "own"));
  }

  TemporaryFolder folder_;
  int first_ = 1, fresh_ = 0;
  std::uint32_t random_ = 99;
};

TEST_F(HubCrash, AKilledPushLeavesNothingHalfAndLosesNothingAcknowledged) {
  ShareMap();
  for (int kill_count = 0; kill_count < Kills(6); ++kill_count) {
    int ends[2];
    ASSERT_EQ(pipe(ends), 0);
    const pid_t child = fork();
    if (child == 0) PushForever(ends[1]);
    close(ends[1]);
    int acknowledged = first_ - 1, number = 0;
    EXPECT_EQ(read(ends[0], &number, sizeof number), static_cast<ssize_t>(sizeof number));
    acknowledged = number;
    SleepAtRandom(400);
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    while (read(ends[0], &number, sizeof number) == sizeof number) acknowledged = number;
    close(ends[0]);
    const int there = NumberOnHub();
    // The push in which it was killed may have been saved or not.
    EXPECT_GE(there, acknowledged);
    EXPECT_LE(there, acknowledged + 1);
    EXPECT_EQ(Push(SampleSync(Url(), folder_ / "own")).problems, 0);
    const Library own = OpenSampleLibrary(folder_ / "own");
    EXPECT_EQ(NamesIn(own), "Desk");
    first_ = std::stoi(SceneIn(own, own.FindByName("Desk").key).entities[0].signpost.text) + 1;
    EXPECT_EQ(NumberOnHub(), first_ - 1);
  }
}

TEST_F(HubCrash, AKilledServerLosesNothingAcknowledged) {
  ShareMap();
  std::atomic<int> acknowledged = 0, refused = 0;
  std::jthread pusher([&](const std::stop_token& stop) {
    for (int round = 1; !stop.stop_requested(); ++round) {
      {
        Library library = OpenSampleLibrary(folder_ / "own");
        EditScene(&library, library.FindByName("Desk").key,
                  [&](content::Scene* scene) { scene->entities[0].signpost.text = std::to_string(round); });
      }
      while (!stop.stop_requested()) {
        try {
          if (Push(SampleSync(Url(), folder_ / "own")).problems == 0) acknowledged = round;
          break;
        } catch (const HubUnreachable&) {
          ++refused;
          usleep(20'000);
        }
      }
    }
  });
  const auto await_push = [&] {
    const int before = acknowledged;
    return WaitUntil([&] { return acknowledged > before; });
  };
  for (int kill_count = 0; kill_count < Kills(3); ++kill_count) {
    EXPECT_TRUE(await_push());
    SleepAtRandom(200);
    const int before = refused;
    server().Kill();
    EXPECT_TRUE(WaitUntil([&] { return refused > before; })) << "the server was not missed";
    server().Restart();
  }
  EXPECT_TRUE(await_push());
  pusher.request_stop();
  pusher.join();
  EXPECT_GE(NumberOnHub(), acknowledged);
  EXPECT_EQ(Push(SampleSync(Url(), folder_ / "own")).problems, 0);
  const Library own = OpenSampleLibrary(folder_ / "own");
  EXPECT_EQ(NumberOnHub(), std::stoi(SceneIn(own, own.FindByName("Desk").key).entities[0].signpost.text));
}

}  // namespace
}  // namespace docent::maps
