// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "engine/recognition/thumbnail_array.h"
#include "maps/storage/database.h"
#include "maps/storage/map_codec.h"
#include "maps/storage/map_record.h"

// The table `thumbnails`: one row per map with the thumbnails that the place index needs, so that a large
// library can be opened without reading images and points. The functions run inside a transaction of the
// caller, validate what they read, and throw docent::Error.
namespace docent::maps {

Bytes EncodeThumbnails(std::uint64_t map_key, std::span<const engine::KeyFrameThumbnail> thumbnails);
std::vector<engine::KeyFrameThumbnail> DecodeThumbnails(std::uint64_t map_key,
                                                        std::span<const std::uint8_t> bytes);

// Computes the thumbnail of every keyframe, in their order.
std::vector<engine::KeyFrameThumbnail> MakeThumbnails(const engine::MapSnapshot& snapshot);

void WriteThumbnails(const Database& database, std::uint64_t key,
                     std::span<const engine::KeyFrameThumbnail> thumbnails);
// Returns one thumbnail for each keyframe that `info` counts. For a library of format 1, which has no such
// table, they are computed from the images.
std::vector<engine::KeyFrameThumbnail> ReadThumbnails(const Database& database, const MapInfo& info);
// Computes the thumbnails from the images of a map, regardless of the table.
std::vector<engine::KeyFrameThumbnail> ThumbnailsFromImages(const Database& database, const MapInfo& info);

}  // namespace docent::maps
