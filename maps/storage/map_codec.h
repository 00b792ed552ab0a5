// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <span>
#include <string>
#include <vector>

#include "engine/map/map_snapshot.h"
#include "maps/storage/byte_stream.h"

// Encodes and decodes the binary columns of a library (maps/README.md has the layout). Every column is an
// envelope (magic, version, key of its map, count, records, checksum). The decoders trust nothing: they check
// sizes, counts, enums, ids and numbers, and the first error throws docent::Error with a message that names
// it ("the table of points is cut off"). All functions are pure and thread-safe.
namespace docent::maps {

// Decoded data takes at most four times the memory of its encoded form, so that a small file cannot request a
// lot of memory. The minimum sizes of records of variable length ensure this; images that compress further
// are stored uncompressed.
inline constexpr std::int64_t kMaxPixelsPerByte = 4;
inline constexpr std::size_t kMinAssetIdBytes = 4, kMaxAssetIdBytes = 128;
inline constexpr int kMinImageSidePx = 64;  // Required by engine::MakeFeatures.
inline constexpr int kMaxImageSidePx = 16384;
inline constexpr std::int64_t kMaxImagePixels = std::int64_t{1} << 26;

// A keyframe without its image, which is stored in a row of its own and identified by its hash.
struct StoredKeyFrame {
  engine::KeyFrame keyframe;  // Its features are null.
  std::uint64_t image_hash = 0;
};

// The contents of a map without images.
struct MapParts {
  std::vector<StoredKeyFrame> keyframes;
  std::vector<engine::MapPoint> points;
  std::vector<engine::Observation> observations;
  std::vector<engine::PanoramaMap> panoramas;
  engine::PanoramaId next_panorama = 0;
};

// The text of a scene and the ids of its assets.
struct ScenePart {
  std::string text;
  std::vector<std::string> asset_ids;

  bool operator==(const ScenePart& other) const = default;
};

using CameraTable = std::vector<std::shared_ptr<const engine::CameraModel>>;

// A hash of the size and grey values of a CV_8UC1 image.
std::uint64_t ImageHash(const cv::Mat& gray);

// The distinct cameras of the keyframes, in order of first use. Equal cameras share an entry.
CameraTable MakeCameraTable(const std::vector<StoredKeyFrame>& keyframes);
// The keyframes without their images but with the images' hashes.
std::vector<StoredKeyFrame> MakeStoredKeyFrames(const engine::MapSnapshot& snapshot);

Bytes EncodeCameras(std::uint64_t map_key, const CameraTable& cameras);
Bytes EncodeKeyFrames(std::uint64_t map_key, const std::vector<StoredKeyFrame>& keyframes,
                      const CameraTable& cameras);
Bytes EncodePoints(std::uint64_t map_key, const std::vector<engine::MapPoint>& points);
Bytes EncodeObservations(std::uint64_t map_key, const std::vector<engine::Observation>& observations);
Bytes EncodeScene(std::uint64_t map_key, const ScenePart& scene);
// Encodes a CV_8UC1 image losslessly (PNG, fastest level).
Bytes EncodeImage(std::uint64_t map_key, engine::KeyFrameId keyframe, const cv::Mat& gray);

CameraTable DecodeCameras(std::uint64_t map_key, std::span<const std::uint8_t> bytes);
std::vector<StoredKeyFrame> DecodeKeyFrames(std::uint64_t map_key, std::span<const std::uint8_t> bytes,
                                            const CameraTable& cameras);
std::vector<engine::MapPoint> DecodePoints(std::uint64_t map_key, std::span<const std::uint8_t> bytes);
std::vector<engine::Observation> DecodeObservations(std::uint64_t map_key,
                                                    std::span<const std::uint8_t> bytes);
ScenePart DecodeScene(std::uint64_t map_key, std::span<const std::uint8_t> bytes);
// The image must have the size of the keyframe's camera and the keyframe's hash.
cv::Mat DecodeImage(std::uint64_t map_key, const StoredKeyFrame& keyframe,
                    std::span<const std::uint8_t> bytes);

// Whether two maps are equal field by field. Rotations are compared to 1e-12, because reading one normalizes
// it, which may change its last bit, and a map that is read and saved again must count as unchanged.
bool SameStructure(const MapParts& a, const MapParts& b);

}  // namespace docent::maps
