// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "content/load_limits.h"
#include "content/model.h"

// Decodes the images of a model: PNG and JPEG (all that core glTF allows), through tinygltf's stb_image.
// The image's size is read from its header and held against the limits before the decoder sees it.
namespace docent::content {

struct ImageSize {
  int width_px = 0, height_px = 0;
};

// Size that a PNG's IHDR or a JPEG's first frame header names; empty for anything else or a cut-off header.
std::optional<ImageSize> ReadImageSize(std::span<const std::uint8_t> bytes);

// Decodes one image. `place` is named in sentences. `pixels_left` is the budget of the whole model and is
// lessened. Throws Error when the image is not PNG or JPEG, too large or damaged.
Image DecodeImage(const std::string& file, const std::string& place, std::span<const std::uint8_t> bytes,
                  const LoadLimits& limits, std::uint64_t* pixels_left);

}  // namespace docent::content
