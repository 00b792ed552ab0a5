// SPDX-License-Identifier: Apache-2.0
#include "app/simulator/write_sequence.h"

#include <system_error>

#include "app/calibration/calibration_file.h"
#include "app/output/sequence_writer.h"
#include "engine/base/error.h"

namespace docent::app {
namespace {

// Returns true for an existing empty folder, false if the path does not exist. Throws Error otherwise.
bool ExistsEmpty(const std::filesystem::path& folder) {
  std::error_code error;
  if (!std::filesystem::exists(folder, error)) {
    if (error) throw Error("Cannot access '" + folder.string() + "': " + error.message() + ".");
    return false;
  }
  if (!std::filesystem::is_directory(folder, error)) {
    throw Error("'" + folder.string() + "' is not a folder; choose a new or empty folder.");
  }
  const bool is_empty = std::filesystem::is_empty(folder, error);
  if (error) throw Error("Cannot read the folder '" + folder.string() + "': " + error.message() + ".");
  if (!is_empty) {
    throw Error("The folder '" + folder.string() +
                "' is not empty; choose another one, so that no images are overwritten.");
  }
  return true;
}

void RemoveIncomplete(const std::filesystem::path& folder, bool keep_folder) {
  // Errors are ignored, because the error that led here is the one to report.
  std::error_code ignored;
  if (!keep_folder) {
    std::filesystem::remove_all(folder, ignored);
    return;
  }
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
    std::filesystem::remove_all(entry.path(), ignored);
  }
}

}  // namespace

void WriteSequence(const Simulation& simulation, const std::filesystem::path& folder,
                   const std::function<void(int written, int total)>& progress) {
  const bool existed = ExistsEmpty(folder);
  try {
    SequenceWriter writer(folder, simulation.calibration(), ImageFormat::kPng);
    const double readout_s = simulation.options().faults.readout_s;
    if (readout_s > 0 || !(simulation.calibration() == simulation.camera()))
      WriteCalibration(folder / "true_calibration.yaml",
                       simulation.camera().WithKnownReadout({0, readout_s}));
    for (int frame = 0; frame < simulation.frame_count(); ++frame) {
      SequenceImage image;
      image.time = simulation.time(frame);
      simulation.Render(frame, &image.image);
      image.truth_from_camera = simulation.world_from_camera(frame);
      image.label = simulation.label(frame);
      writer.Add(image);
      if (progress) progress(frame + 1, simulation.frame_count());
    }
    writer.Close();
  } catch (...) {
    RemoveIncomplete(folder, existed);
    throw;
  }
}

}  // namespace docent::app
