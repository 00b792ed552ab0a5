// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <system_error>

namespace docent::app {

// Tells a file from what it was before it was written anew. Of a file that cannot be read it is that of none.
struct FileStamp {
  std::filesystem::file_time_type time;
  std::uintmax_t size = 0;

  bool operator==(const FileStamp&) const = default;
};

inline FileStamp StampOf(const std::filesystem::path& file) {
  std::error_code error;
  FileStamp stamp;
  stamp.time = std::filesystem::last_write_time(file, error);
  if (error) return {};
  stamp.size = std::filesystem::file_size(file, error);
  return error ? FileStamp() : stamp;
}

}  // namespace docent::app
