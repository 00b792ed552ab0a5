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

// Runs the program and returns its exit status; *errors receives its standard error output.
int RunCommand(const std::vector<std::string>& arguments, std::string* errors = nullptr) {
  std::vector<const char*> words = {"docent", "--quiet"};
  for (const std::string& argument : arguments) words.push_back(argument.c_str());
  testing::internal::CaptureStderr();
  const int status = RunProgram(static_cast<int>(words.size()), words.data());
  const std::string error_output = testing::internal::GetCapturedStderr();
  if (errors) *errors = error_output;
  return status;
}

engine::VocabularyTree Read(const std::filesystem::path& path) {
  const std::string text = ReadAll(path);
  return engine::VocabularyTree::FromBytes(std::vector<std::uint8_t>(text.begin(), text.end()));
}

TEST(VocabularyTraining, IsReproducible) {
  const TemporaryFolder folder;
  SimulationOptions options;
  options.duration_s = 0.2;
  WriteSequence(*MakeSimulation("desks", options), (folder / "sequences") / "desks");
  for (const char* output : {"first", "again"}) {
    EXPECT_EQ(RunCommand({"train-vocabulary", (folder / "sequences").string(), "--output",
                          (folder / output).string(), "--images", "3"}),
              0);
  }
  EXPECT_EQ(Read(folder / "first"), Read(folder / "again"));
  // No files are left besides the sequences and the two vocabularies.
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 3);
}

TEST(VocabularyTraining, RequiresASequence) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "empty");
  std::string errors;
  EXPECT_EQ(
      RunCommand({"train-vocabulary", (folder / "empty").string(), "--output", (folder / "out").string()},
                 &errors),
      1);
  EXPECT_THAT(errors, testing::HasSubstr("There is no sequence in"));
  EXPECT_EQ(
      RunCommand({"train-vocabulary", (folder / "none").string(), "--output", (folder / "out").string()},
                 &errors),
      1);
  EXPECT_THAT(errors, testing::HasSubstr("is not a folder"));
  EXPECT_EQ(RunCommand({"train-vocabulary", (folder / "empty").string()}, &errors), 2);
  EXPECT_FALSE(std::filesystem::exists(folder / "out"));
}

}  // namespace
}  // namespace docent::app
