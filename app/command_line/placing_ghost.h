// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "app/command_line/author_view.h"
#include "app/files/file_stamp.h"
#include "engine/base/worker.h"
#include "ui/authoring_actions.h"

namespace docent::app {

// Models, images and sounds for the window, read on a thread of their own so that no frame waits for a disk.
// Window's thread.
class ModelPreviews {
 public:
  // Relative files are searched in this folder first, then in the working folder, as commands do.
  explicit ModelPreviews(std::filesystem::path folder) : folder_(std::move(folder)) {}
  // The asset of a file, which is read again after it was written anew; null while it is read for the first
  // time, and when it cannot be. One file is read at a time.
  std::shared_ptr<const content::Asset> Get(const std::string& file);

 private:
  struct Read {
    std::shared_ptr<const content::Asset> asset;  // Null when the file cannot be read.
    FileStamp stamp;
  };
  const std::filesystem::path folder_;
  std::mutex mutex_;
  std::map<std::string, Read> read_;  // By file. Guarded by mutex_.
  std::optional<Worker> worker_;      // Last: it uses the members above.
};

// What a click would place, under the pointer before the click. Window's thread.
class PlacingGhost {
 public:
  explicit PlacingGhost(std::filesystem::path model_folder) : models_(std::move(model_folder)) {}

  // The name that the placed entity has until it gets its own; no entity can have it.
  static const char* name() { return "\n"; }
  // The scene with the entity that a click at this pixel would place; of a trail, the piece from trail_end to
  // there. Where nothing can be placed, it is the scene itself and *note says why, unless the file is still
  // being read.
  std::shared_ptr<const content::Scene> AddTo(const std::shared_ptr<const content::Scene>& scene,
                                              const AuthorView& view, const ui::AuthoringChoices& choices,
                                              const Eigen::Vector2d& pixel,
                                              const std::optional<Eigen::Vector3d>& trail_end,
                                              std::string* note);

 private:
  // What the chosen tool needs to place something. Empty, with a note, where that is not chosen yet; without
  // one while a file is read.
  std::optional<content::Entity> Begun(const ui::AuthoringChoices& choices, bool has_trail,
                                       std::string* note);

  ModelPreviews models_;
};

}  // namespace docent::app
