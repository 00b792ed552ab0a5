// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <filesystem>
#include <memory>

#include "engine/vision/picture_store.h"

namespace docent::app {

// Keyframes' pictures on disk, mapped into memory. Each keyframe has a file of its own that has no name: it
// is mapped for reading and closed, and the system takes its blocks back when the last picture in it is let
// go, however the program ends. A page of a picture that rests is read from the file again when it is
// touched, mostly from what the system has cached and may reclaim at any time; so what rests counts for
// nothing, and nobody who reads can tell. Where no file can be written (no folder, no room) the pictures stay
// in ordinary memory, and the log says so once.
//
// There is no state that calls share: any thread may call anything. Blocks on the disk in Keep alone.
class PictureFiles : public engine::PictureStore {
 public:
  explicit PictureFiles(std::filesystem::path folder = DefaultFolder());

  // For files that are large, and may be on disk rather than in memory: $TMPDIR, else /var/tmp.
  static std::filesystem::path DefaultFolder();

  std::shared_ptr<const engine::ImageFeatures> Keep(
      std::shared_ptr<const engine::ImageFeatures> features) override;
  void Rest(const engine::ImageFeatures& features) override;

 private:
  const std::filesystem::path folder_;
  std::atomic<bool> told_{false};  // that pictures stay in memory
};

}  // namespace docent::app
