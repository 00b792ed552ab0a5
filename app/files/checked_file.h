// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <filesystem>
#include <string_view>

namespace docent::app {

// Writes one file whole or not at all: the bytes go to NAME.part, which Close renames to NAME. Without Close
// (an exception on the way) NAME.part stays behind with what was written, and a NAME of earlier stays as it
// was. Every write is checked: a full disk is an Error that names the file. Not copyable; one thread.
class CheckedFile {
 public:
  explicit CheckedFile(const std::filesystem::path& path);
  ~CheckedFile();
  CheckedFile(const CheckedFile&) = delete;
  CheckedFile& operator=(const CheckedFile&) = delete;

  void Write(std::string_view text);
  // Makes what was written so far visible in NAME.part.
  void Flush();
  // Flushes and renames. Nothing may be written afterwards.
  void Close();

 private:
  [[noreturn]] void Fail(int error) const;

  std::filesystem::path path_, part_;
  std::FILE* file_ = nullptr;  // owned
};

// Creates the folder and its parents where missing. Throws Error when it cannot.
void MakeFolder(const std::filesystem::path& folder);

}  // namespace docent::app
