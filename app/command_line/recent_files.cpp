// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/recent_files.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <fstream>
#include <iterator>

namespace docent::app {

namespace {

constexpr std::size_t kMostRecentFiles = 12;
constexpr const char* kModelEndings[] = {".glb", ".gltf", ".obj", ".ply", ".stl",
                                         ".fbx", ".dae",  ".3ds", ".off"};

}  // namespace

std::filesystem::path RecentFiles::DefaultPlace() {
  const auto folder = [](const char* variable) {
    const char* const value = std::getenv(variable);
    return std::filesystem::path(value != nullptr ? value : "");
  };
  if (const auto state = folder("XDG_STATE_HOME"); state.is_absolute())
    return state / "docent" / "recent-models";
  if (const auto home = folder("HOME"); home.is_absolute())
    return home / ".local" / "state" / "docent" / "recent-models";
  return {};
}

RecentFiles::RecentFiles(std::filesystem::path place) : place_(std::move(place)) {
  if (place_.empty()) return;
  std::ifstream stored(place_);
  for (std::string line; files_.size() < kMostRecentFiles && std::getline(stored, line);) {
    std::error_code error;
    if (std::filesystem::path(line).is_absolute() && std::filesystem::is_regular_file(line, error))
      files_.push_back(line);
  }
}

void RecentFiles::Add(const std::filesystem::path& file) {
  std::error_code error;
  const std::filesystem::path absolute = std::filesystem::absolute(file, error);
  if (error || absolute.string().find('\n') != std::string::npos) return;
  std::erase(files_, absolute.string());
  files_.insert(files_.begin(), absolute.string());
  if (files_.size() > kMostRecentFiles) files_.resize(kMostRecentFiles);
  if (place_.empty()) return;
  std::filesystem::create_directories(place_.parent_path(), error);
  std::ofstream stored(place_, std::ios::trunc);
  for (const std::string& path : files_) stored << path << '\n';
}

bool IsModelFile(const std::filesystem::path& file) {
  std::string ending = file.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return std::find(std::begin(kModelEndings), std::end(kModelEndings), ending) != std::end(kModelEndings);
}

std::string ModelFilePatterns() {
  std::string patterns;
  for (const char* ending : kModelEndings) patterns += (patterns.empty() ? "*" : " *") + std::string(ending);
  return patterns;
}

std::vector<std::string> ModelFilesIn(const std::filesystem::path& folder) {
  std::vector<std::string> models;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    if (IsModelFile(entry.path())) models.push_back(entry.path().filename().string());
  }
  std::sort(models.begin(), models.end());
  return models;
}

}  // namespace docent::app
