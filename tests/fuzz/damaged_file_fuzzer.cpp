// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "engine/base/error.h"
#include "maps/storage/damaged_file.h"

// Feeds a whole file to the search for a library's rows, which trusts nothing in it. Every row that is found
// must be readable without reading outside of the file, and a row that is whole must read the same again.
namespace {

namespace fs = std::filesystem;

const fs::path& InputPath() {
  // Never destroyed, because the exit handler needs it.
  static const fs::path& path = *new fs::path([] {
    std::error_code error;
    const fs::path base =
        fs::is_directory("/dev/shm", error) ? fs::path("/dev/shm") : fs::temp_directory_path();
    std::atexit([] { fs::remove(InputPath()); });
    return base / ("docent-fuzz-damaged-" + std::to_string(getpid()));
  }());
  return path;
}

bool Same(const docent::maps::SalvagedRow& a, const docent::maps::SalvagedRow& b) {
  if (a.values.size() != b.values.size()) return false;
  for (std::size_t i = 0; i < a.values.size(); ++i) {
    if (a.values[i].type != b.values[i].type || a.values[i].integer != b.values[i].integer ||
        a.values[i].bytes != b.values[i].bytes)
      return false;
  }
  return true;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace docent::maps;
  std::ofstream(InputPath(), std::ios::binary)
      .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  const DamagedFile file(InputPath());
  for (std::size_t table = 0; table < kSalvagedTables; ++table) {
    for (const RowPlace& place : file.rows(static_cast<SalvagedTable>(table))) {
      const auto row = file.Read(place);
      if (!row) continue;
      const auto again = file.Read(place);
      if (!again || !Same(*row, *again)) std::abort();
      for (const SalvagedValue& value : row->values) {
        if (value.bytes.size() > size) std::abort();
      }
    }
  }
  return 0;
}
