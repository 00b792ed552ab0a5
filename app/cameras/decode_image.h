// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <span>
#include <string>
#include <vector>

namespace docent::app {

// Decodes an image file's bytes to CV_8UC3 (BGR) or CV_8UC1. `name` stands in the sentence of the Error that
// is thrown when the bytes are no image, or a JPEG or PNG that breaks off: decoders fill the rest of such an
// image with grey, and a tracker must not see that.
cv::Mat DecodeImage(std::span<const std::uint8_t> bytes, const std::string& name);

// Reads and decodes; `buffer` is used again from image to image.
cv::Mat ReadImage(const std::filesystem::path& path, std::vector<std::uint8_t>* buffer);

}  // namespace docent::app
