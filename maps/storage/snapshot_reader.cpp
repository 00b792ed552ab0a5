// SPDX-License-Identifier: Apache-2.0
#include "maps/storage/snapshot_reader.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/bounded_queue.h"
#include "engine/base/error.h"
#include "engine/base/worker.h"
#include "maps/storage/rows.h"

namespace docent::maps {

namespace {

struct ImageJob {
  std::size_t keyframe = 0;  // Index of the keyframe.
  Bytes bytes;
};

// Compressed images pass through a short queue, so that only a few are in memory in addition to the decoded
// ones.
void ReadFeatures(
    const Database& database, std::uint64_t key, const std::vector<StoredKeyFrame>& stored,
    const std::function<std::shared_ptr<const engine::ImageFeatures>(const cv::Mat&)>& make_features,
    int threads, engine::MapSnapshot* snapshot) {
  BoundedQueue<ImageJob> jobs(static_cast<std::size_t>(threads) * 2);
  std::vector<std::unique_ptr<Worker>> workers;
  for (int i = 0; i < threads; ++i) {
    workers.push_back(std::make_unique<Worker>("map-loader", [&](std::stop_token) {
      try {
        while (const auto job = jobs.Pop()) {
          const cv::Mat gray = DecodeImage(key, stored[job->keyframe], job->bytes);
          snapshot->keyframes[job->keyframe].features = make_features(gray);
        }
      } catch (...) {
        jobs.Close();  // Stops the reader.
        throw;
      }
    }));
  }
  try {
    ReadImages(database, key, stored, [&](std::size_t index, std::span<const std::uint8_t> bytes) {
      jobs.Push({index, Bytes(bytes.begin(), bytes.end())});
    });
  } catch (...) {
    jobs.Close();
    throw;
  }
  jobs.Close();
  for (const auto& worker : workers) worker->Join();
}

}  // namespace

std::shared_ptr<const engine::ImageFeatures> MakeSizesOnly(const cv::Mat& gray) {
  auto features = std::make_shared<engine::ImageFeatures>();
  features->levels[0] = gray;
  for (std::size_t level = 1; level < features->levels.size(); ++level) {
    const cv::Mat& finer = features->levels[level - 1];
    features->levels[level] = cv::Mat(finer.rows / 2, finer.cols / 2, CV_8UC1);
  }
  return features;
}

std::shared_ptr<const engine::MapSnapshot> ReadSnapshot(
    const Database& database, const MapInfo& info,
    const std::function<std::shared_ptr<const engine::ImageFeatures>(const cv::Mat&)>& make_features,
    int threads) {
  MapParts parts = ReadParts(database, info);
  auto snapshot = std::make_shared<engine::MapSnapshot>();
  snapshot->revision = info.revision;
  snapshot->next_keyframe = info.next_keyframe;
  snapshot->next_point = info.next_point;
  snapshot->points = std::move(parts.points);
  snapshot->observations = std::move(parts.observations);
  snapshot->panoramas = std::move(parts.panoramas);
  snapshot->next_panorama = parts.next_panorama;
  for (const StoredKeyFrame& stored : parts.keyframes) snapshot->keyframes.push_back(stored.keyframe);
  const int useful = std::clamp(static_cast<int>(parts.keyframes.size()), 1, std::max(1, threads));
  ReadFeatures(database, info.key, parts.keyframes, make_features, useful, snapshot.get());
  if (const std::string problem = engine::Validate(*snapshot); !problem.empty()) throw Error(problem);
  return snapshot;
}

}  // namespace docent::maps
