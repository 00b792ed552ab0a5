// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <span>
#include <string>
#include <vector>

#include "engine/map/map_snapshot.h"
#include "maps/byte_stream.h"

// The binary columns of a library, between structs and bytes (maps/README.md has the layout). Every column is
// an envelope (magic, version, key of its map, count, records, checksum). Decoding believes nothing: sizes,
// counts, enums, ids and numbers are checked, and the first thing that is wrong throws docent::Error with a
// sentence that names it ("the table of points is cut off"). No thread or state is involved.
namespace docent::maps {

// What is read takes at most four times the room of what it is read from, so that a small file cannot ask for
// a large memory: the least sizes of things that vary in length see to that.
// Images that compress further are stored as they are.
inline constexpr std::int64_t kMaxPixelsAByte = 4;
inline constexpr std::size_t kMinAssetIdBytes = 4, kMaxAssetIdBytes = 128;
inline constexpr int kMinImageSidePx = 64;  // what engine::MakeFeatures needs
inline constexpr int kMaxImageSidePx = 16384;
inline constexpr std::int64_t kMaxImagePixels = std::int64_t{1} << 26;

// A keyframe without its image, which lies in a row of its own and is recognised by its hash.
struct StoredKeyFrame {
  engine::KeyFrame keyframe;  // features null
  std::uint64_t image_hash = 0;
};

// What a map is made of, without images.
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

// Hash of size and grey values of a CV_8UC1 image.
std::uint64_t ImageHash(const cv::Mat& gray);

// The distinct cameras of the keyframes, in order of first use. Equal cameras become one.
CameraTable MakeCameraTable(const std::vector<StoredKeyFrame>& keyframes);
// Keyframes without their images, but with the hashes of them.
std::vector<StoredKeyFrame> MakeStoredKeyFrames(const engine::MapSnapshot& snapshot);

Bytes EncodeCameras(std::uint64_t map_key, const CameraTable& cameras);
Bytes EncodeKeyFrames(std::uint64_t map_key, const std::vector<StoredKeyFrame>& keyframes,
                      const CameraTable& cameras);
Bytes EncodePoints(std::uint64_t map_key, const std::vector<engine::MapPoint>& points);
Bytes EncodeObservations(std::uint64_t map_key, const std::vector<engine::Observation>& observations);
Bytes EncodeScene(std::uint64_t map_key, const ScenePart& scene);
// gray: CV_8UC1. Lossless (PNG, quickest level).
Bytes EncodeImage(std::uint64_t map_key, engine::KeyFrameId keyframe, const cv::Mat& gray);

CameraTable DecodeCameras(std::uint64_t map_key, std::span<const std::uint8_t> bytes);
std::vector<StoredKeyFrame> DecodeKeyFrames(std::uint64_t map_key, std::span<const std::uint8_t> bytes,
                                            const CameraTable& cameras);
std::vector<engine::MapPoint> DecodePoints(std::uint64_t map_key, std::span<const std::uint8_t> bytes);
std::vector<engine::Observation> DecodeObservations(std::uint64_t map_key,
                                                    std::span<const std::uint8_t> bytes);
ScenePart DecodeScene(std::uint64_t map_key, std::span<const std::uint8_t> bytes);
// The image must be of the keyframe's camera's size and have the keyframe's hash.
cv::Mat DecodeImage(std::uint64_t map_key, const StoredKeyFrame& keyframe,
                    std::span<const std::uint8_t> bytes);

// Whether two maps are the same field by field. Rotations to 1e-12: reading one normalizes it, which may move
// its last bit, and a map that is read and saved again has not changed.
bool SameStructure(const MapParts& a, const MapParts& b);

}  // namespace docent::maps
