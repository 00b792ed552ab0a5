// SPDX-License-Identifier: Apache-2.0
#include "maps/place_index.h"

#include <algorithm>
#include <array>
#include <limits>
#include <opencv2/core/mat.hpp>
#include <span>
#include <unordered_map>
#include <utility>

namespace docent::maps {

namespace {

constexpr std::size_t kBlockThumbnails = 64;

// Zero-mean grey values of up to kBlockThumbnails thumbnails of one size, one after another. A block is
// filled from the front and shared by the states of the index that came before and after: entries below a
// reader's own count never change, and a writer adds behind them.
struct Block {
  explicit Block(std::size_t pixels) : values(pixels * kBlockThumbnails) {}
  std::vector<float> values;
  std::size_t used = 0;  // the writer's alone
};

// Where one keyframe's thumbnail lies.
struct Entry {
  engine::KeyFrameId keyframe = engine::kNoId;
  const void* source = nullptr;  // the features it was made from: another picture is another thumbnail
  int width = 0, height = 0;
  std::shared_ptr<const Block> block;
  const float* values = nullptr;
};

void CopyZeroMean(const cv::Mat& pixels, float* target) {
  double sum = 0;
  for (int y = 0; y < pixels.rows; ++y) {
    for (int x = 0; x < pixels.cols; ++x) sum += pixels.at<float>(y, x);
  }
  const auto mean = static_cast<float>(sum / static_cast<double>(pixels.total()));
  for (int y = 0; y < pixels.rows; ++y) {
    for (int x = 0; x < pixels.cols; ++x) *target++ = pixels.at<float>(y, x) - mean;
  }
}

bool IsUsable(const cv::Mat& pixels) {
  return pixels.type() == CV_32FC1 && !pixels.empty();
}

// Sum of squared differences, left off once it exceeds `limit`. Independent lanes let the compiler use whole
// vector registers without reordering a sum behind the standard's back.
float SquaredDifference(const float* a, const float* b, std::size_t count, float limit) {
  constexpr std::size_t kLanes = 16, kStride = 512;
  float total = 0;
  std::size_t i = 0;
  while (i + kLanes <= count) {
    std::array<float, kLanes> lanes{};
    const std::size_t end = std::min(count - count % kLanes, i + kStride);
    for (; i < end; i += kLanes) {
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        const float difference = a[i + lane] - b[i + lane];
        lanes[lane] += difference * difference;
      }
    }
    for (const float lane : lanes) total += lane;
    if (total > limit) return total;
  }
  for (; i < count; ++i) total += (a[i] - b[i]) * (a[i] - b[i]);
  return total;
}

struct Hit {
  float sum = 0;
  std::size_t entry = 0;
};

}  // namespace

struct PlaceIndex::Map {
  std::uint64_t key = 0;
  std::shared_ptr<const engine::MapSnapshot> snapshot;
  std::vector<Entry> entries;
  std::shared_ptr<Block> open_block;  // the last block, while it has room; used by writers only
  std::size_t open_pixels = 0;
};

struct PlaceIndex::State {
  std::vector<std::shared_ptr<const Map>> maps;  // by ascending key
};

PlaceIndex::PlaceIndex() : state_(std::make_shared<const State>()) {}
PlaceIndex::~PlaceIndex() = default;

std::shared_ptr<const PlaceIndex::State> PlaceIndex::Current() const {
  std::scoped_lock lock(state_mutex_);
  return state_;
}

void PlaceIndex::Replace(std::uint64_t key, std::shared_ptr<const Map> map) {
  auto next = std::make_shared<State>(*Current());
  auto place = std::lower_bound(next->maps.begin(), next->maps.end(), key,
                                [](const auto& known, std::uint64_t wanted) { return known->key < wanted; });
  if (place != next->maps.end() && (*place)->key == key) place = next->maps.erase(place);
  if (map) next->maps.insert(place, std::move(map));
  std::shared_ptr<const State> published = std::move(next);
  std::scoped_lock lock(state_mutex_);
  state_.swap(published);
}

