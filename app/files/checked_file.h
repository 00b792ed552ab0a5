// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <filesystem>
#include <string_view>

namespace docent::app {

// Writes a file completely or not at all: the bytes go to NAME.part, which Close renames to NAME. Without
// Close (for example after an exception) NAME.part remains with what was written, and an older NAME is left
// unchanged. Every write is checked: a full disk is an Error that names the file. Not copyable; one thread.
class CheckedFile {
 public:
  // Whether Close waits until the bytes are on the disk, so that a power cut leaves the old file or the whole
  // new one. Not for thousands of files that can be made again.
  enum class WaitForDisk { kNo, kYes };

  explicit CheckedFile(const std::filesystem::path& path);
  ~CheckedFile();
  CheckedFile(const CheckedFile&) = delete;
  CheckedFile& operator=(const CheckedFile&) = delete;

  void Write(std::string_view text);
  // Makes everything written so far visible in NAME.part.
  void Flush();
  // Flushes and renames. Nothing may be written afterwards.
  void Close(WaitForDisk wait = WaitForDisk::kYes);

 private:
  [[noreturn]] void Fail(int error) const;

  std::filesystem::path path_, part_;
  std::FILE* file_ = nullptr;  // owned
};

// Renames what a run that crashed has left in NAME.part to NAME.part.1, or to the first number that is free,
// so that a CheckedFile of this name does not replace it. Beyond 99 such files, and if that fails, nothing
// happens.
void KeepUnfinished(const std::filesystem::path& path);

// Renames NAME.EXT to NAME-1.EXT, or to the first number that is free. Beyond 99 such files, and if that
// fails or there is no file, nothing happens.
void KeepEarlier(const std::filesystem::path& path);

// Creates the folder and any missing parents. Throws Error on failure.
void MakeFolder(const std::filesystem::path& folder);

// Whether `path`, which need not exist, is the file or folder `place` or lies below it, by whatever names and
// links. False if `place` does not exist.
bool LiesWithin(const std::filesystem::path& path, const std::filesystem::path& place);

}  // namespace docent::app
