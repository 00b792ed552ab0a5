// SPDX-License-Identifier: Apache-2.0
#include "engine/dense/plane_sweep.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "engine/base/interrupt.h"

namespace docent::engine {
namespace {

// The window of the census transform: a larger one is less sensitive to noise, but blurs the edges of
// objects.
constexpr int kCensusRadius = 2;
constexpr int kCensusSize = (2 * kCensusRadius + 1) * (2 * kCensusRadius + 1) - 1;
// Grey values are compared with four bits of a fraction, so that warped images are not rounded.
constexpr float kGreyScale = 16;
// Grey values that differ by less than four levels are not only brighter or darker, but by how much: so noise
// in weak texture counts little, and the cost changes smoothly between planes.
constexpr int kSoftStep = 4 * 16;
// Pixels are projected exactly for every eighth plane; between these, they move on a line.
constexpr int kExactEvery = 8;
// The cost of a pixel that no neighbour sees: somewhat better than the half of the bits that differ by
// chance.
constexpr std::uint8_t kUnknownCost = static_cast<std::uint8_t>(0.4 * CostVolume::kMaxCost);
constexpr std::uint8_t kInvalidCost = 255;
constexpr float kOutside = -1e6F;

using GreyRows = std::vector<std::int16_t>;  // Row by row, kGreyScale times the grey value.

// The pixels of a neighbour's level at which the surfaces on one plane are seen.
struct PlanePixels {
  std::vector<float> x, y;
};

void ProjectPlane(const SweepView& reference, const SweepView& neighbour, double inverse_distance,
                  PlanePixels* pixels) {
  const Rigid3 neighbour_from_reference = neighbour.camera_from_map * reference.camera_from_map.inverse();
  const Eigen::Matrix3d rotation = neighbour_from_reference.rotation.matrix();
  const Eigen::Vector3d shift = neighbour_from_reference.translation * inverse_distance;
  const LevelRays& rays = *reference.rays;
  const std::size_t count =
      static_cast<std::size_t>(rays.width_px()) * static_cast<std::size_t>(rays.height_px());
  pixels->x.assign(count, kOutside);
  pixels->y.assign(count, kOutside);
  std::size_t i = 0;
  for (int y = 0; y < rays.height_px(); ++y) {
    for (int x = 0; x < rays.width_px(); ++x, ++i) {
      const Eigen::Vector3f ray = rays.At(x, y);
      if (ray.isZero()) continue;
      const auto pixel = neighbour.rays->Project(rotation * ray.cast<double>() + shift);
      if (!pixel) continue;
      pixels->x[i] = static_cast<float>(pixel->x());
      pixels->y[i] = static_cast<float>(pixel->y());
    }
  }
}

// Samples an image at pixels between those of two planes; kOutside stays outside. Pixels that are not seen
// get -1.
void WarpImage(const cv::Mat& image, const PlanePixels& from, const PlanePixels& to, float fraction,
               GreyRows* warped) {
  const auto last_x = static_cast<float>(image.cols - 1), last_y = static_cast<float>(image.rows - 1);
  for (std::size_t i = 0; i < warped->size(); ++i) {
    const float x = from.x[i] + fraction * (to.x[i] - from.x[i]);
    const float y = from.y[i] + fraction * (to.y[i] - from.y[i]);
    if (!(x >= 0 && y >= 0 && x < last_x && y < last_y)) {
      (*warped)[i] = -1;
      continue;
    }
    const int column = static_cast<int>(x), row = static_cast<int>(y);
    const float across = x - static_cast<float>(column), down = y - static_cast<float>(row);
    const std::uint8_t* const upper = image.ptr<std::uint8_t>(row) + column;
    const std::uint8_t* const lower = image.ptr<std::uint8_t>(row + 1) + column;
    const float above = static_cast<float>(upper[0]) + across * static_cast<float>(upper[1] - upper[0]);
    const float below = static_cast<float>(lower[0]) + across * static_cast<float>(lower[1] - lower[0]);
    // Grey levels are never negative, and std::lround is slow.
    // NOLINTNEXTLINE(bugprone-incorrect-roundings)
    (*warped)[i] = static_cast<std::int16_t>(kGreyScale * (above + down * (below - above)) + 0.5F);
  }
}

// The difference of two grey values, from -kSoftStep to kSoftStep.
std::int16_t SoftComparison(std::int16_t other, std::int16_t center) {
  const int difference = other - center;
  return static_cast<std::int16_t>(std::clamp(difference, -kSoftStep, kSoftStep));
}

// The soft census transform of an image, as one mask of all pixels for each comparison. Pixels near the
// border are left out.
std::array<GreyRows, kCensusSize> CensusMasks(const GreyRows& grey, int width, int height) {
  std::array<GreyRows, kCensusSize> masks;
  std::size_t next = 0;
  for (int dy = -kCensusRadius; dy <= kCensusRadius; ++dy) {
    for (int dx = -kCensusRadius; dx <= kCensusRadius; ++dx) {
      if (dx == 0 && dy == 0) continue;
      GreyRows& mask = masks[next++];
      mask.assign(grey.size(), 0);
      for (int y = kCensusRadius; y < height - kCensusRadius; ++y) {
        const std::int16_t* const row = grey.data() + y * width;
        for (int x = kCensusRadius; x < width - kCensusRadius; ++x)
          mask[static_cast<std::size_t>(y * width + x)] = SoftComparison(row[x + dy * width + dx], row[x]);
      }
    }
  }
  return masks;
}

// How much the census transform of `grey` differs from the masks, up to CostVolume::kMaxCost. kInvalidCost
// where the pixel is not seen, or its window leaves the image.
void CompareCensus(const std::array<GreyRows, kCensusSize>& masks, const GreyRows& grey, int width,
                   int height, std::vector<std::uint8_t>* costs) {
  costs->assign(grey.size(), kInvalidCost);
  std::vector<std::int16_t> sums(static_cast<std::size_t>(width));
  for (int y = kCensusRadius; y < height - kCensusRadius; ++y) {
    std::fill(sums.begin(), sums.end(), std::int16_t{0});
    const std::int16_t* __restrict const row = grey.data() + y * width;
    std::int16_t* __restrict const sum = sums.data();
    std::size_t next = 0;
    for (int dy = -kCensusRadius; dy <= kCensusRadius; ++dy) {
      for (int dx = -kCensusRadius; dx <= kCensusRadius; ++dx) {
        if (dx == 0 && dy == 0) continue;
        const std::int16_t* __restrict const mask = masks[next++].data() + y * width;
        const std::int16_t* __restrict const other = row + dy * width + dx;
        for (int x = kCensusRadius; x < width - kCensusRadius; ++x) {
          const int difference = SoftComparison(other[x], row[x]) - mask[x];
          sum[x] = static_cast<std::int16_t>(sum[x] + (difference < 0 ? -difference : difference));
        }
      }
    }
    for (int x = kCensusRadius; x < width - kCensusRadius; ++x) {
      if (row[x] < 0) continue;
      (*costs)[static_cast<std::size_t>(y * width + x)] =
          static_cast<std::uint8_t>(sum[x] * CostVolume::kMaxCost / (2 * kSoftStep * kCensusSize));
    }
  }
}

// The mean of the better half of the valid costs.
std::uint8_t CombineCosts(std::array<std::uint8_t, 16>* costs, std::size_t count) {
  std::sort(costs->begin(), costs->begin() + static_cast<std::ptrdiff_t>(count));
  std::size_t valid = 0;
  while (valid < count && (*costs)[valid] != kInvalidCost) ++valid;
  if (valid == 0) return kUnknownCost;
  const std::size_t used = (valid + 1) / 2;
  unsigned sum = 0;
  for (std::size_t i = 0; i < used; ++i) sum += (*costs)[i];
  return static_cast<std::uint8_t>((sum + used / 2) / used);
}

// One neighbour of the sweep with its state between planes.
struct SweptNeighbour {
  const SweepView* view;
  PlanePixels from, to;
  GreyRows warped;
  std::vector<std::uint8_t> costs;
};

GreyRows GreyOf(const cv::Mat& image) {
  GreyRows grey;
  grey.reserve(image.total());
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x)
      grey.push_back(
          static_cast<std::int16_t>(kGreyScale * static_cast<float>(image.at<std::uint8_t>(y, x))));
  }
  return grey;
}

