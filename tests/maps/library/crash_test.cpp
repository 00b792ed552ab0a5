// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>

#include "engine/base/random.h"
#include "engine/mapping/loops/map_joining.h"
#include "maps/library/library.h"
#include "tests/maps/map_samples.h"

// Tests with a second process: an author who is killed at any moment, and one who writes while a visitor
// reads. The second process is this program again, which runs one test that is skipped otherwise.
namespace docent::maps {
namespace {

constexpr const char* kFileVariable = "DOCENT_AUTHOR_FILE";
constexpr const char* kPipeVariable = "DOCENT_AUTHOR_PIPE";

// The map of a round. It depends only on the round, so that a reader can check whether it is complete.
std::shared_ptr<engine::MapSnapshot> MapOfRound(std::uint64_t round) {
  auto map = MakeSampleMap(round, {.keyframes = 2 + static_cast<int>(round % 3), .points = 200});
  map->revision = round;
  return map;
}

TEST(AuthorProcess, SavesRoundAfterRoundUntilItIsKilled) {
  const char* file = std::getenv(kFileVariable);
  if (!file) GTEST_SKIP() << "runs only as the second process of other tests";
  const int pipe = std::atoi(std::getenv(kPipeVariable));
  Library library = OpenToWrite(file);
  const auto maps = library.List();
  const std::uint64_t key = maps.empty() ? library.NewKey() : maps.front().key;
  for (std::uint64_t round = maps.empty() ? 1 : maps.front().revision + 1;; ++round) {
    library.Save({key, "Desk", Policy::kOpen, MapOfRound(round), MakeSampleScene(round, 1)});
    // The round is reported after the save: from here on it must not be lost.
    if (write(pipe, &round, sizeof(round)) != static_cast<ssize_t>(sizeof(round))) break;
  }
}

class Author {
 public:
  explicit Author(const std::filesystem::path& file) {
    int ends[2];
    if (pipe(ends) != 0) throw std::runtime_error("no pipe");
    process_ = fork();
    if (process_ == 0) {
      close(ends[0]);
      setenv(kFileVariable, file.c_str(), 1);
      setenv(kPipeVariable, std::to_string(ends[1]).c_str(), 1);
      const int silence = open("/dev/null", O_WRONLY);
      dup2(silence, STDOUT_FILENO);
      execl("/proc/self/exe", "docent_maps_tests", "--gtest_filter=AuthorProcess.*", nullptr);
      _exit(127);
    }
    close(ends[1]);
    pipe_ = ends[0];
  }
  ~Author() {
    if (process_ > 0) Kill();
  }
  // Returns the round of the next finished save; 0 when the author has ended.
  std::uint64_t WaitForSave() {
    std::uint64_t round = 0;
    return read(pipe_, &round, sizeof(round)) == static_cast<ssize_t>(sizeof(round)) ? round : 0;
  }
  // Kills the author and returns the last reported round.
  std::uint64_t Kill() {
    kill(process_, SIGKILL);
    waitpid(process_, nullptr, 0);
    process_ = 0;
    std::uint64_t last = 0;
    while (const std::uint64_t round = WaitForSave()) last = round;
    close(pipe_);
    return last;
  }

