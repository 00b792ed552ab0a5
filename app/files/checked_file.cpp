// SPDX-License-Identifier: Apache-2.0
#include "app/files/checked_file.h"

#include <stdio.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>

#include "engine/base/error.h"

namespace docent::app {

namespace {

// Puts the first number between both parts of a new name that no file has. An empty file need not be kept.
void RenameToFree(const std::filesystem::path& path, const std::string& before, const std::string& after) {
  constexpr int kMost = 99;
  std::error_code error;
  if (const auto size = std::filesystem::file_size(path, error); error || size == 0) return;
  for (int i = 1; i <= kMost; ++i) {
    const std::filesystem::path kept = before + std::to_string(i) + after;
    if (std::filesystem::exists(kept, error) || error) continue;
    std::filesystem::rename(path, kept, error);
    return;
  }
}

}  // namespace

CheckedFile::CheckedFile(const std::filesystem::path& path) : path_(path), part_(path) {
  part_ += ".part";
  file_ = std::fopen(part_.c_str(), "wb");
  if (!file_) Fail(errno);
}

CheckedFile::~CheckedFile() {
  if (file_) std::fclose(file_);
}

void CheckedFile::Fail(int error) const {
  throw Error("Cannot write '" + path_.string() + "': " + std::generic_category().message(error) + ".");
}

void CheckedFile::Write(std::string_view text) {
  if (std::fwrite(text.data(), 1, text.size(), file_) != text.size()) Fail(errno);
}

void CheckedFile::Flush() {
  if (std::fflush(file_) != 0) Fail(errno);
}

void CheckedFile::Close(WaitForDisk wait) {
  Flush();
  // EINVAL: what cannot be waited for, such as a pipe.
  if (wait == WaitForDisk::kYes && fsync(fileno(file_)) != 0 && errno != EINVAL && errno != ENOTSUP)
    Fail(errno);
  std::FILE* file = file_;
  file_ = nullptr;
  if (std::fclose(file) != 0) Fail(errno);
  std::error_code error;
  std::filesystem::rename(part_, path_, error);
  if (error) Fail(error.value());
}

void KeepUnfinished(const std::filesystem::path& path) {
  const std::string part = path.string() + ".part";
  RenameToFree(part, part + ".", "");
}

void KeepEarlier(const std::filesystem::path& path) {
  std::filesystem::path stem = path;
  RenameToFree(path, stem.replace_extension().string() + "-", path.extension().string());
}

void MakeFolder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error || !std::filesystem::is_directory(folder)) {
    throw Error("Cannot create the folder '" + folder.string() +
                "': " + (error ? error.message() : std::string("a file with that name exists")) + ".");
  }
}

bool LiesWithin(const std::filesystem::path& path, const std::filesystem::path& place) {
  namespace fs = std::filesystem;
  std::error_code error;
  fs::path part = fs::weakly_canonical(fs::absolute(path, error), error);
  if (error) part = path.lexically_normal();
  for (; !part.empty(); part = part.parent_path()) {
    if (fs::equivalent(part, place, error)) return true;
    if (part == part.parent_path()) break;
  }
  return false;
}

}  // namespace docent::app
