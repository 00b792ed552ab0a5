// SPDX-License-Identifier: Apache-2.0
// Parses any bytes as a calibration file: the result must be a camera or a docent::Error.
#include <cstddef>
#include <cstdint>
#include <string>

#include "app/calibration/calibration_file.h"
#include "engine/base/error.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const auto camera =
        docent::app::ParseCalibration(std::string(reinterpret_cast<const char*>(data), size), "fuzz");
    // An accepted camera must be unchanged after writing and reading it again.
    if (!(docent::app::ParseCalibration(docent::app::FormatCalibration(camera), "again") == camera))
      __builtin_trap();
  } catch (const docent::Error&) {
  }
  return 0;
}
