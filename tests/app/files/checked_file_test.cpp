// SPDX-License-Identifier: Apache-2.0
#include "app/files/checked_file.h"

#include <gmock/gmock.h>
#include <sys/resource.h>

#include <csignal>

#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

using ::testing::HasSubstr;

TEST(CheckedFile, HasItsNameOnlyWhenItIsComplete) {
  const TemporaryFolder folder;
  const auto path = folder.Write("list.txt", "old");
  {
    CheckedFile file(path);
    file.Write("new");
    file.Flush();
    EXPECT_EQ(ReadAll(path), "old");
    EXPECT_EQ(ReadAll(folder / "list.txt.part"), "new");
    file.Close();
  }
  EXPECT_EQ(ReadAll(path), "new");
  EXPECT_FALSE(std::filesystem::exists(folder / "list.txt.part"));
}

TEST(CheckedFile, KeepsTheOldFileWithoutClose) {
  const TemporaryFolder folder;
  const auto path = folder.Write("list.txt", "old");
  { CheckedFile(path).Write("half"); }
  EXPECT_EQ(ReadAll(path), "old");
  EXPECT_EQ(ReadAll(folder / "list.txt.part"), "half");
}

TEST(CheckedFile, KeepsWhatCrashedRunsLeftUnderAnotherName) {
  const TemporaryFolder folder;
  KeepUnfinished(folder / "list.txt");
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  for (const char* text : {"first", "second"}) {
    folder.Write("list.txt.part", text);
    KeepUnfinished(folder / "list.txt");
    CheckedFile(folder / "list.txt").Close();
  }
  EXPECT_EQ(ReadAll(folder / "list.txt.part.1"), "first");
  EXPECT_EQ(ReadAll(folder / "list.txt.part.2"), "second");
}

TEST(CheckedFile, KeepsFilesOfEarlierRunsUnderAnotherName) {
  const TemporaryFolder folder;
  KeepEarlier(folder / "tour.mp4");
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  for (const char* text : {"first", "second"}) KeepEarlier(folder.Write("tour.mp4", text));
  EXPECT_EQ(ReadAll(folder / "tour-1.mp4"), "first");
  EXPECT_EQ(ReadAll(folder / "tour-2.mp4"), "second");
}

TEST(CheckedFile, ReportsAMissingFolder) {
  const TemporaryFolder folder;
  EXPECT_THAT(ErrorOf([&] { CheckedFile file(folder / "none/list.txt"); }), HasSubstr("none/list.txt"));
}

TEST(CheckedFile, ReportsAFullDisk) {
  const TemporaryFolder folder;
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit old_limit{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &old_limit), 0);
  rlimit limit = old_limit;
  limit.rlim_cur = 4096;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &limit), 0);
  const std::string sentence = ErrorOf([&] {
    CheckedFile file(folder / "list.txt");
    file.Write(std::string(100'000, 'x'));
    file.Close();
  });
  setrlimit(RLIMIT_FSIZE, &old_limit);
  std::signal(SIGXFSZ, old_handler);
  EXPECT_THAT(sentence, HasSubstr("Cannot write"));
  EXPECT_THAT(sentence, HasSubstr("list.txt"));
  EXPECT_FALSE(std::filesystem::exists(folder / "list.txt"));
}

}  // namespace
}  // namespace docent::app
