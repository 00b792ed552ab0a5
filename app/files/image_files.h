// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <filesystem>
#include <memory>

#include "app/files/working_set.h"
#include "engine/vision/image_store.h"

namespace docent::app {

// Keyframes' images on disk, mapped into memory. Each keyframe has a file of its own that has no name: it
// is mapped for reading and closed, and the system takes its blocks back when the last image in it is let
// go, however the program ends. A page of an image that rests is read from the file again when it is
// touched, mostly from what the system has cached and may reclaim at any time; so what rests counts for
// nothing, and nobody who reads can tell. Of those that are looked at so many bytes are awake at a time.
// Where no file can be written (no folder, no room) the images stay in ordinary memory, and the log says so
// once.
//
// Any thread may call anything. Blocks on the disk in Keep alone.
class ImageFiles : public engine::ImageStore {
 public:
  // 80 keyframes of 640x480: the map of one exhibit is awake as a whole, and a camera in a larger one sees
  // what fewer of them show.
  static constexpr std::size_t kAwakeBytes = 32 * 1024 * 1024;

  explicit ImageFiles(std::filesystem::path folder = DefaultFolder(), std::size_t awake_bytes = kAwakeBytes);

  // For files that are large, and may be on disk rather than in memory: $TMPDIR, else /var/tmp.
  static std::filesystem::path DefaultFolder();

  std::shared_ptr<const engine::ImageFeatures> Keep(
      std::shared_ptr<const engine::ImageFeatures> features) override;
  void EvictAll() override;

 private:
  const std::filesystem::path folder_;
  const std::shared_ptr<WorkingSet> awake_;  // the images have it too, for they may outlive this
  std::atomic<bool> told_{false};            // that images stay in memory
};

}  // namespace docent::app
