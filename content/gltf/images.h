// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "content/load_limits.h"
#include "content/model.h"

// Decodes the images of a model: PNG and JPEG (the only formats of core glTF), with tinygltf's stb_image. The
// size in an image's header is checked against the limits before it is decoded, and the data of a PNG against
// that size.
namespace docent::content {

struct ImageSize {
  int width_px = 0, height_px = 0;
};

// Returns the size in a PNG's IHDR or a JPEG's first frame header; empty for other formats and truncated
// headers.
std::optional<ImageSize> ReadImageSize(std::span<const std::uint8_t> bytes);

// What is wrong with an encoded image, for example "is a damaged image"; empty if its header, and the chunks
// of a PNG, are complete. Decodes nothing.
std::optional<std::string> ImageFault(std::span<const std::uint8_t> bytes);

// Decodes one image; empty if it is damaged, or if the data of a PNG inflate to far more bytes than its
// header says. `place` is used in messages. `pixels_left` is the remaining budget of the model, which is
// reduced. Throws Error when the image is too large.
std::optional<Image> DecodeImage(const std::string& file, const std::string& place,
                                 std::span<const std::uint8_t> bytes, const LoadLimits& limits,
                                 std::uint64_t* pixels_left);

}  // namespace docent::content
