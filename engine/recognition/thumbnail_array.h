// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "engine/map/map_snapshot.h"
#include "engine/vision/small_blurry_image.h"

// Stores small blurry images contiguously in memory and searches them exhaustively (ptamm §3.2). They use
// one byte per pixel, so that those of a museum fit in a wearable's memory, and have two resolutions, so that
// all are compared in milliseconds. A camera at a keyframe's position with a slightly different orientation
// sees a shifted image, so the search tries all shifts of up to a sixth of the image. The comparison is
// invariant to brightness and contrast.
namespace docent::engine {

// The standard deviation of a packed thumbnail's values; the range of int8 leaves room for four of them.
inline constexpr float kThumbnailContrast = 32;

// A thumbnail as the index and the library store it: half the width and height of SmallBlurryImage
// (its blur leaves no finer detail), with the coarsest shading removed, mean 0 and standard deviation 32.
struct PackedThumbnail {
  std::uint16_t width = 0, height = 0;
  std::vector<std::int8_t> pixels;  // Row by row.

  bool operator==(const PackedThumbnail& other) const = default;
};
// Returns an empty thumbnail (width 0) when the image has no pixels.
PackedThumbnail Pack(const SmallBlurryImage& image);

struct KeyFrameThumbnail {
  KeyFrameId keyframe = kNoId;
  PackedThumbnail thumbnail;

  bool operator==(const KeyFrameThumbnail& other) const = default;
};

// The layout of both resolutions for thumbnails of one size. The coarse one covers the middle of the
// thumbnail, which stays inside the image for all shifts, in cells of kCell x kCell pixels.
struct ThumbnailShape {
  static constexpr int kCell = 3;       // Pixels; as wide as the blur.
  static constexpr int kShiftStep = 2;  // Pixels between the shifts of the coarse search.
  int width, height;
  int reach_x, reach_y;  // Largest shifts in pixels.
  int columns, rows;     // Numbers of cells.
  std::size_t fine_bytes, coarse_bytes;

  ThumbnailShape(int width_px, int height_px);
};

// Thumbnails of one size. One thread appends. Other threads may search at the same time, each up to the size
// that it was given with the array, because stored thumbnails never change.
class ThumbnailArray {
 public:
  struct Owner {
    std::uint64_t map_key = 0;
    KeyFrameId keyframe = kNoId;
  };
  // A similar thumbnail. `difference` is the mean squared difference at the best shift, with both thumbnails
  // at a standard deviation of 32, divided by the overlapping ratio of the image to penalize small overlaps.
  struct Hit {
    std::size_t slot = 0;
    double difference = 0;
  };

  // Reserves memory for `capacity` thumbnails without touching it, so the system need not provide it yet.
  ThumbnailArray(int width, int height, std::size_t capacity);

  const ThumbnailShape& shape() const { return shape_; }
  std::size_t capacity() const { return capacity_; }
  // Only for the writing thread. The thumbnail must have the array's size, and there must be room.
  std::size_t size() const { return size_; }
  std::size_t Append(const PackedThumbnail& thumbnail, Owner owner);
  std::size_t Append(const ThumbnailArray& from, std::size_t slot);

  const Owner& owner(std::size_t slot) const { return owners_[slot]; }
  bool Holds(std::size_t slot, const PackedThumbnail& thumbnail) const;

  // Returns the `count` most similar of the first `size` thumbnails, best first; ties go to the lower slot.
  std::vector<Hit> Search(const PackedThumbnail& wanted, std::size_t size, std::size_t count) const;
  // Compares the given slots, all of them at full resolution.
  std::vector<Hit> Search(const PackedThumbnail& wanted, std::span<const std::size_t> slots) const;

 private:
  const ThumbnailShape shape_;
  const std::size_t capacity_;
  std::size_t size_ = 0;
  std::unique_ptr<std::int8_t[]> coarse_, fine_;  // Contiguous thumbnails.
  std::unique_ptr<Owner[]> owners_;
};

}  // namespace docent::engine