void PlaceIndex::SetMap(std::uint64_t key, std::shared_ptr<const engine::MapSnapshot> snapshot) {
  if (!snapshot) return RemoveMap(key);
  std::scoped_lock writing(write_mutex_);
  const auto state = Current();
  const auto known =
      std::find_if(state->maps.begin(), state->maps.end(), [&](const auto& map) { return map->key == key; });
  std::unordered_map<engine::KeyFrameId, const Entry*> before;
  auto map = std::make_shared<Map>();
  if (known != state->maps.end()) {
    map->open_block = (*known)->open_block;
    map->open_pixels = (*known)->open_pixels;
    for (const Entry& entry : (*known)->entries) before.emplace(entry.keyframe, &entry);
  }
  map->key = key;
  map->snapshot = snapshot;
  map->entries.reserve(snapshot->keyframes.size());
  for (const engine::KeyFrame& keyframe : snapshot->keyframes) {
    const cv::Mat& pixels = keyframe.features->small_blurry.pixels;
    if (!IsUsable(pixels)) continue;
    const auto old = before.find(keyframe.id);
    if (old != before.end() && old->second->source == keyframe.features.get()) {
      map->entries.push_back(*old->second);
      continue;
    }
    if (!map->open_block || map->open_pixels != pixels.total() || map->open_block->used == kBlockThumbnails) {
      map->open_block = std::make_shared<Block>(pixels.total());
      map->open_pixels = pixels.total();
    }
    float* values = map->open_block->values.data() + pixels.total() * map->open_block->used++;
    CopyZeroMean(pixels, values);
    map->entries.push_back(
        {keyframe.id, keyframe.features.get(), pixels.cols, pixels.rows, map->open_block, values});
  }
  Replace(key, std::move(map));
}

void PlaceIndex::RemoveMap(std::uint64_t key) {
  std::scoped_lock writing(write_mutex_);
  Replace(key, nullptr);
}

std::size_t PlaceIndex::maps() const {
  return Current()->maps.size();
}

std::size_t PlaceIndex::keyframes() const {
  std::size_t count = 0;
  for (const auto& map : Current()->maps) count += map->entries.size();
  return count;
}

std::vector<engine::PlaceCandidate> PlaceIndex::FindPlaces(const engine::SmallBlurryImage& image, int count,
                                                           int per_map, std::uint64_t only_map) const {
  if (count <= 0 || per_map <= 0 || !IsUsable(image.pixels)) return {};
  const auto state = Current();
  const std::size_t pixels = image.pixels.total();
  std::vector<float> wanted(pixels);
  CopyZeroMean(image.pixels, wanted.data());
  std::vector<engine::PlaceCandidate> candidates;
  // A map gives no more than this, so a worse thumbnail than that many of its own need not be summed up.
  const auto keep = static_cast<std::size_t>(std::min(count, per_map));
  for (const auto& map : state->maps) {
    if (only_map != 0 && map->key != only_map) continue;
    std::vector<Hit> best;  // ascending, at most `keep`
    for (std::size_t i = 0; i < map->entries.size(); ++i) {
      const Entry& entry = map->entries[i];
      if (entry.width != image.pixels.cols || entry.height != image.pixels.rows) continue;
      const float limit = best.size() < keep ? std::numeric_limits<float>::infinity() : best.back().sum;
      const float sum = SquaredDifference(wanted.data(), entry.values, pixels, limit);
      if (!(sum < limit)) continue;
      if (best.size() == keep) best.pop_back();
      const auto place = std::upper_bound(best.begin(), best.end(), sum,
                                          [](float value, const Hit& hit) { return value < hit.sum; });
      best.insert(place, {sum, i});
    }
    for (const Hit& hit : best) {
      candidates.push_back({map->key, map->snapshot, map->entries[hit.entry].keyframe,
                            double{hit.sum} / static_cast<double>(pixels)});
    }
  }
  // Ties go to the smaller key, then the smaller keyframe: the same question has the same answer on every
  // run.
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const auto& a, const auto& b) { return a.difference < b.difference; });
  if (candidates.size() > static_cast<std::size_t>(count)) candidates.resize(static_cast<std::size_t>(count));
  return candidates;
}

}  // namespace docent::maps
