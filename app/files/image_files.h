// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <filesystem>
#include <memory>

#include "app/files/working_set.h"
#include "engine/vision/image_store.h"

namespace docent::app {

// Stores the images of keyframes in memory-mapped files. Each keyframe has an anonymous file of its own,
// which is mapped for reading and closed, so the system frees its blocks when the last image in it is
// released, however the program ends. The pages of an evicted image are read again from the file when they
// are accessed, usually from the page cache, which the system may reclaim at any time. Evicted images
// therefore cost no memory, and readers need not know about eviction. Of the images in use, a limited number
// of bytes is resident at a time. Where no file can be written (no folder, no space) the images stay in
// ordinary memory, which is logged once. What the disk cannot return counts as black, which is logged once
// too (GuardedPages).
//
// Any thread may call anything. Only Store blocks on the disk.
class ImageFiles : public engine::ImageStore {
 public:
  // 80 keyframes of 640x480: the map of one exhibit is resident as a whole, and a camera in a larger map uses
  // fewer keyframes than that at a time.
  static constexpr std::size_t kResidentBytes = 32 * 1024 * 1024;

  explicit ImageFiles(std::filesystem::path folder = DefaultFolder(),
                      std::size_t resident_bytes = kResidentBytes);

  // A folder for large files that may be on disk rather than in memory: $TMPDIR, else /var/tmp.
  static std::filesystem::path DefaultFolder();

  std::shared_ptr<const engine::ImageFeatures> Store(
      std::shared_ptr<const engine::ImageFeatures> features) override;
  void EvictAll() override;

 private:
  const std::filesystem::path folder_;
  const std::shared_ptr<WorkingSet> working_set_;  // shared with the images, which may outlive this object
  std::atomic<bool> warned_{false};                // that images stay in memory; logged once
};

}  // namespace docent::app
