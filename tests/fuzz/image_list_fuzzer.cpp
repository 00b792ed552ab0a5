// SPDX-License-Identifier: Apache-2.0
// Reads any bytes as each of the lists of images and times that a recording may have: the result must be a
// docent::Error, or images whose times increase.
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "app/cameras/sequence_layout.h"
#include "app/files/text_file.h"
#include "engine/base/error.h"
#include "tests/fuzz/small_library.h"

namespace {

namespace fs = std::filesystem;

void CheckTimes(const std::vector<docent::Timestamp>& times) {
  if (times.empty()) __builtin_trap();
  for (std::size_t i = 1; i < times.size(); ++i) {
    if (times[i] - times[i - 1] <= docent::Timestamp{}) __builtin_trap();
  }
}

void CheckImages(const std::vector<docent::app::TimedPath>& images) {
  std::vector<docent::Timestamp> times;
  for (const docent::app::TimedPath& image : images) times.push_back(image.time);
  CheckTimes(times);
}

void CheckTimestamps(const fs::path& path) {
  std::vector<docent::Timestamp> times;
  for (const std::optional<docent::Timestamp>& time : docent::app::ReadTimestamps(path)) {
    if (time) times.push_back(*time);
  }
  CheckTimes(times);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const fs::path folder = docent::fuzz::TemporaryFolder();
  for (const char* const name : {"rgb.txt", "data.csv", "timestamps.txt"}) {
    const std::string_view kind = name;
    docent::app::WriteTextFile(folder / name, {reinterpret_cast<const char*>(data), size});
    try {
      if (kind == "rgb.txt") CheckImages(docent::app::ReadTumList(folder));
      if (kind == "data.csv") CheckImages(docent::app::ReadEurocList(folder));
      if (kind == "timestamps.txt") CheckTimestamps(folder / name);
    } catch (const docent::Error&) {
    }
  }
  return 0;
}
