// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <functional>

#include "engine/base/random.h"
#include "maps/library/library.h"
#include "maps/library/saver.h"
#include "tests/maps/failing_disk.h"
#include "tests/maps/map_samples.h"

namespace docent::maps {
namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

// Repeatedly saves a second map, each time with the disk filled to a random degree. Expects a one-sentence
// error, and that the first map can be read meanwhile and is intact afterwards.
void ExpectNothingLost(const std::filesystem::path& file, const std::function<void(Random& random)>& fill,
                       const std::function<void()>& relieve) {
  const auto open = [&](Access access) {
    return Library::Open(file, access, CreateIfMissing::kYes, QuickOptions());
  };
  const auto desk = MakeSampleMap(1), door = MakeSampleMap(2, {.keyframes = 8, .points = 300});
  {
    Library library = open(Access::kReadWrite);
    library.Save({library.NewKey(), "Desk", Policy::kOpen, desk, MakeSampleScene(1, 2)});
  }
  const Bytes before = ReadWholeFile(file);
  Random random(3);
  int failures = 0;
  for (int i = 0; i < 50; ++i) {
    WriteWholeFile(file, before);
    bool second_saved = false;
    {
      Library library = open(Access::kReadWrite);
      const std::uint64_t key = library.NewKey();
      const MapRecord record{key, "Door", Policy::kOpen, door, MakeSampleScene(5, 2)};
      fill(random);
      const std::string error = ErrorOf([&] { library.Save(record); });
      second_saved = error.empty();
      if (!second_saved) {
        ++failures;
        EXPECT_THAT(error, StartsWith(file.string()));
        EXPECT_THAT(error, HasSubstr("the disk is full"));
        EXPECT_EQ(error.find('\n'), std::string::npos);
        // The first map can be read while the disk is full, and the failed save succeeds once it is not.
        EXPECT_EQ(FirstDifference(*library.Load(1).snapshot, *desk), "");
        EXPECT_EQ(library.List().size(), 1u);
        if (i % 3 == 0) {
          relieve();
          library.Save(record);
          second_saved = true;
        }
      }
      if (i % 3 == 1) relieve();  // In the other rounds the library is closed with a full disk.
    }
    relieve();
    { open(Access::kReadWrite); }  // Completes what closing could not do on a full disk.
    const Library library = open(Access::kReadOnly);
    EXPECT_THAT(library.Verify(), IsEmpty());
    EXPECT_EQ(FirstDifference(*library.Load(1).snapshot, *desk), "");
    EXPECT_EQ(library.List().size(), second_saved ? 2u : 1u);
    if (second_saved) {
      EXPECT_EQ(FirstDifference(*library.Load(2).snapshot, *door), "");
    }
    EXPECT_EQ(FilesIn(file.parent_path()), "a.docent");
  }
  ::testing::Test::RecordProperty("times_full", failures);
  EXPECT_GT(failures, 20) << "the disk was never full";
  EXPECT_LT(failures, 50) << "the disk was always full";
}

class FullDisk : public ::testing::Test {
 protected:
  Library Open(Access access, CreateIfMissing create = CreateIfMissing::kNo) const {
    return Library::Open(file_, access, create, QuickOptions());
  }
  TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_ / "a.docent";
  FailingDisk disk_;
};

TEST_F(FullDisk, AtAnyWriteOfASaveIsReportedAndLosesNothing) {
  ExpectNothingLost(
      file_, [this](Random& random) { disk_.FailAfter(static_cast<int>(random.Below(120))); },
      [this] { disk_.Repair(); });
}

constexpr const char* kFolderVariable = "DOCENT_SMALL_DISK";
// How the second process ends.
constexpr int kNothingLost = 76, kCannotMount = 77;

// Mounts a file system of a few megabytes that only this process sees.
bool MountSmallDisk(const char* folder) {
  const uid_t user = geteuid();
  const int spaces = CLONE_NEWNS | (user == 0 ? 0 : CLONE_NEWUSER);
  if (unshare(spaces) != 0) return false;
  if (user != 0) std::ofstream("/proc/self/uid_map") << "0 " << user << " 1";
  return mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
         mount("tmpfs", folder, "tmpfs", 0, "size=6m") == 0;
}

TEST(SmallDiskProcess, FillsADiskAndSaves) {
  const char* const folder = std::getenv(kFolderVariable);
  if (!folder) GTEST_SKIP() << "runs only as the second process of another test";
  if (!MountSmallDisk(folder)) _exit(kCannotMount);
  const std::filesystem::path disk = folder, ballast = disk / "ballast";
  std::filesystem::create_directory(disk / "library");
  ExpectNothingLost(
      disk / "library/a.docent",
      [&](Random& random) {
        const auto left = random.Below(250'000);
        const auto free = std::filesystem::space(disk).available;
        std::ofstream file(ballast, std::ios::binary);
        file << std::string(free > left ? free - left : 0, 'x');
      },
      [&] { std::filesystem::remove(ballast); });
  _exit(HasFailure() ? 1 : kNothingLost);  // A process that runs no test ends with 0.
}

TEST(SmallDisk, ThatFillsUpIsReportedAndLosesNothing) {
  const TemporaryFolder folder;
  const pid_t process = fork();
  ASSERT_GE(process, 0);
  if (process == 0) {
    setenv(kFolderVariable, folder.path().c_str(), 1);
    execl("/proc/self/exe", "docent_maps_tests", "--gtest_filter=SmallDiskProcess.*", nullptr);
    _exit(127);
  }
  int status = 0;
  ASSERT_EQ(waitpid(process, &status, 0), process);
  ASSERT_TRUE(WIFEXITED(status));
  if (WEXITSTATUS(status) == kCannotMount) GTEST_SKIP() << "this process may not mount file systems";
  EXPECT_EQ(WEXITSTATUS(status), kNothingLost) << "see the output of the second process above";
}

TEST(FileSizeLimit, IsReportedAndLosesNothing) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder / "a.docent";
  Library library = OpenToWrite(file);
  library.Save({library.NewKey(), "Desk", Policy::kOpen, MakeSampleMap(1), nullptr});
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit limit{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &limit), 0);
  const rlimit small{std::filesystem::file_size(folder / "a.docent-wal") + 20'000, limit.rlim_max};
  const std::uint64_t key = library.NewKey();
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  const std::string error = ErrorOf([&] {
    library.Save({key, "Door", Policy::kOpen, MakeSampleMap(2, {.keyframes = 8}), nullptr});
  });
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &limit), 0);
  std::signal(SIGXFSZ, handler);
  EXPECT_THAT(error, HasSubstr("cannot be read or written (File too large)"));
  EXPECT_THAT(library.Verify(), IsEmpty());
  EXPECT_EQ(FirstDifference(*library.Load(1).snapshot, *MakeSampleMap(1)), "");
  library.Save({key, "Door", Policy::kOpen, MakeSampleMap(2, {.keyframes = 8}), nullptr});
  EXPECT_EQ(FirstDifference(*library.Load(key).snapshot, *MakeSampleMap(2, {.keyframes = 8})), "");
}

