// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace docent::app {

// The model files that were placed last, kept in a text file from one run to the next, one path a line. A
// file that cannot be read or written is no error: there is nothing to remember then. One thread.
class RecentFiles {
 public:
  // Where the list is kept: docent/recent-models in $XDG_STATE_HOME, else in ~/.local/state; empty without
  // either.
  static std::filesystem::path DefaultPlace();
  // Reads the list at this place, which may be empty. Files that no longer exist are left out.
  explicit RecentFiles(std::filesystem::path place);

  // Puts a file first, and stores the list. Paths with line breaks are not remembered.
  void Add(const std::filesystem::path& file);
  const std::vector<std::string>& files() const { return files_; }  // The last one first; absolute paths.

 private:
  std::filesystem::path place_;
  std::vector<std::string> files_;
};

// Whether the ending of the file's name is one of a model.
bool IsModelFile(const std::filesystem::path& file);
// The endings of models as a file dialog takes them: "*.glb *.gltf" and so on.
std::string ModelFilePatterns();
// The model files in a folder, by name; empty when it cannot be read.
std::vector<std::string> ModelFilesIn(const std::filesystem::path& folder);

}  // namespace docent::app
