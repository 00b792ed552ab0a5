// SPDX-License-Identifier: Apache-2.0
#include "app/sound/speech.h"

#include <gmock/gmock.h>
#include <stdlib.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "tests/app/support/temporary_folder.h"
#include "tests/support/wait_until.h"

namespace docent::app {
namespace {

using ::testing::HasSubstr;

TEST(Speech, SpeaksAgainOnceTheServiceIsBack) {
  const TemporaryFolder folder;
  // Stands for the program of the service; it fails until there is a service.
  std::ofstream(folder / "spd-say") << "#!/bin/sh\n[ -e '" << (folder / "service").string()
                                    << "' ] || exit 1\n: > '" << (folder / "spoken").string() << "'\n";
  std::filesystem::permissions(folder / "spd-say", std::filesystem::perms::owner_all);
  const std::string path = std::getenv("PATH") != nullptr ? std::getenv("PATH") : "";
  setenv("PATH", (folder / "").c_str(), 1);
  Speech speech("en", std::chrono::milliseconds(0));
  speech.Say("one");
  std::string problem;
  EXPECT_TRUE(WaitUntil([&] { return !(problem = speech.TakeProblem()).empty(); }));
  EXPECT_THAT(problem, HasSubstr("there is no speech service"));
  std::ofstream(folder / "service") << "";
  speech.Say("two");
  EXPECT_TRUE(WaitUntil([&] { return std::filesystem::exists(folder / "spoken"); }));
  setenv("PATH", path.c_str(), 1);
}

}  // namespace
}  // namespace docent::app