TEST_F(FullDisk, IsHarmlessWhileALibraryIsCreatedOrClosed) {
  for (int writes = 0; writes < 12; ++writes) {
    disk_.FailAfter(writes);
    const std::string error = ErrorOf([&] { Open(Access::kReadWrite, CreateIfMissing::kYes); });
    EXPECT_THAT(error, AnyOf("", HasSubstr("the disk is full")));
    disk_.Repair();
    Open(Access::kReadWrite, CreateIfMissing::kYes);  // The second attempt succeeds.
    EXPECT_THAT(Open(Access::kReadOnly).Verify(), IsEmpty());
    std::filesystem::remove(file_);
  }
  {
    Library library = Open(Access::kReadWrite, CreateIfMissing::kYes);
    library.Save({library.NewKey(), "Desk", Policy::kOpen, MakeSampleMap(1), nullptr});
    disk_.FailAfter(0);  // The log cannot be moved into the file.
  }
  disk_.Repair();
  const Library library = Open(Access::kReadOnly);
  EXPECT_THAT(library.Verify(), IsEmpty());
  EXPECT_EQ(FirstDifference(*library.Load(1).snapshot, *MakeSampleMap(1)), "");
}

TEST_F(FullDisk, IsReportedByTheSaverWhichContinues) {
  Library library = Open(Access::kReadWrite, CreateIfMissing::kYes);
  const std::uint64_t key = library.NewKey();
  Saver saver(&library);
  disk_.FailAfter(2);
  saver.Submit({key, "Desk", Policy::kOpen, MakeSampleMap(1), nullptr});
  saver.Flush();
  EXPECT_THAT(ErrorOf([&] { std::rethrow_exception(saver.TakeError()); }), HasSubstr("the disk is full"));
  disk_.Repair();
  saver.Submit({key, "Desk", Policy::kOpen, MakeSampleMap(1), nullptr});
  saver.Flush();
  EXPECT_EQ(saver.TakeError(), nullptr);
  EXPECT_EQ(FirstDifference(*library.Load(key).snapshot, *MakeSampleMap(1)), "");
}

TEST_F(FullDisk, AReadOnlyDiskIsReportedAndReadable) {
  { Open(Access::kReadWrite, CreateIfMissing::kYes).NewKey(); }
  const Bytes before = ReadWholeFile(file_);
  disk_.SetReadOnly(true);
  const std::string error = ErrorOf([&] { Open(Access::kReadWrite); });
  EXPECT_THAT(error, HasSubstr("is not writable; open it read-only or change its permissions"));
  EXPECT_THAT(Open(Access::kReadOnly).Verify(), IsEmpty());
  EXPECT_EQ(ReadWholeFile(file_), before);
  EXPECT_EQ(FilesIn(folder_.path()), "a.docent");
}

}  // namespace
}  // namespace docent::maps
