// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <opencv2/core/mat.hpp>

#include "engine/map/map_snapshot.h"
#include "maps/database.h"
#include "maps/map_codec.h"
#include "maps/map_record.h"

namespace docent::maps {

// Features that have the sizes of all pyramid levels and nothing more: enough to check a map's numbers.
std::shared_ptr<const engine::ImageFeatures> MakeSizesOnly(const cv::Mat& gray);

// Reads a map and its images inside the caller's transaction, builds the features of its keyframes on up to
// `threads` threads and checks the whole (engine::Validate). Throws docent::Error; see WithPlace.
std::shared_ptr<const engine::MapSnapshot> ReadSnapshot(
    const Database& database, const MapInfo& info,
    const std::function<std::shared_ptr<const engine::ImageFeatures>(const cv::Mat&)>& make_features,
    int threads);

}  // namespace docent::maps
