// SPDX-License-Identifier: Apache-2.0
// The package's `docent`, which runs the build of the program that fits the processor; here both builds are
// scripts.
#include <gmock/gmock.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <utility>

#include "tests/app/support/temporary_folder.h"

#ifdef DOCENT_LAUNCHER

namespace docent::app {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

struct Installed {
  Installed() {
    fs::create_directories(folder / "bin");
    fs::copy_file(DOCENT_LAUNCHER, folder / "bin/docent");
    for (const char* build : {"x86-64-v3", "x86-64"}) {
      const fs::path program = folder.Write("libexec/docent/" + std::string(build) + "/docent",
                                            "#!/bin/sh\necho \"" + std::string(build) + ":$1:$2\"\nexit 7\n");
      fs::permissions(program, fs::perms::owner_all);
    }
  }
  // The exit status, and what is written to both streams.
  std::pair<int, std::string> Run(const std::string& before) const {
    FILE* pipe =
        popen((before + " '" + (folder / "bin/docent").string() + "' one 'two words' 2>&1").c_str(), "r");
    std::string output;
    for (char letter = 0; std::fread(&letter, 1, 1, pipe) == 1;) output += letter;
    const int status = pclose(pipe);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, output};
  }
  TemporaryFolder folder;
};

TEST(Launcher, RunsTheBuildForTheProcessorWithAllArguments) {
  const Installed installed;
  const bool has_avx2 = __builtin_cpu_supports("x86-64-v3") != 0;
  const auto [status, output] = installed.Run("");
  EXPECT_EQ(status, 7) << "the exit status is the program's";
  EXPECT_EQ(output, std::string(has_avx2 ? "x86-64-v3" : "x86-64") + ":one:two words\n");
}

TEST(Launcher, RunsTheBuildForAllProcessorsWhereItIsWanted) {
  const Installed installed;
  EXPECT_EQ(installed.Run("DOCENT_PROCESSOR=x86-64").second, "x86-64:one:two words\n");
}

TEST(Launcher, RunsTheBuildForAllProcessorsOnAnOldOne) {
  if (std::system("command -v qemu-x86_64-static >/dev/null") != 0)
    GTEST_SKIP() << "qemu-x86_64-static, which emulates an old processor, is not installed";
  const Installed installed;
  EXPECT_EQ(installed.Run("qemu-x86_64-static -cpu Nehalem").second, "x86-64:one:two words\n");
}

TEST(Launcher, SaysWhichProgramIsMissing) {
  const Installed installed;
  fs::remove_all(installed.folder / "libexec");
  const auto [status, output] = installed.Run("");
  EXPECT_EQ(status, 1);
  EXPECT_THAT(output, HasSubstr("libexec/docent/x86-64"));
  EXPECT_THAT(output, HasSubstr("cannot be run: No such file or directory."));
}

}  // namespace
}  // namespace docent::app

#endif
