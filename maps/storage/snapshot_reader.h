// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <opencv2/core/mat.hpp>

#include "engine/map/map_snapshot.h"
#include "maps/storage/database.h"
#include "maps/storage/map_codec.h"
#include "maps/storage/map_record.h"

namespace docent::maps {

// Makes features with images of the right sizes only, which suffices to validate a map.
std::shared_ptr<const engine::ImageFeatures> MakeSizesOnly(const cv::Mat& gray);

// Reads a map and its images inside the caller's transaction, computes the features of its keyframes on up to
// `threads` threads and validates the map (engine::Validate). Throws docent::Error; see WithMapContext.
std::shared_ptr<const engine::MapSnapshot> ReadSnapshot(
    const Database& database, const MapInfo& info,
    const std::function<std::shared_ptr<const engine::ImageFeatures>(const cv::Mat&)>& make_features,
    int threads);

}  // namespace docent::maps
