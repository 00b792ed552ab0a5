// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstdint>
#include <opencv2/imgcodecs.hpp>
#include <span>
#include <string>
#include <utility>

#include "engine/base/error.h"
#include "maps/storage/checksum.h"
#include "maps/storage/envelope.h"
#include "maps/storage/map_codec.h"

namespace docent::maps {

namespace {

constexpr int kPngLevel = 1;  // Higher levels take several times as long and save only a few percent.

std::uint32_t BigEndian32(std::span<const std::uint8_t> bytes) {
  return std::uint32_t{bytes[0]} << 24 | std::uint32_t{bytes[1]} << 16 | std::uint32_t{bytes[2]} << 8 |
         bytes[3];
}

// Checks the PNG header before a decoder allocates the memory that it asks for (PNG specification, sections
// 5.2 and 11.2.2): the image must be 8-bit grey and have the size of its camera.
bool IsGrayPngOfSize(std::span<const std::uint8_t> png, int width_px, int height_px) {
  constexpr std::array<std::uint8_t, 16> kHead = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n',
                                                  0,    0,   0,   13,  'I',  'H',  'D',  'R'};
  constexpr std::size_t kHeadBytes = 33;
  return png.size() >= kHeadBytes && std::equal(kHead.begin(), kHead.end(), png.begin()) &&
         BigEndian32(png.subspan(16)) == static_cast<std::uint32_t>(width_px) &&
         BigEndian32(png.subspan(20)) == static_cast<std::uint32_t>(height_px) && png[24] == 8 &&
         png[25] == 0;
}

}  // namespace

std::uint64_t ImageHash(const cv::Mat& gray) {
  std::uint64_t hash = static_cast<std::uint64_t>(gray.cols) << 32 |
                       static_cast<std::uint64_t>(static_cast<std::uint32_t>(gray.rows));
  // Row by row, because the rows of a sub-image are not contiguous in memory.
  for (int row = 0; row < gray.rows; ++row)
    hash = Checksum({gray.ptr(row), static_cast<std::size_t>(gray.cols)}, hash);
  return hash;
}

Bytes EncodeImage(std::uint64_t map_key, engine::KeyFrameId keyframe, const cv::Mat& gray) {
  Bytes png;
  const auto pixels = static_cast<std::int64_t>(gray.total());
  try {
    for (const int level : {kPngLevel, 0}) {
      if (!cv::imencode(".png", gray, png, {cv::IMWRITE_PNG_COMPRESSION, level}))
        throw Error("the image of keyframe " + std::to_string(keyframe) + " cannot be compressed");
      // ReadCameras limits the ratio of pixels to bytes, and a uniform image would exceed it.
      if (pixels <= kMaxPixelsPerByte * static_cast<std::int64_t>(png.size())) break;
    }
  } catch (const cv::Exception& error) {
    throw Error("the image of keyframe " + std::to_string(keyframe) + " cannot be compressed: " + error.err);
  }
  ByteWriter writer = BeginEnvelope(kImageKind, map_key, 1);
  writer.Put(std::uint32_t{keyframe});
  writer.PutBytes(png);
  return FinishEnvelope(std::move(writer));
}

cv::Mat DecodeImage(std::uint64_t map_key, const StoredKeyFrame& stored,
                    std::span<const std::uint8_t> bytes) {
  auto [reader, count] = OpenEnvelope(kImageKind, map_key, bytes);
  const engine::KeyFrame& keyframe = stored.keyframe;
  const std::string name = "the image of keyframe " + std::to_string(keyframe.id);
  if (count != 1 || reader.Get<std::uint32_t>() != keyframe.id)
    throw Error(name + " belongs to another keyframe");
  const std::span<const std::uint8_t> png = reader.GetBytes(reader.remaining());
  if (!IsGrayPngOfSize(png, keyframe.camera->width_px(), keyframe.camera->height_px())) {
    throw Error(name + " is not a grey image of its camera's size");
  }
  cv::Mat gray;
  try {
    // The cv::Mat is only read; OpenCV has no const view.
    const cv::Mat source(1, static_cast<int>(png.size()), CV_8UC1, const_cast<std::uint8_t*>(png.data()));
    gray = cv::imdecode(source, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception& error) {
    throw Error(name + " cannot be decompressed: " + error.err);
  }
  if (gray.type() != CV_8UC1 || gray.cols != keyframe.camera->width_px() ||
      gray.rows != keyframe.camera->height_px() || ImageHash(gray) != stored.image_hash) {
    throw Error(name + " is not the one that was saved");
  }
  return gray;
}

}  // namespace docent::maps