 private:
  pid_t process_ = 0;
  int pipe_ = -1;
};

void ExpectComplete(const StoredMap& stored) {
  EXPECT_EQ(FirstDifference(*stored.snapshot, *MapOfRound(stored.info.revision)), "");
  EXPECT_EQ(FirstDifference(stored.scene, *MakeSampleScene(stored.info.revision, 1)), "");
}

// The number of repetitions: a small default, or the value of an environment variable.
int Repetitions(const char* variable, int default_count) {
  const char* const wanted = std::getenv(variable);
  return wanted ? std::atoi(wanted) : default_count;
}

TEST(Crash, AKilledAuthorLosesAtMostTheCurrentSave) {
  const TemporaryFolder folder;
  const auto file = folder / "a.docent";
  Random random(1);
  std::uint64_t reported = 0;
  for (int kills = 0; kills < Repetitions("DOCENT_KILLS", 12); ++kills) {
    {
      Author author(file);
      // Some are killed while they open the library, some during a save, some between two.
      if (kills % 4 != 0) reported = std::max(reported, author.WaitForSave());
      std::this_thread::sleep_for(std::chrono::microseconds(random.Below(kills % 4 != 0 ? 60'000 : 120'000)));
      reported = std::max(reported, author.Kill());
    }
    if (reported == 0) continue;  // The file may not exist yet.
    for (const Access access : {Access::kReadOnly, Access::kReadWrite}) {
      if (access == Access::kReadWrite && kills % 2 == 0)
        continue;  // The next author finds the log unchanged.
      const Library library = Library::Open(file, access, CreateIfMissing::kNo, QuickOptions());
      EXPECT_EQ(library.Verify(), std::vector<std::string>{});
      const auto maps = library.List();
      ASSERT_EQ(maps.size(), 1u);
      EXPECT_GE(maps[0].revision, reported) << "a finished save was lost";
      EXPECT_LE(maps[0].revision, reported + 1);
      ExpectComplete(library.Load(maps[0].key));
      reported = maps[0].revision;
    }
  }
  EXPECT_GT(reported, 5u) << "the authors never finished a save";
}

// Two sample maps and the record that joins them.
JoinRecord JoinOf(const Library& library) {
  const StoredMap into = library.Load(library.FindByName("East").key),
                  from = library.Load(library.FindByName("West").key);
  JoinRecord record;
  record.into = into.info;
  record.from = from.info;
  engine::JoinedIds ids;
  record.snapshot =
      std::make_shared<engine::MapSnapshot>(engine::SideBySide(*into.snapshot, *from.snapshot, &ids));
  record.scene = std::make_shared<SceneRecord>(SceneRecord{"joined", into.scene.assets});
  return record;
}

TEST(JoinerProcess, JoinsTwoMapsUntilItIsKilled) {
  const char* file = std::getenv("DOCENT_JOINER_FILE");
  if (!file) GTEST_SKIP() << "runs only as the second process of other tests";
  Library library = OpenToWrite(file);
  const JoinRecord record = JoinOf(library);
  const char begun = 1;
  if (write(std::atoi(std::getenv(kPipeVariable)), &begun, 1) == 1) library.Join(record);
}

TEST(Crash, AJoinIsAtomicWhenTheProgramIsKilled) {
  const TemporaryFolder folder;
  Random random(3);
  int joined = 0, unjoined = 0;
  // Some are killed before the join is done and some after it; how many depends on the machine's load.
  constexpr int kMostRounds = 200;
  const int least = Repetitions("DOCENT_KILLS", 12);
  for (int round = 0; round < least || (round < kMostRounds && std::min(joined, unjoined) == 0); ++round) {
    const auto file = folder / (std::to_string(round) + ".docent");
    {
      Library library = OpenToWrite(file);
      for (const char* name : {"East", "West", "Hall"}) {
        library.Save({library.NewKey(), name, Policy::kOpen,
                      MakeSampleMap(1, {.keyframes = 6, .points = 200}), MakeTextScene("sign a 0 West")});
      }
    }
    int ends[2];
    ASSERT_EQ(pipe(ends), 0);
    const pid_t process = fork();
    if (process == 0) {
      setenv("DOCENT_JOINER_FILE", file.c_str(), 1);
      setenv(kPipeVariable, std::to_string(ends[1]).c_str(), 1);
      const int silence = open("/dev/null", O_WRONLY);
      dup2(silence, STDOUT_FILENO);
      execl("/proc/self/exe", "docent_maps_tests", "--gtest_filter=JoinerProcess.*", nullptr);
      _exit(127);
    }
    close(ends[1]);
    char begun = 0;
    ASSERT_EQ(read(ends[0], &begun, 1), 1);
    close(ends[0]);
    const int longest_us = round < least ? 40'000 : joined == 0 ? 10'000 * (round - least + 5) : 1'000;
    std::this_thread::sleep_for(
        std::chrono::microseconds(random.Below(static_cast<std::uint32_t>(longest_us))));
    kill(process, SIGKILL);
    waitpid(process, nullptr, 0);
    Library library = OpenToWrite(file);
    EXPECT_EQ(library.Verify(), std::vector<std::string>{});
    const bool done = library.List().size() == 2;
    ++(done ? joined : unjoined);
    EXPECT_EQ(library.List().size(), done ? 2u : 3u);
    EXPECT_EQ(library.LoadScene(library.FindByName("Hall").key).text,
              done ? "sign a 1 East" : "sign a 0 West");
    const StoredMap east = library.Load(library.FindByName("East").key);
    EXPECT_EQ(east.snapshot->keyframes.size(), done ? 12u : 6u);
    EXPECT_EQ(east.scene.text, done ? "joined" : "sign a 0 West");
  }
  EXPECT_GT(joined, 0);
  EXPECT_GT(unjoined, 0);
}

TEST(TwoProcesses, AVisitorSeesOnlyCompleteSavesWhileAnAuthorWrites) {
  const TemporaryFolder folder;
  const auto file = folder / "a.docent";
  Author author(file);
  ASSERT_EQ(author.WaitForSave(), 1u);
  const Library visitor = OpenToRead(file);
  std::uint64_t last = 0;
  for (int visits = 0; visits < 25; ++visits) {
    const std::uint64_t reported = author.WaitForSave();
    const StoredMap stored = visitor.Load(visitor.List().front().key);
    EXPECT_GE(stored.info.revision, reported);
    EXPECT_GE(stored.info.revision, last);
    last = stored.info.revision;
    ExpectComplete(stored);
  }
  EXPECT_TRUE(visitor.Verify().empty());
}

TEST(TwoProcesses, TwoToursSeeOnlyCompleteSavesWhileAnAuthorWrites) {
  const TemporaryFolder folder;
  const auto file = folder / "a.docent";
  Author author(file);
  ASSERT_EQ(author.WaitForSave(), 1u);
  const int visits = Repetitions("DOCENT_VISITS", 25);
  std::atomic<bool> done = false;
  std::vector<std::jthread> tours;
  for (int tour = 0; tour < 2; ++tour) {
    tours.emplace_back([&, tour] {
      std::uint64_t last = 0;
      for (int visit = 0; visit < visits; ++visit) {
        // One tour stays open, the other reopens the library.
        const Library library = OpenToRead(file);
        for (int round = 0; round < (tour == 0 ? 5 : 1); ++round) {
          const StoredMap stored = library.Load(library.List().front().key);
          EXPECT_GE(stored.info.revision, last);
          last = stored.info.revision;
          ExpectComplete(stored);
          library.LoadAppearance([&](const MapInfo& info, const Library::Appearance& appearance) {
            EXPECT_EQ(appearance.problem, "");
            EXPECT_EQ(appearance.thumbnails.size(), info.keyframes);
            EXPECT_EQ(appearance.words.size(), info.keyframes);
          });
        }
      }
      done = true;
    });
  }
  // The author's reports must be read; otherwise the pipe fills up and blocks the author.
  while (!done && author.WaitForSave() != 0) continue;
  tours.clear();
  const std::uint64_t reported = author.Kill();
  const Library library = OpenToRead(file);
  EXPECT_GE(library.List().front().revision, reported);
  EXPECT_TRUE(library.Verify().empty());
}

TEST(TwoProcesses, AClosedLibraryIsASingleFile) {
  const TemporaryFolder folder;
  const auto file = folder / "a.docent";
  std::uint64_t key = 0;
  {
    Library library = OpenToWrite(file);
    key = library.NewKey();
    library.Save({key, "Desk", Policy::kOpen, MakeSampleMap(1), nullptr});
  }
  EXPECT_EQ(FilesIn(folder.path()), "a.docent");
  const Bytes before = ReadWholeFile(file);
  {
    const Library visitor = OpenToRead(file);
    EXPECT_EQ(FirstDifference(*visitor.Load(key).snapshot, *MakeSampleMap(1)), "");
    EXPECT_EQ(FilesIn(folder.path()), "a.docent") << "while it is open";
  }
  EXPECT_EQ(FilesIn(folder.path()), "a.docent");
  EXPECT_EQ(ReadWholeFile(file), before);
}

TEST(TwoProcesses, AFileLeftInLogModeIsReadWithoutCreatingFiles) {
  const TemporaryFolder folder;
  const auto file = folder / "a.docent";
  Author(file).WaitForSave();  // Killed: the header says that there is a log.
  OpenToRead(file);
  {
    // An open visitor prevents the log's removal, but its contents are still moved into the file.
    const Library visitor = OpenToRead(file);
    EXPECT_EQ(visitor.List().size(), 1u);
    Library author = Library::Open(file, Access::kReadWrite, CreateIfMissing::kNo, QuickOptions());
    author.Rename(author.List().front().key, "Table");
  }
  std::filesystem::create_directory(folder / "copy");
  std::filesystem::copy_file(file, folder / "copy/a.docent");
  std::filesystem::permissions(folder / "copy",
                               std::filesystem::perms::owner_read | std::filesystem::perms::owner_exec);
  const Library copy = OpenToRead(folder / "copy/a.docent");
  const auto maps = copy.List();
  ASSERT_EQ(maps.size(), 1u);
  EXPECT_EQ(maps[0].name, "Table");
  ExpectComplete(copy.Load(maps[0].key));
  EXPECT_EQ(FilesIn(folder / "copy"), "a.docent");
  std::filesystem::permissions(folder / "copy", std::filesystem::perms::owner_all);
}

}  // namespace
}  // namespace docent::maps
