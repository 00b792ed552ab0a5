// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <span>
#include <string>
#include <vector>

namespace docent::app {

// Decodes an image file to CV_8UC3 (BGR) or CV_8UC1. Throws Error, with `name` in its message, when the bytes
// are not an image, or are a truncated JPEG or PNG: decoders fill the missing part with grey, which would
// mislead the tracker.
//
// 16-bit images often hold 10, 12 or 14 bits, not shifted. `bits` has how many the images of a source use: 0
// before the first one; it grows to 8, 10, 12, 14 or 16 with the largest value so far. The upper 8 of these
// are kept. Null: the image is on its own.
cv::Mat DecodeImage(std::span<const std::uint8_t> bytes, const std::string& name, int* bits = nullptr);

// Reads and decodes an image file; `buffer` is reused between calls. Throws Error.
cv::Mat ReadImage(const std::filesystem::path& path, std::vector<std::uint8_t>* buffer, int* bits = nullptr);

}  // namespace docent::app
