// SPDX-License-Identifier: Apache-2.0
#include "engine/vision/descriptor.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/core/hal/intrin.hpp>

#include "engine/base/option_check.h"
#include "engine/vision/patch.h"

namespace docent::engine {

namespace {

constexpr int kPatchWidth = 15, kHalfPatch = kPatchWidth / 2;
constexpr int kCells = 3, kDirections = 4;
constexpr int kRadius = 13;  // of the sampled window: the rotated patch, its gradients and the blur
constexpr int kWindow = 2 * kRadius + 1;
constexpr int kSmoothed = kWindow - 2;
constexpr int kRotatedWidth = kPatchWidth + 2;  // with a border for the gradients
constexpr int kLanes = 16;                      // a row of the patch, padded to the vector width
constexpr float kMaxValue = 0.3f;      // of the unit vector; limits the influence of a single strong edge
constexpr float kMinStrength = 60.0f;  // norm before normalization: about twice that of sensor noise
constexpr int kDirectionBins = 36;
constexpr float kSecondPeak = 0.8f;  // ratio of the strongest peak (Lowe 2004)

struct Tables {
  // Weights of a patch row (or column) for each cell: linear between the cell centres, Gaussian towards the
  // border, where an error of direction or scale has the largest effect.
  alignas(32) std::array<std::array<float, kLanes>, kCells> cell_weight{};
  // Weights of the gradients that vote for the direction: a disc of the patch's size.
  std::array<std::array<float, kPatchWidth>, kPatchWidth> direction_weight{};

  Tables() {
    for (int cell = 0; cell < kCells; ++cell) {
      for (int i = 0; i < kPatchWidth; ++i) {
        const float offset = static_cast<float>(i - kHalfPatch);
        const float distance = std::abs(offset - 5.0f * static_cast<float>(cell - 1)) / 5.0f;
        cell_weight[static_cast<std::size_t>(cell)][static_cast<std::size_t>(i)] =
            std::max(0.0f, 1 - distance) * std::exp(-offset * offset / (2 * 7.5f * 7.5f));
      }
    }
    for (int y = -kHalfPatch; y <= kHalfPatch; ++y) {
      for (int x = -kHalfPatch; x <= kHalfPatch; ++x) {
        const float squared = static_cast<float>(x * x + y * y);
        if (squared > 7.5f * 7.5f) continue;
        direction_weight[static_cast<std::size_t>(y + kHalfPatch)][static_cast<std::size_t>(x + kHalfPatch)] =
            std::exp(-squared / (2 * 3.5f * 3.5f));
      }
    }
  }
};
const Tables kTables;

// The neighbourhood of the pixel, blurred with a 3x3 binomial filter; the pixel itself is in the middle.
class BlurredWindow {
 public:
  BlurredWindow(const cv::Mat& image, const Eigen::Vector2f& pixel) {
    const int x0 = static_cast<int>(pixel.x()) - kRadius, y0 = static_cast<int>(pixel.y()) - kRadius;
    const float fx = pixel.x() - std::floor(pixel.x()), fy = pixel.y() - std::floor(pixel.y());
    // Bilinear interpolation and the binomial filter 1 2 1 combined over four neighbours.
    const std::array<float, 4> across = Kernel(fx), down = Kernel(fy);
    std::array<std::array<float, kSmoothed>, kWindow + 1> rows;
    for (int row = 0; row <= kWindow; ++row) {
      const std::uint8_t* p = image.ptr<std::uint8_t>(y0 + row) + x0;
      float* out = rows[static_cast<std::size_t>(row)].data();
      for (int i = 0; i < kSmoothed; ++i) {
        out[i] = across[0] * static_cast<float>(p[i]) + across[1] * static_cast<float>(p[i + 1]) +
                 across[2] * static_cast<float>(p[i + 2]) + across[3] * static_cast<float>(p[i + 3]);
      }
    }
    for (std::size_t row = 0; row < kSmoothed; ++row) {
      float* out = values_.data() + row * kSmoothed;
      for (std::size_t i = 0; i < kSmoothed; ++i) {
        out[i] = down[0] * rows[row][i] + down[1] * rows[row + 1][i] + down[2] * rows[row + 2][i] +
                 down[3] * rows[row + 3][i];
      }
    }
  }

