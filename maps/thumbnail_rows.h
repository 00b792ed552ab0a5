// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "maps/database.h"
#include "maps/map_codec.h"
#include "maps/map_record.h"
#include "maps/thumbnail_array.h"

// The table `thumbnails`: what a place index needs of a map, in one row, so that opening a large library
// reads this and leaves images and points where they are. Inside a transaction that the caller holds; what
// is read is checked; throws docent::Error.
namespace docent::maps {

Bytes EncodeThumbnails(std::uint64_t map_key, std::span<const KeyFrameThumbnail> thumbnails);
std::vector<KeyFrameThumbnail> DecodeThumbnails(std::uint64_t map_key, std::span<const std::uint8_t> bytes);

// Of every keyframe, in their order.
std::vector<KeyFrameThumbnail> MakeThumbnails(const engine::MapSnapshot& snapshot);

void WriteThumbnails(const Database& database, std::uint64_t key,
                     std::span<const KeyFrameThumbnail> thumbnails);
// One for each keyframe that `info` counts. From a library of format 1, which has no such table, they are
// made from the images.
std::vector<KeyFrameThumbnail> ReadThumbnails(const Database& database, const MapInfo& info);
// From the images of a map, whatever the table says.
std::vector<KeyFrameThumbnail> ThumbnailsFromImages(const Database& database, const MapInfo& info);

}  // namespace docent::maps