void StorePlane(const std::vector<SweptNeighbour>& neighbours, int plane, CostVolume* volume) {
  const std::size_t pixels = neighbours.front().costs.size(),
                    planes = static_cast<std::size_t>(volume->planes);
  std::array<std::uint8_t, 16> costs{};
  for (std::size_t i = 0; i < pixels; ++i) {
    for (std::size_t n = 0; n < neighbours.size(); ++n) costs[n] = neighbours[n].costs[i];
    volume->costs[i * planes + static_cast<std::size_t>(plane)] = CombineCosts(&costs, neighbours.size());
  }
}

}  // namespace

SweepPlanes SpacePlanes(const SweepView& reference, const std::vector<SweepView>& neighbours,
                        double min_inverse_distance, double max_inverse_distance, int max_count) {
  constexpr int kMinCount = 16, kGrid = 8;
  double largest_px = 0;
  for (const SweepView& neighbour : neighbours) {
    const Rigid3 transform = neighbour.camera_from_map * reference.camera_from_map.inverse();
    double sum_px = 0;
    int count = 0;
    for (int i = 0; i < kGrid * kGrid; ++i) {
      const int x = (2 * (i % kGrid) + 1) * reference.rays->width_px() / (2 * kGrid);
      const int y = (2 * (i / kGrid) + 1) * reference.rays->height_px() / (2 * kGrid);
      const Eigen::Vector3d ray = transform.rotation * reference.rays->At(x, y).cast<double>();
      if (ray.isZero()) continue;
      // The whole range may leave the image, half of it rarely does.
      const double middle = 0.5 * (min_inverse_distance + max_inverse_distance);
      const auto far = neighbour.rays->Project(ray + transform.translation * min_inverse_distance);
      const auto near = neighbour.rays->Project(ray + transform.translation * middle);
      if (!far || !near) continue;
      sum_px += 2 * (*near - *far).norm();
      ++count;
    }
    if (count > 0) largest_px = std::max(largest_px, sum_px / count);
  }
  SweepPlanes planes;
  planes.count =
      std::clamp(static_cast<int>(std::lround(largest_px)) + 1, kMinCount, std::max(kMinCount, max_count));
  planes.first = min_inverse_distance;
  planes.step = (max_inverse_distance - min_inverse_distance) / (planes.count - 1);
  return planes;
}

