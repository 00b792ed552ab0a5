// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "engine/vision/image_pyramid.h"

namespace docent::engine {

// Where the images of keyframes lie. They are most of a map's bytes, and of most of them nothing is looked
// at for minutes: a store keeps them where they need no memory in the meantime. It lets images rest by
// itself where others are looked at (ImageFeatures::Look), so that their memory has a bound however large the
// map is. The engine knows no files; whoever owns a mapper may give it a store, which must outlive none of
// the images that it kept.
//
// What holds: a kept image has the same pixels at the same address for as long as anyone holds it, resting
// or not, so who reads it needs to know nothing of all this. Any thread may call anything.
class ImageStore {
 public:
  virtual ~ImageStore() = default;

  // The same features with their pyramid in the store; never to be written again. The argument itself when
  // the store has no room.
  virtual std::shared_ptr<const ImageFeatures> Keep(std::shared_ptr<const ImageFeatures> features) = 0;
  // All that were looked at may rest, for something else is about to need the memory. Looking brings it back.
  virtual void EvictAll() = 0;
};

}  // namespace docent::engine