  // Offsets from the pixel, within kRadius - 1.
  float At(int x, int y) const {
    return values_[static_cast<std::size_t>((y + kRadius - 1) * kSmoothed + x + kRadius - 1)];
  }
  float Interpolate(float x, float y) const {
    const float left = x + kRadius - 1, top = y + kRadius - 1;
    const int x0 = static_cast<int>(left), y0 = static_cast<int>(top);
    const float fx = left - static_cast<float>(x0), fy = top - static_cast<float>(y0);
    const float* p = values_.data() + y0 * kSmoothed + x0;
    const float upper = p[0] + fx * (p[1] - p[0]);
    const float lower = p[kSmoothed] + fx * (p[kSmoothed + 1] - p[kSmoothed]);
    return upper + fy * (lower - upper);
  }

 private:
  static std::array<float, 4> Kernel(float fraction) {
    const float rest = 1 - fraction;
    return {0.25f * rest, 0.25f * (fraction + 2 * rest), 0.25f * (2 * fraction + rest), 0.25f * fraction};
  }

  std::array<float, kSmoothed * kSmoothed> values_;
};

// Angle as a ratio of 360 degrees, [0, 1); accurate to about 0.1 degrees, much finer than the histogram.
float AngleRatio(float x, float y) {
  const float ax = std::abs(x), ay = std::abs(y);
  const float ratio = std::min(ax, ay) / (std::max(ax, ay) + 1e-12f);
  const float squared = ratio * ratio;
  float angle =
      ratio * (0.99978784f + squared * (-0.32580840f + squared * (0.15557865f - 0.04432655f * squared)));
  if (ay > ax) angle = 0.5f * std::numbers::pi_v<float> - angle;
  if (x < 0) angle = std::numbers::pi_v<float> - angle;
  if (y < 0) angle = -angle;
  const float fraction = angle * (0.5f / std::numbers::pi_v<float>);
  return fraction < 0 ? fraction + 1 : fraction;
}

using DirectionHistogram = std::array<float, kDirectionBins>;

DirectionHistogram HistogramOf(const BlurredWindow& window) {
  // One extra bin, so that the last bin can be interpolated without a test.
  std::array<float, kDirectionBins + 2> bins{};
  for (int y = -kHalfPatch; y <= kHalfPatch; ++y) {
    for (int x = -kHalfPatch; x <= kHalfPatch; ++x) {
      const float weight = kTables.direction_weight[static_cast<std::size_t>(y + kHalfPatch)]
                                                   [static_cast<std::size_t>(x + kHalfPatch)];
      if (weight == 0) continue;
      const float gx = window.At(x + 1, y) - window.At(x - 1, y);
      const float gy = window.At(x, y + 1) - window.At(x, y - 1);
      const float place = AngleRatio(gx, gy) * kDirectionBins;
      const auto bin = static_cast<std::size_t>(place);
      const float share = place - static_cast<float>(bin);
      const float vote = weight * std::sqrt(gx * gx + gy * gy);
      bins[bin] += (1 - share) * vote;
      bins[bin + 1] += share * vote;
    }
  }
  bins[0] += bins[kDirectionBins];
  bins[1] += bins[kDirectionBins + 1];
  DirectionHistogram histogram, previous;
  std::copy_n(bins.begin(), kDirectionBins, histogram.begin());
  // Approximates a Gaussian of 14 degrees.
  for (int round = 0; round < 4; ++round) {
    previous = histogram;
    for (std::size_t i = 0; i < kDirectionBins; ++i) {
      histogram[i] = 0.25f * previous[(i + kDirectionBins - 1) % kDirectionBins] + 0.5f * previous[i] +
                     0.25f * previous[(i + 1) % kDirectionBins];
    }
  }
  return histogram;
}

// Writes the strongest directions in radians, strongest first, and returns their number.
int DominantDirections(const DirectionHistogram& histogram, std::array<float, kMaxDirections>* directions) {
  struct Peak {
    float height = 0, bin = 0;
  };
  std::array<Peak, kMaxDirections> peaks;
  for (std::size_t i = 0; i < kDirectionBins; ++i) {
    const float before = histogram[(i + kDirectionBins - 1) % kDirectionBins], here = histogram[i],
                after = histogram[(i + 1) % kDirectionBins];
    if (!(here > before && here >= after)) continue;
    // Vertex of the parabola through the three values.
    const float offset = 0.5f * (before - after) / (before - 2 * here + after);
    const Peak peak{here, static_cast<float>(i) + offset};
    if (peak.height > peaks[0].height) {
      peaks[1] = peaks[0];
      peaks[0] = peak;
    } else if (peak.height > peaks[1].height) {
      peaks[1] = peak;
    }
  }
  int count = 0;
  for (const Peak& peak : peaks) {
    if (!(peak.height > 0 && peak.height >= kSecondPeak * peaks[0].height)) break;
    (*directions)[static_cast<std::size_t>(count++)] =
        peak.bin * (2 * std::numbers::pi_v<float> / kDirectionBins);
  }
  return count;
}

// False if there is too little texture.
bool Normalize(std::array<float, kDescriptorSize>* values, Descriptor* descriptor) {
  Eigen::Map<Eigen::Array<float, kDescriptorSize, 1>> vector(values->data());
  const float strength = std::sqrt(vector.square().sum());
  if (!(strength > kMinStrength)) return false;
  // The Euclidean distance of square roots of ratios is the Hellinger distance of histograms (Arandjelovic
  // and Zisserman 2012).
  vector = (vector / vector.sum()).sqrt().min(kMaxValue);
  vector *= kDescriptorLength / std::sqrt(vector.square().sum());
  for (std::size_t i = 0; i < kDescriptorSize; ++i)
    descriptor->values[i] = static_cast<std::uint8_t>(std::min((*values)[i] + 0.5f, 255.0f));
  return true;
}

bool DescribeRotated(const BlurredWindow& window, float direction_rad, Descriptor* descriptor) {
  const float cosine = std::cos(direction_rad), sine = std::sin(direction_rad);
  std::array<std::array<float, kRotatedWidth>, kRotatedWidth> rotated;
  for (int row = 0; row < kRotatedWidth; ++row) {
    const float v = static_cast<float>(row - kRotatedWidth / 2);
    for (int column = 0; column < kRotatedWidth; ++column) {
      const float u = static_cast<float>(column - kRotatedWidth / 2);
      rotated[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)] =
          window.Interpolate(cosine * u - sine * v, sine * u + cosine * v);
    }
  }
  // Each gradient contributes its components to the half axes: no angle is needed, and a small rotation
  // changes little.
  using Lanes = std::array<float, kLanes>;
  alignas(32) std::array<std::array<Lanes, kDirections>, kCells> by_row{};
  for (std::size_t y = 0; y < kPatchWidth; ++y) {
    alignas(32) std::array<Lanes, kDirections> components{};
    for (std::size_t x = 0; x < kPatchWidth; ++x) {
      const float gx = rotated[y + 1][x + 2] - rotated[y + 1][x],
                  gy = rotated[y + 2][x + 1] - rotated[y][x + 1];
      components[0][x] = std::max(gx, 0.0f);
      components[1][x] = std::max(-gx, 0.0f);
      components[2][x] = std::max(gy, 0.0f);
      components[3][x] = std::max(-gy, 0.0f);
    }
    for (std::size_t cell = 0; cell < kCells; ++cell) {
      const float weight = kTables.cell_weight[cell][y];
      if (weight == 0) continue;
      for (std::size_t direction = 0; direction < kDirections; ++direction)
        for (std::size_t x = 0; x < kLanes; ++x)
          by_row[cell][direction][x] += weight * components[direction][x];
    }
  }
  std::array<float, kDescriptorSize> values;
  std::size_t next = 0;
  for (std::size_t row = 0; row < kCells; ++row) {
    for (std::size_t column = 0; column < kCells; ++column) {
      for (std::size_t direction = 0; direction < kDirections; ++direction) {
        const Eigen::Map<const Eigen::Array<float, kLanes, 1>> lanes(by_row[row][direction].data());
        const Eigen::Map<const Eigen::Array<float, kLanes, 1>> weights(kTables.cell_weight[column].data());
        values[next++] = (lanes * weights).sum();
      }
    }
  }
  return Normalize(&values, descriptor);
}

bool DescriptorFits(const cv::Mat& image, const Eigen::Vector2f& pixel) {
  constexpr float kBorder = kDescriptorBorder;
  return pixel.x() >= kBorder && pixel.y() >= kBorder &&
         pixel.x() <= static_cast<float>(image.cols - 1) - kBorder &&
         pixel.y() <= static_cast<float>(image.rows - 1) - kBorder;
}

void Append(const ImageFeatures& features, const Eigen::Vector2f& pixel, int level,
            std::vector<DescribedKeypoint>* places) {
  features.MarkInUse();
  const auto description = Describe(features.levels[static_cast<std::size_t>(level)],
                                    LevelFromLevelZero(pixel.cast<double>(), level).cast<float>());
  if (!description) return;
  for (std::size_t i = 0; i < static_cast<std::size_t>(description->count); ++i)
    places->push_back({description->of_direction[i], pixel, static_cast<std::uint8_t>(level)});
}

// The best corners of a level, at most `count`, with at most one per cell of a grid of about as many cells.
std::vector<Corner> BestCorners(const ImageFeatures& features, std::size_t level, int count,
                                float min_score) {
  features.MarkInUse();
  const cv::Mat& image = features.levels[level];
  if (image.cols <= 2 * kDescriptorBorder || image.rows <= 2 * kDescriptorBorder || count <= 0) return {};
  const double cell = std::max(4.0, std::sqrt(static_cast<double>(image.total()) / (2.0 * count)));
  const int columns = static_cast<int>(image.cols / cell) + 1, rows = static_cast<int>(image.rows / cell) + 1;
  struct Scored {
    float score = 0;
    Corner corner;
  };
  std::vector<Scored> best(static_cast<std::size_t>(columns * rows), {min_score, {}});
  for (const Corner& corner : features.corners[level]) {
    if (!DescriptorFits(image, {corner.x, corner.y})) continue;
    const float score = ShiTomasiScore(image, corner.x, corner.y);
    Scored& place = best[static_cast<std::size_t>(static_cast<int>(corner.y / cell) * columns +
                                                  static_cast<int>(corner.x / cell))];
    if (score > place.score) place = {score, corner};
  }
  std::erase_if(best, [&](const Scored& place) { return !(place.score > min_score); });
  std::stable_sort(best.begin(), best.end(),
                   [](const Scored& a, const Scored& b) { return a.score > b.score; });
  std::vector<Corner> corners;
  for (const Scored& place : best) {
    if (static_cast<int>(corners.size()) >= count) break;
    corners.push_back(place.corner);
  }
  return corners;
}

}  // namespace

