// SPDX-License-Identifier: Apache-2.0
#include "maps/storage/panorama_codec.h"

#include <algorithm>
#include <utility>

#include "engine/base/error.h"
#include "maps/storage/envelope.h"

namespace docent::maps {

namespace {

// The kind of a record's keyframe or point.
enum class Member : std::uint8_t { kKeyFrame, kInfinitePoint, kPointThatWasInfinite };

void PutMember(Member kind, std::uint32_t id, std::uint32_t panorama, ByteWriter* writer) {
  writer->Put(static_cast<std::uint8_t>(kind));
  writer->Put(id);
  writer->Put(panorama);
}

engine::KeyFrame* FindKeyFrame(MapParts* parts, std::uint32_t id) {
  const auto found = std::lower_bound(
      parts->keyframes.begin(), parts->keyframes.end(), id,
      [](const StoredKeyFrame& stored, std::uint32_t wanted) { return stored.keyframe.id < wanted; });
  return found != parts->keyframes.end() && found->keyframe.id == id ? &found->keyframe : nullptr;
}

engine::MapPoint* FindPoint(MapParts* parts, std::uint32_t id) {
  const auto found =
      std::lower_bound(parts->points.begin(), parts->points.end(), id,
                       [](const engine::MapPoint& point, std::uint32_t wanted) { return point.id < wanted; });
  return found != parts->points.end() && found->id == id ? &*found : nullptr;
}

// Returns false when there is no such keyframe or point.
bool ApplyMember(std::uint8_t kind, std::uint32_t id, std::uint32_t panorama, MapParts* parts) {
  if (kind == static_cast<std::uint8_t>(Member::kKeyFrame)) {
    if (engine::KeyFrame* const keyframe = FindKeyFrame(parts, id)) {
      keyframe->panorama = panorama;
      return true;
    }
  } else if (kind <= static_cast<std::uint8_t>(Member::kPointThatWasInfinite)) {
    if (engine::MapPoint* const point = FindPoint(parts, id)) {
      point->panorama = panorama;
      point->was_infinite = kind == static_cast<std::uint8_t>(Member::kPointThatWasInfinite);
      return true;
    }
  }
  return false;
}

}  // namespace

Bytes EncodePanoramas(std::uint64_t map_key, const MapParts& parts) {
  ByteWriter writer = BeginEnvelope(kPanoramaTableKind, map_key, parts.panoramas.size());
  writer.Put(std::uint32_t{parts.next_panorama});
  for (const engine::PanoramaMap& panorama : parts.panoramas) {
    writer.Put(std::uint32_t{panorama.id});
    writer.Put(std::uint32_t{panorama.reference});
  }
  for (const StoredKeyFrame& stored : parts.keyframes) {
    if (stored.keyframe.panorama != engine::kNoId)
      PutMember(Member::kKeyFrame, stored.keyframe.id, stored.keyframe.panorama, &writer);
  }
  for (const engine::MapPoint& point : parts.points) {
    if (point.was_infinite) {
      PutMember(Member::kPointThatWasInfinite, point.id, point.panorama, &writer);
    } else if (point.panorama != engine::kNoId) {
      PutMember(Member::kInfinitePoint, point.id, point.panorama, &writer);
    }
  }
  return FinishEnvelope(std::move(writer));
}

void DecodePanoramas(std::uint64_t map_key, std::span<const std::uint8_t> bytes, MapParts* parts,
                     MissingMember missing) {
  auto [reader, count] = OpenEnvelope(kPanoramaTableKind, map_key, bytes);
  parts->next_panorama = reader.Get<std::uint32_t>();
  constexpr std::size_t kPanoramaBytes = 8, kMemberBytes = 9;
  if (reader.failed() || count > reader.remaining() / kPanoramaBytes ||
      (reader.remaining() - count * kPanoramaBytes) % kMemberBytes != 0) {
    throw Error("the table of panorama maps is damaged: its length does not match");
  }
  parts->panoramas.resize(count);
  for (engine::PanoramaMap& panorama : parts->panoramas) {
    panorama.id = reader.Get<std::uint32_t>();
    panorama.reference = reader.Get<std::uint32_t>();
  }
  while (reader.remaining() > 0) {
    const auto kind = reader.Get<std::uint8_t>();
    const auto id = reader.Get<std::uint32_t>(), panorama = reader.Get<std::uint32_t>();
    if (!ApplyMember(kind, id, panorama, parts) && missing == MissingMember::kRefuse)
      throw Error("the table of panorama maps is damaged: it refers to something that does not exist");
  }
}

}  // namespace docent::maps
