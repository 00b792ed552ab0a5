// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "app/command_line/program.h"
#include "app/simulator/write_sequence.h"
#include "engine/recognition/vocabulary_tree.h"
#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

// The exit status; *errors receives what went to standard error.
int RunWords(const std::vector<std::string>& arguments, std::string* errors = nullptr) {
  std::vector<const char*> words = {"docent", "--quiet"};
  for (const std::string& argument : arguments) words.push_back(argument.c_str());
  testing::internal::CaptureStderr();
  const int status = RunProgram(static_cast<int>(words.size()), words.data());
  const std::string said = testing::internal::GetCapturedStderr();
  if (errors) *errors = said;
  return status;
}

engine::VocabularyTree Read(const std::filesystem::path& path) {
  const std::string text = ReadAll(path);
  return engine::VocabularyTree::FromBytes(std::vector<std::uint8_t>(text.begin(), text.end()));
}

TEST(TrainingAVocabulary, WritesTheSameTreeEveryTime) {
  const TemporaryFolder folder;
  SimulationOptions options;
  options.duration_s = 0.2;
  WriteSequence(*MakeSimulation("desks", options), (folder / "sequences") / "desks");
  for (const char* output : {"first", "again"}) {
    EXPECT_EQ(RunWords({"train-vocabulary", (folder / "sequences").string(), "--output",
                        (folder / output).string(), "--images", "3"}),
              0);
  }
  EXPECT_EQ(Read(folder / "first"), Read(folder / "again"));
  // Nothing but the two is left behind.
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 3);
}

TEST(TrainingAVocabulary, NeedsASequence) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "empty");
  std::string errors;
  EXPECT_EQ(RunWords({"train-vocabulary", (folder / "empty").string(), "--output", (folder / "out").string()},
                     &errors),
            1);
  EXPECT_THAT(errors, testing::HasSubstr("There is no sequence in"));
  EXPECT_EQ(RunWords({"train-vocabulary", (folder / "none").string(), "--output", (folder / "out").string()},
                     &errors),
            1);
  EXPECT_THAT(errors, testing::HasSubstr("is no folder"));
  EXPECT_EQ(RunWords({"train-vocabulary", (folder / "empty").string()}, &errors), 2);
  EXPECT_FALSE(std::filesystem::exists(folder / "out"));
}

}  // namespace
}  // namespace docent::app
