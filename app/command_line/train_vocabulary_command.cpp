// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <opencv2/imgproc.hpp>

#include "app/cameras/file_sources.h"
#include "app/command_line/program.h"
#include "app/command_line/progress.h"
#include "app/command_line/run_arguments.h"
#include "app/files/checked_file.h"
#include "app/simulator/simulation.h"
#include "engine/base/error.h"
#include "engine/recognition/vocabulary_tree.h"
#include "engine/vision/features.h"

namespace docent::app {

namespace {

using Descriptors = std::vector<engine::Descriptor>;

struct TrainingOptions {
  std::filesystem::path folder, output;
  int images = 60;  // From each sequence and each simulated scene.
  std::uint64_t seed = 1;
};

void AddImage(const cv::Mat& image, Descriptors* descriptors) {
  cv::Mat gray = image;
  if (image.channels() == 3) cv::cvtColor(image, gray, cv::COLOR_BGR2GRAY);
  if (gray.cols < 64 || gray.rows < 64) return;  // Too small for feature extraction.
  for (const engine::DescribedKeypoint& place : engine::DescribeCorners(*engine::MakeFeatures(gray)))
    descriptors->push_back(place.oriented.descriptor);
}

// Returns the folder itself if it is a sequence, else its subfolders that are sequences, sorted by name.
std::vector<std::filesystem::path> FindSequences(const std::filesystem::path& folder) {
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error))
    throw Error("'" + folder.string() + "' is not a folder; give a folder that contains sequences.");
  if (FindLayout(folder)) return {folder};
  std::vector<std::filesystem::path> sequences;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error))
    if (entry.is_directory(error) && FindLayout(entry.path())) sequences.push_back(entry.path());
  if (error) throw Error("Cannot read the folder '" + folder.string() + "': " + error.message() + ".");
  if (sequences.empty())
    throw Error("There is no sequence in '" + folder.string() +
                "'; a sequence is a folder with rgb.txt, mav0/cam0, video.mp4 or numbered images.");
  std::sort(sequences.begin(), sequences.end());
  return sequences;
}

// Adds the descriptors of `images` images, taken at regular intervals from the sequence.
void AddSequence(const std::filesystem::path& folder, int images, Descriptors* descriptors) {
  const auto source = OpenFolder(folder);
  constexpr std::uint64_t kUnknownLength = 1000;
  const std::uint64_t step = std::max<std::uint64_t>(
      1, source->info().frame_count.value_or(kUnknownLength) / static_cast<std::uint64_t>(images));
  engine::Frame frame;
  int taken = 0;
  for (std::uint64_t index = 0; taken < images && source->Next(&frame); ++index) {
    if (index % step != 0) continue;
    AddImage(frame.image, descriptors);
    ++taken;
  }
}

void AddScene(const char* scene, const TrainingOptions& options, Descriptors* descriptors) {
  SimulationOptions simulated;
  simulated.seed = options.seed;
  const auto simulation = MakeSimulation(scene, simulated);
  const int step = std::max(1, simulation->frame_count() / options.images);
  for (int taken = 0; taken < options.images && taken * step < simulation->frame_count(); ++taken) {
    cv::Mat image;
    simulation->Render(taken * step, &image);
    AddImage(image, descriptors);
  }
}

void Train(const TrainingOptions& options, Verbosity verbosity) {
  const std::vector<std::filesystem::path> sequences = FindSequences(options.folder);
  const auto scenes = SceneRecipes();
  Descriptors descriptors;
  {
    Progress progress("Sequences and scenes processed", sequences.size() + scenes.size(), verbosity);
    std::uint64_t done = 0;
    progress.Update(done);
    for (const std::filesystem::path& sequence : sequences) {
      AddSequence(sequence, options.images, &descriptors);
      progress.Update(++done);
    }
    for (const SceneRecipe& scene : scenes) {
      AddScene(scene.name, options, &descriptors);
      progress.Update(++done);
    }
  }
  const std::size_t count = descriptors.size();
  Progress progress("Cluster centres computed", engine::VocabularyTree::kCenters, verbosity);
  const engine::VocabularyTree tree = engine::VocabularyTree::Train(
      std::move(descriptors), options.seed, [&](std::size_t settled) { progress.Update(settled); });
  const std::vector<std::uint8_t> bytes = tree.ToBytes();
  CheckedFile file(options.output);
  file.Write({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  file.Close();
  if (verbosity != Verbosity::kQuiet) {
    std::printf(
        "%zu descriptors of %zu sequences and %zu simulated scenes clustered into %u visual words in %s\n",
        count, sequences.size(), scenes.size(), engine::VocabularyTree::kLeaves,
        options.output.string().c_str());
  }
}

}  // namespace

void AddTrainVocabularyCommand(CLI::App* program, Invocation* invocation) {
  CLI::App* command = AddSubcommand(
      program, "train-vocabulary",
      "Train the vocabulary tree for place recognition from the sequences in a folder and all simulated\n"
      "scenes. The program has a built-in vocabulary; to use a new one, replace\n"
      "engine/recognition/vocabulary.bin and rebuild.",
      "docent train-vocabulary sequences --output vocabulary.bin");
  const auto options = std::make_shared<TrainingOptions>();
  command->add_option("DIR", options->folder, "A sequence, or a folder of sequences")->required();
  command->add_option("--output", options->output, "File to write")->required();
  command->add_option("--images", options->images, "Number of images used from each sequence and scene")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  AddSeedOption(command, &options->seed);
  command->callback(
      [=] { invocation->run = [options, invocation] { Train(*options, invocation->verbosity); }; });
}

}  // namespace docent::app
