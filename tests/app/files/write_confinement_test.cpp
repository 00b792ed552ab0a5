// SPDX-License-Identifier: Apache-2.0
#include "app/files/write_confinement.h"

#include <gtest/gtest.h>
#include <linux/landlock.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <string>
#include <thread>

#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

constexpr int kNotConfined = 77;

bool Write(const std::filesystem::path& file) {
  std::ofstream stream(file);
  stream << "text";
  stream.close();
  return !stream.fail();
}

// Carries out a test in a process of its own, since a confinement cannot be undone. It returns 0 if all is as
// expected, else the number of what is not.
int InChild(const std::function<int()>& test) {
  const pid_t child = fork();
  if (child == 0) _exit(test());
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

class WriteConfinement : public ::testing::Test {
 protected:
  WriteConfinement() {
    std::filesystem::create_directory(inside());
    std::filesystem::create_directory(outside());
    EXPECT_TRUE(Write(outside() / "mine"));
  }
  std::filesystem::path inside() const { return folder_ / "inside"; }
  std::filesystem::path outside() const { return folder_ / "outside"; }
  // Runs in a child that may only write inside.
  void ExpectInConfinement(const std::function<int()>& test) {
    if (syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION) < 1)
      GTEST_SKIP() << "this kernel has no Landlock, or a container forbids it";
    const int result = InChild([&] {
      const std::array folders = {inside(), folder_ / "is not there"};
      return ConfineWritesTo(folders) ? test() : kNotConfined;
    });
    EXPECT_NE(result, kNotConfined) << "the kernel has Landlock";
    EXPECT_EQ(result, 0);
  }

 private:
  const TemporaryFolder folder_;
};

TEST_F(WriteConfinement, AllowsToCreateChangeAndRemoveFilesInTheFolders) {
  ExpectInConfinement([&] {
    if (!Write(inside() / "new") || !Write(inside() / "new")) return 1;
    std::error_code error;
    if (!std::filesystem::create_directory(inside() / "folder", error)) return 2;
    std::filesystem::rename(inside() / "new", inside() / "folder" / "renamed", error);
    if (error) return 3;
    return std::filesystem::remove(inside() / "folder" / "renamed", error) ? 0 : 4;
  });
}

TEST_F(WriteConfinement, RefusesToCreateChangeOrRemoveFilesElsewhere) {
  ExpectInConfinement([&] {
    std::error_code error;
    if (Write(outside() / "new")) return 1;
    if (Write(outside() / "mine")) return 2;
    if (std::filesystem::create_directory(outside() / "folder", error)) return 3;
    if (std::filesystem::remove(outside() / "mine", error)) return 4;
    std::filesystem::create_symlink("mine", outside() / "link", error);
    return error ? 0 : 5;
  });
}

TEST_F(WriteConfinement, NamesTheNearestFolderThatExists) {
  EXPECT_EQ(ExistingFolderOf(inside()), inside());
  EXPECT_EQ(ExistingFolderOf(inside() / "run" / "tour.mp4"), inside());
  EXPECT_EQ(ExistingFolderOf(outside() / "mine"), outside());
  EXPECT_EQ(ExistingFolderOf("/is not there"), "/");
}

TEST_F(WriteConfinement, LeavesReadingAlone) {
  ExpectInConfinement([&] {
    std::string text;
    std::ifstream(outside() / "mine") >> text;
    return text == "text" ? 0 : 1;
  });
}

TEST_F(WriteConfinement, HoldsForLaterThreadsAndPrograms) {
  ExpectInConfinement([&] {
    bool written = true;
    std::thread([&] { written = Write(outside() / "mine"); }).join();
    if (written) return 1;
    const std::string command = "exec 2> /dev/null; echo text > '" + (outside() / "new").string() + "'";
    return std::system(command.c_str()) != 0 && !std::filesystem::exists(outside() / "new") ? 0 : 2;
  });
}

}  // namespace
}  // namespace docent::app