std::optional<std::string> CornerDescriptionOptions::Validate() const {
  return OptionCheck()
      .That(std::ranges::all_of(corners, [](int count) { return count >= 0; }),
            "The number of described corners of a level must be at least 0.")
      .AtLeast(min_score, 0, "score of a described corner")
      .fault();
}

int SquaredDistance(const Descriptor& a, const Descriptor& b) {
  const std::uint8_t *p = a.values.data(), *q = b.values.data();
  const cv::v_uint8x16 first = cv::v_absdiff(cv::v_load(p), cv::v_load(q));
  const cv::v_uint8x16 second = cv::v_absdiff(cv::v_load(p + 16), cv::v_load(q + 16));
  const cv::v_uint32x4 sums = cv::v_dotprod_expand(second, second, cv::v_dotprod_expand(first, first));
  int sum = static_cast<int>(cv::v_reduce_sum(sums));
  for (int i = 32; i < kDescriptorSize; ++i) sum += (p[i] - q[i]) * (p[i] - q[i]);
  return sum;
}

std::optional<Description> Describe(const cv::Mat& level_image, const Eigen::Vector2f& pixel_of_level) {
  if (!DescriptorFits(level_image, pixel_of_level)) return std::nullopt;
  const BlurredWindow window(level_image, pixel_of_level);
  std::array<float, kMaxDirections> directions;
  const int found = DominantDirections(HistogramOf(window), &directions);
  Description description;
  for (std::size_t i = 0; i < static_cast<std::size_t>(found); ++i) {
    OrientedDescriptor& oriented = description.of_direction[i];
    if (!DescribeRotated(window, directions[i], &oriented.descriptor)) break;
    oriented.direction_rad = directions[i];
    ++description.count;
  }
  if (description.count == 0) return std::nullopt;
  return description;
}

void DescribeKeypoint(const ImageFeatures& features, const Eigen::Vector2f& pixel, int first_level,
                      int last_level, std::vector<DescribedKeypoint>* places) {
  for (int level = std::max(first_level, 0); level <= std::min(last_level, kPyramidLevels - 1); ++level)
    Append(features, pixel, level, places);
}

std::vector<DescribedKeypoint> DescribeCorners(const ImageFeatures& features,
                                               const CornerDescriptionOptions& options) {
  std::vector<DescribedKeypoint> places;
  for (int level = 0; level < kPyramidLevels; ++level) {
    const auto index = static_cast<std::size_t>(level);
    for (const Corner& corner : BestCorners(features, index, options.corners[index], options.min_score)) {
      Append(features, LevelZeroFromLevel(Eigen::Vector2d(corner.x, corner.y), level).cast<float>(), level,
             &places);
    }
  }
  return places;
}

}  // namespace docent::engine
