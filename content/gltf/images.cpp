// SPDX-License-Identifier: Apache-2.0
#include "content/gltf/images.h"

#include <tiny_gltf.h>

#include <algorithm>
#include <array>

#include "content/gltf/json.h"

namespace docent::content {
namespace {

constexpr std::array<std::uint8_t, 8> kPngSignature = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};

int BigEndian(std::span<const std::uint8_t> bytes, std::size_t offset, int length) {
  std::uint32_t value = 0;
  for (int i = 0; i < length; ++i) value = value << 8 | bytes[offset + static_cast<std::size_t>(i)];
  return value > 0x7FFFFFFF ? 0 : static_cast<int>(value);
}

bool IsPng(std::span<const std::uint8_t> bytes) {
  return bytes.size() >= kPngSignature.size() &&
         std::equal(kPngSignature.begin(), kPngSignature.end(), bytes.begin());
}

bool IsJpeg(std::span<const std::uint8_t> bytes) {
  return bytes.size() >= 3 && bytes[0] == 0xFF && bytes[1] == 0xD8;
}

// Whether all chunks up to the last one, IEND, are there (ISO/IEC 15948, 5.3: a length, a type, the data and
// a checksum).
bool IsCompletePng(std::span<const std::uint8_t> bytes) {
  constexpr std::uint64_t kChunkBytes = 12;
  std::uint64_t offset = kPngSignature.size();
  while (offset + kChunkBytes <= bytes.size()) {
    const auto at = static_cast<std::size_t>(offset);
    const bool ends = std::equal(bytes.begin() + static_cast<std::ptrdiff_t>(at) + 4,
                                 bytes.begin() + static_cast<std::ptrdiff_t>(at) + 8, "IEND");
    offset += kChunkBytes + static_cast<std::uint64_t>(BigEndian(bytes, at, 4));
    if (ends) return offset <= bytes.size();
  }
  return false;
}

// Skips the segments before the first frame header (ITU-T T.81, B.1.1 and B.2.2).
std::optional<ImageSize> ReadJpegSize(std::span<const std::uint8_t> bytes) {
  std::size_t offset = 2;
  while (offset + 4 <= bytes.size()) {
    if (bytes[offset] != 0xFF) {
      ++offset;
      continue;
    }
    const std::uint8_t marker = bytes[offset + 1];
    if (marker == 0xFF || marker == 0x00 || marker == 0x01 || (marker >= 0xD0 && marker <= 0xD8)) {
      offset += marker == 0xFF ? 1 : 2;
      continue;
    }
    if (marker == 0xD9 || marker == 0xDA) return std::nullopt;
    // C0 to CF are frame headers, except for the tables DHT (C4), JPG (C8) and DAC (CC).
    const bool is_frame =
        marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
    if (is_frame) {
      if (offset + 9 > bytes.size()) return std::nullopt;
      return ImageSize{BigEndian(bytes, offset + 7, 2), BigEndian(bytes, offset + 5, 2)};
    }
    offset += 2 + static_cast<std::size_t>(BigEndian(bytes, offset + 2, 2));
  }
  return std::nullopt;
}

// stb returns 8 or, for some PNGs, 16 bits per channel; only the upper 8 are used.
Image ToImage(const tinygltf::Image& decoded) {
  Image image;
  image.width_px = decoded.width;
  image.height_px = decoded.height;
  const std::size_t values =
      static_cast<std::size_t>(decoded.width) * static_cast<std::size_t>(decoded.height) * 4;
  if (decoded.bits == 8) {
    image.rgba = decoded.image;
  } else {
    image.rgba.resize(values);
    for (std::size_t i = 0; i < values; ++i) image.rgba[i] = decoded.image[2 * i + 1];
  }
  return image;
}

}  // namespace

std::optional<ImageSize> ReadImageSize(std::span<const std::uint8_t> bytes) {
  if (IsPng(bytes)) {
    if (bytes.size() < 33) return std::nullopt;
    return ImageSize{BigEndian(bytes, 16, 4), BigEndian(bytes, 20, 4)};
  }
  return IsJpeg(bytes) ? ReadJpegSize(bytes) : std::nullopt;
}

std::optional<std::string> ImageFault(std::span<const std::uint8_t> bytes) {
  if (!IsPng(bytes) && !IsJpeg(bytes)) return "is neither a PNG nor a JPEG image";
  const std::optional<ImageSize> size = ReadImageSize(bytes);
  if (!size || size->width_px <= 0 || size->height_px <= 0) return "is a damaged image";
  if (IsPng(bytes) && !IsCompletePng(bytes)) return "is an image that is cut off";
  return std::nullopt;
}

std::optional<Image> DecodeImage(const std::string& file, const std::string& place,
                                 std::span<const std::uint8_t> bytes, const LoadLimits& limits,
                                 std::uint64_t* pixels_left) {
  const std::optional<ImageSize> size = ReadImageSize(bytes);
  if (!size || size->width_px <= 0 || size->height_px <= 0) return std::nullopt;
  const std::string words = std::to_string(size->width_px) + " x " + std::to_string(size->height_px);
  if (std::max(size->width_px, size->height_px) > limits.max_image_side_px) {
    Refuse(file, place,
           "is an image of " + words + " pixels; at most " + std::to_string(limits.max_image_side_px) +
               " a side can be read.");
  }
  const std::uint64_t pixels =
      static_cast<std::uint64_t>(size->width_px) * static_cast<std::uint64_t>(size->height_px);
  if (pixels > *pixels_left) {
    Refuse(file, place,
           "of " + words + " pixels takes the model's images over the limit of " +
               std::to_string(limits.max_image_pixels) + " pixels.");
  }
  *pixels_left -= pixels;
  tinygltf::Image decoded;
  std::string fault, warning;
  // Without options, stb is asked for four channels.
  const bool done = tinygltf::LoadImageData(&decoded, 0, &fault, &warning, size->width_px, size->height_px,
                                            bytes.data(), static_cast<int>(bytes.size()), nullptr);
  const std::size_t expected = pixels * 4 * (decoded.bits == 16 ? 2 : 1);
  if (!done || decoded.width != size->width_px || decoded.height != size->height_px ||
      decoded.component != 4 || decoded.image.size() != expected) {
    return std::nullopt;
  }
  return ToImage(decoded);
}

}  // namespace docent::content