CostVolume SweepCosts(const SweepView& reference, const std::vector<SweepView>& neighbours,
                      const SweepPlanes& planes, const std::atomic<bool>* interrupt) {
  const int width = reference.image->cols, height = reference.image->rows;
  CostVolume volume(width, height, planes.count);
  const auto masks = CensusMasks(GreyOf(*reference.image), width, height);
  std::vector<SweptNeighbour> swept;
  for (const SweepView& neighbour : neighbours) {
    swept.push_back({&neighbour, {}, {}, GreyRows(reference.image->total()), {}});
    ProjectPlane(reference, neighbour, planes.InverseDistance(0), &swept.back().to);
  }
  for (int plane = 0; plane < planes.count && !IsInterrupted(interrupt); ++plane) {
    const int phase = plane % kExactEvery;
    for (SweptNeighbour& neighbour : swept) {
      if (phase == 0) {
        std::swap(neighbour.from, neighbour.to);
        ProjectPlane(reference, *neighbour.view, planes.InverseDistance(plane + kExactEvery), &neighbour.to);
      }
      WarpImage(*neighbour.view->image, neighbour.from, neighbour.to, static_cast<float>(phase) / kExactEvery,
                &neighbour.warped);
      CompareCensus(masks, neighbour.warped, width, height, &neighbour.costs);
    }
    StorePlane(swept, plane, &volume);
  }
  return volume;
}

}  // namespace docent::engine
