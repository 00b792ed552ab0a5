// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "engine/vision/image_pyramid.h"

namespace docent::engine {

// Memory management for keyframe images. These are most of a map's bytes, and most are not read for minutes.
// A store keeps images where they can be evicted from memory, and evicts images when others are used
// (ImageFeatures::MarkInUse), so that their memory is bounded whatever the size of the map. The engine does
// not access files; the owner of a mapper may provide a store. Stored images may outlive the store.
//
// A stored image has the same pixels at the same address for as long as it is referenced, evicted or not, so
// code that reads it need not know about the store. All functions may be called from any thread.
class ImageStore {
 public:
  virtual ~ImageStore() = default;

  // The same features with their pyramid in the store; they must not be modified any more. Returns the
  // argument itself if the store has no room.
  virtual std::shared_ptr<const ImageFeatures> Store(std::shared_ptr<const ImageFeatures> features) = 0;
  // Evicts all images from memory, because something else needs it. Reading an image loads it again.
  virtual void EvictAll() = 0;
};

}  // namespace docent::engine
