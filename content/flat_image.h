// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "content/model.h"

// Images that are placed in a map as flat models. Pure functions; thread-safe.
namespace docent::content {

// Beyond it no screen shows more, and decoding would take more than 128 MiB.
inline constexpr std::uint64_t kMaxImageFileBytes = std::uint64_t{32} << 20;
inline constexpr int kMaxImageSidePx = 8192;
inline constexpr std::uint64_t kMaxImagePixels = std::uint64_t{32} << 20;

// Whether the bytes begin like a PNG or JPEG file.
bool IsImageFile(std::span<const std::uint8_t> bytes);

// A rectangle that shows the image in its own colours, whatever the light: in the model's xy plane, upright
// (y up) and seen from +z, around the origin, with a longer side of one metre. Its back is plain. The image
// has at least one pixel.
std::shared_ptr<Model> FlatModel(Image image);
// The same of a file. Throws Error, which names the file, when the bytes are no PNG or JPEG, damaged or too
// large.
std::shared_ptr<Model> FlatImageModel(const std::string& file, std::span<const std::uint8_t> bytes);

}  // namespace docent::content
