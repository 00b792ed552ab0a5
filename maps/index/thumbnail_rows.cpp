// SPDX-License-Identifier: Apache-2.0
#include "maps/index/thumbnail_rows.h"

#include <string>
#include <utility>

#include "engine/base/error.h"
#include "maps/storage/envelope.h"
#include "maps/storage/rows.h"
#include "maps/storage/schema.h"

namespace docent::maps {

Bytes EncodeThumbnails(std::uint64_t map_key, std::span<const engine::KeyFrameThumbnail> thumbnails) {
  ByteWriter writer = BeginEnvelope(kThumbnailTableKind, map_key, thumbnails.size());
  for (const auto& [keyframe, thumbnail] : thumbnails) {
    writer.Put(std::uint32_t{keyframe});
    writer.Put(thumbnail.width);
    writer.Put(thumbnail.height);
    writer.PutBytes(
        {reinterpret_cast<const std::uint8_t*>(thumbnail.pixels.data()), thumbnail.pixels.size()});
  }
  return FinishEnvelope(std::move(writer));
}

std::vector<engine::KeyFrameThumbnail> DecodeThumbnails(std::uint64_t map_key,
                                                        std::span<const std::uint8_t> bytes) {
  auto [reader, count] = OpenEnvelope(kThumbnailTableKind, map_key, bytes);
  // The smallest images have more pixels than this; see the limits in map_codec.h.
  constexpr std::size_t kLeastPixels = 16, kSmallestRecord = 8 + kLeastPixels;
  if (count > reader.remaining() / kSmallestRecord)
    throw Error("the table of thumbnails is damaged: its length does not match");
  std::vector<engine::KeyFrameThumbnail> thumbnails(count);
  for (std::uint64_t i = 0; i < count; ++i) {
    auto& [keyframe, thumbnail] = thumbnails[i];
    keyframe = reader.Get<std::uint32_t>();
    thumbnail.width = reader.Get<std::uint16_t>();
    thumbnail.height = reader.Get<std::uint16_t>();
    const auto pixels = reader.GetBytes(std::size_t{thumbnail.width} * thumbnail.height);
    if (reader.failed() || pixels.size() < kLeastPixels || (i > 0 && thumbnails[i - 1].keyframe >= keyframe))
      throw Error("the table of thumbnails is damaged: a thumbnail is not valid");
    thumbnail.pixels.assign(pixels.begin(), pixels.end());
  }
  if (reader.remaining() != 0) throw Error("the table of thumbnails is damaged: its length does not match");
  return thumbnails;
}

std::vector<engine::KeyFrameThumbnail> MakeThumbnails(const engine::MapSnapshot& snapshot) {
  std::vector<engine::KeyFrameThumbnail> thumbnails;
  thumbnails.reserve(snapshot.keyframes.size());
  for (const engine::KeyFrame& keyframe : snapshot.keyframes) {
    engine::PackedThumbnail thumbnail = engine::Pack(keyframe.features->small_blurry);
    // The features may have been made without a thumbnail.
    if (thumbnail.width == 0)
      thumbnail = engine::Pack(engine::MakeSmallBlurryImage(keyframe.features->levels[0]));
    thumbnails.push_back({keyframe.id, std::move(thumbnail)});
  }
  return thumbnails;
}

void WriteThumbnails(const Database& database, std::uint64_t key,
                     std::span<const engine::KeyFrameThumbnail> thumbnails) {
  const Bytes bytes = EncodeThumbnails(key, thumbnails);
  database.Prepare("INSERT OR REPLACE INTO thumbnails (map_key, data) VALUES (?, ?)")
      .Bind(1, static_cast<std::int64_t>(key))
      .Bind(2, std::span<const std::uint8_t>(bytes))
      .Run();
}

std::vector<engine::KeyFrameThumbnail> ReadThumbnails(const Database& database, const MapInfo& info) {
  if (SchemaVersion(database) < kThumbnailsSince) return ThumbnailsFromImages(database, info);
  Statement query = database.Prepare("SELECT data FROM thumbnails WHERE map_key = ?");
  query.Bind(1, static_cast<std::int64_t>(info.key));
  if (!query.Step()) throw Error("its thumbnails are missing");
  std::vector<engine::KeyFrameThumbnail> thumbnails = DecodeThumbnails(info.key, query.Blob(0));
  if (thumbnails.size() != info.keyframes)
    throw Error("the number of its thumbnails differs from that of its keyframes");
  return thumbnails;
}

std::vector<engine::KeyFrameThumbnail> ThumbnailsFromImages(const Database& database, const MapInfo& info) {
  const MapParts parts = ReadParts(database, info);
  std::vector<engine::KeyFrameThumbnail> thumbnails(parts.keyframes.size());
  ReadImages(database, info.key, parts.keyframes,
             [&](std::size_t index, std::span<const std::uint8_t> bytes) {
               const cv::Mat gray = DecodeImage(info.key, parts.keyframes[index], bytes);
               thumbnails[index] = {parts.keyframes[index].keyframe.id,
                                    engine::Pack(engine::MakeSmallBlurryImage(gray))};
             });
  return thumbnails;
}

}  // namespace docent::maps
