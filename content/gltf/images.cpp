// SPDX-License-Identifier: Apache-2.0
#include "content/gltf/images.h"

#include <tiny_gltf.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <memory>
#include <new>
#include <string_view>
#include <vector>

#include "content/gltf/json.h"

namespace docent::content {
namespace {

constexpr std::array<std::uint8_t, 8> kPngSignature = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};

std::uint32_t BigEndian(std::span<const std::uint8_t> bytes, std::size_t offset, int length) {
  std::uint32_t value = 0;
  for (int i = 0; i < length; ++i) value = value << 8 | bytes[offset + static_cast<std::size_t>(i)];
  return value;
}

// The side of an image in pixels; 0 if it cannot be one.
int SideOf(std::uint32_t value) {
  return value > 0x7FFFFFFF ? 0 : static_cast<int>(value);
}

bool IsPng(std::span<const std::uint8_t> bytes) {
  return bytes.size() >= kPngSignature.size() &&
         std::equal(kPngSignature.begin(), kPngSignature.end(), bytes.begin());
}

bool IsJpeg(std::span<const std::uint8_t> bytes) {
  return bytes.size() >= 3 && bytes[0] == 0xFF && bytes[1] == 0xD8;
}

struct PngChunk {
  std::string_view type;
  std::span<const std::uint8_t> data;
};

// Returns the chunk at *offset, and moves that to the next one (ISO/IEC 15948, 5.3: a length, a type, the
// data and a checksum). Empty at the end, and where the chunk is cut off.
std::optional<PngChunk> NextChunk(std::span<const std::uint8_t> bytes, std::size_t* offset) {
  constexpr std::size_t kBeforeData = 8, kChecksum = 4;
  const std::span<const std::uint8_t> rest = bytes.subspan(*offset);
  if (rest.size() < kBeforeData + kChecksum) return std::nullopt;
  const std::size_t length = BigEndian(rest, 0, 4);
  if (length > rest.size() - kBeforeData - kChecksum) return std::nullopt;
  *offset += kBeforeData + length + kChecksum;
  return PngChunk{{reinterpret_cast<const char*>(rest.data()) + 4, 4}, rest.subspan(kBeforeData, length)};
}

// Whether all chunks up to the last one, IEND, are there.
bool IsCompletePng(std::span<const std::uint8_t> bytes) {
  std::size_t offset = kPngSignature.size();
  while (const auto chunk = NextChunk(bytes, &offset)) {
    if (chunk->type == "IEND") return true;
  }
  return false;
}

// How many bytes the data of a PNG with this header may inflate to: twice as many as its rows have, and a few
// more, because an interlaced image has more rows, and some programs write zeros behind the last one. 0 if
// the header is not valid.
std::uint64_t MostPngData(std::span<const std::uint8_t> header) {
  constexpr std::size_t kHeaderBytes = 13;
  constexpr std::uint64_t kMaxDepth = 16, kFewBytes = 65'536;
  constexpr std::array<std::uint64_t, 7> kChannels = {1, 0, 3, 1, 2, 0, 4};  // By the type of colour.
  if (header.size() != kHeaderBytes) return 0;
  const std::uint64_t width = BigEndian(header, 0, 4), height = BigEndian(header, 4, 4);
  const std::uint64_t depth = header[8], type = header[9];
  if (depth > kMaxDepth || type >= kChannels.size()) return 0;
  const std::uint64_t row = 1 + (width * kChannels[type] * depth + 7) / 8;  // With the number of its filter.
  return 2 * height * row + kFewBytes;
}

// Inflates the data of a PNG piece by piece.
class PngInflater {
 public:
  PngInflater() {
    if (inflateInit(&stream_) != Z_OK) throw std::bad_alloc();
    inflateValidate(&stream_, 0);  // stb does not look at the checksum either.
  }
  ~PngInflater() { inflateEnd(&stream_); }
  PngInflater(const PngInflater&) = delete;
  PngInflater& operator=(const PngInflater&) = delete;

  // Goes on with the data of the next chunk. Returns false if they are damaged or inflate to more bytes than
  // `most`, counted from the first chunk. What follows the end of the data does not matter.
  bool Add(std::span<const std::uint8_t> data, std::uint64_t most) {
    stream_.next_in = const_cast<Bytef*>(data.data());
    stream_.avail_in = static_cast<uInt>(data.size());
    do {
      if (has_ended_) return true;
      stream_.next_out = buffer_.data();
      stream_.avail_out = static_cast<uInt>(buffer_.size());
      const int result = inflate(&stream_, Z_NO_FLUSH);
      has_ended_ = result == Z_STREAM_END;
      // Z_BUF_ERROR: nothing is left to be done with this chunk.
      if (result != Z_OK && result != Z_STREAM_END && result != Z_BUF_ERROR) return false;
      if (stream_.total_out > most) return false;
    } while (stream_.avail_in > 0 || stream_.avail_out == 0);
    return true;
  }

 private:
  z_stream stream_{};
  std::vector<Bytef> buffer_ = std::vector<Bytef>(65'536);
  bool has_ended_ = false;
};

// Whether the data of a PNG fit its header. stb inflates them to the end, whatever the header says, so that a
// small file could take gigabytes.
bool HasPlausibleData(std::span<const std::uint8_t> bytes) {
  std::size_t offset = kPngSignature.size();
  const auto header = NextChunk(bytes, &offset);
  if (!header || header->type != "IHDR") return false;
  const std::uint64_t most = MostPngData(header->data);
  PngInflater inflater;
  while (const auto chunk = NextChunk(bytes, &offset)) {
    if (chunk->type == "IEND") return true;
    // A variant of the format, whose data stb reads in another way.
    if (chunk->type == "CgBI") return false;
    if (chunk->type == "IDAT" && !inflater.Add(chunk->data, most)) return false;
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
      return ImageSize{SideOf(BigEndian(bytes, offset + 7, 2)), SideOf(BigEndian(bytes, offset + 5, 2))};
    }
    offset += 2 + std::size_t{BigEndian(bytes, offset + 2, 2)};
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
    return ImageSize{SideOf(BigEndian(bytes, 16, 4)), SideOf(BigEndian(bytes, 20, 4))};
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
  if (IsPng(bytes) && !HasPlausibleData(bytes)) return std::nullopt;
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
