// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "engine/map/map_snapshot.h"
#include "engine/vision/small_blurry_image.h"

// Small blurry images side by side in memory, and the exhaustive search among them (ptamm §3.2): a byte a
// pixel, so that those of a museum fit a wearable, and in two sizes, so that all of them are read in
// milliseconds. A camera that stands where a keyframe was taken but looks a little elsewhere sees the image
// shifted: the search tries all shifts up to a sixth of the image. Brightness and contrast play no part.
namespace docent::maps {

// Standard deviation of a packed thumbnail's values; leaves room for four of them.
inline constexpr float kThumbnailContrast = 32;

// A thumbnail as the index and the library keep it: half as large as engine::SmallBlurryImage in either
// direction (its blur leaves nothing in between), without the coarsest shading, mean 0, standard
// deviation 32.
struct PackedThumbnail {
  std::uint16_t width = 0, height = 0;
  std::vector<std::int8_t> pixels;  // row by row

  bool operator==(const PackedThumbnail& other) const = default;
};
// Empty (width 0) when the image has no pixels.
PackedThumbnail Pack(const engine::SmallBlurryImage& image);

struct KeyFrameThumbnail {
  engine::KeyFrameId keyframe = engine::kNoId;
  PackedThumbnail thumbnail;

  bool operator==(const KeyFrameThumbnail& other) const = default;
};

// Where the two sizes' pixels lie, for thumbnails of one size. The coarse one is the middle of the thumbnail
// in cells of kCell x kCell pixels: what stays in sight under every shift that is tried.
struct ThumbnailShape {
  static constexpr int kCell = 3;       // pixels; as wide as the blur
  static constexpr int kShiftStep = 2;  // pixels, between the shifts of the coarse search
  int width, height;
  int reach_x, reach_y;  // largest shifts, pixels
  int columns, rows;     // cells
  std::size_t fine_bytes, coarse_bytes;

  ThumbnailShape(int width_px, int height_px);
};

// Thumbnails of one size. One thread appends; others may search meanwhile, each up to the size that it was
// told with the array, because what is below never changes.
class ThumbnailArray {
 public:
  struct Owner {
    std::uint64_t map_key = 0;
    engine::KeyFrameId keyframe = engine::kNoId;
  };
  // A thumbnail like the wanted one. difference: mean squared difference at the best shift, both thumbnails
  // at a standard deviation of 32, divided by the part of the image that overlaps: what overlaps little
  // agrees easily.
  struct Hit {
    std::size_t slot = 0;
    double difference = 0;
  };

  // Memory for `capacity` thumbnails is reserved; it is not touched, so the system need not provide it yet.
  ThumbnailArray(int width, int height, std::size_t capacity);

  const ThumbnailShape& shape() const { return shape_; }
  std::size_t capacity() const { return capacity_; }
  // The thumbnail's size must be the array's, and there must be room. For the one writer.
  std::size_t size() const { return size_; }
  std::size_t Append(const PackedThumbnail& thumbnail, Owner owner);
  std::size_t Append(const ThumbnailArray& from, std::size_t slot);

  const Owner& owner(std::size_t slot) const { return owners_[slot]; }
  bool Holds(std::size_t slot, const PackedThumbnail& thumbnail) const;

  // The best of the first `size` thumbnails, most alike first, at most `count`; ties go to the earlier slot.
  std::vector<Hit> Search(const PackedThumbnail& wanted, std::size_t size, std::size_t count) const;
  // The same among chosen slots, all of which are compared finely.
  std::vector<Hit> Search(const PackedThumbnail& wanted, std::span<const std::size_t> slots) const;

 private:
  const ThumbnailShape shape_;
  const std::size_t capacity_;
  std::size_t size_ = 0;
  std::unique_ptr<std::int8_t[]> coarse_, fine_;  // one after another
  std::unique_ptr<Owner[]> owners_;
};

}  // namespace docent::maps
