// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/wide_baseline_views.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "engine/recognition/descriptor_database.h"
#include "engine/vision/patch.h"

namespace docent::engine {

namespace {

// Younger images share keypoint tracks with the present one.
constexpr double kMinGap_s = 0.7;
// Of the whole rotation. The more the image has moved, the more an imperfect calibration looks like parallax:
// of 6,141 pairs of a hand-held camera that turned by 60 to 110 degrees a second, none beyond 20 degrees had
// significant depth, and 12 of 428 below 15.
constexpr double kMaxRotation_rad = 15 * 3.14159265358979 / 180;
constexpr std::size_t kMaxRemembered = 48;  // images, of half a megabyte each
constexpr std::size_t kPairsPerCall = 3;
constexpr int kCallsAgain = 8;           // a second at 30 images per second, if every fourth is used
constexpr std::size_t kMinMatches = 60;  // the initializer needs 50 inliers
constexpr float kMinCorrelation = 0.8f;  // as where the initializer tracks corners
// Descriptors of one place, of its two directions or of neighbouring corners, are not compared by the ratio
// test.
constexpr float kSamePlacePx = 3;

// The keypoint of each keypoint of a that is its nearest and whose nearest it is, by the rules of
// DescriptorDatabase; -1 for none.
std::vector<int> MatchMutually(std::span<const DescribedKeypoint> a, std::span<const DescribedKeypoint> b) {
  const DescriptorDatabase::MatchOptions rules;
  constexpr int kFar = std::numeric_limits<int>::max();
  std::vector<int> best_of_a(a.size(), -1), best_of_b(b.size(), -1), nearest_of_b(b.size(), kFar);
  for (std::size_t i = 0; i < a.size(); ++i) {
    int nearest = kFar, second = kFar, best = -1;
    for (std::size_t k = 0; k < b.size(); ++k) {
      const int distance = SquaredDistance(a[i].oriented.descriptor, b[k].oriented.descriptor);
      if (distance < nearest_of_b[k]) {
        nearest_of_b[k] = distance;
        best_of_b[k] = static_cast<int>(i);
      }
      if (distance >= second) continue;
      const bool elsewhere =
          best >= 0 && (b[static_cast<std::size_t>(best)].pixel - b[k].pixel).norm() > kSamePlacePx;
      if (distance < nearest) {
        if (elsewhere) second = nearest;
        nearest = distance;
        best = static_cast<int>(k);
      } else if (elsewhere) {
        second = distance;
      }
    }
    if (nearest < rules.max_distance && nearest < rules.max_ratio * second) best_of_a[i] = best;
  }
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (best_of_a[i] >= 0 && best_of_b[static_cast<std::size_t>(best_of_a[i])] != static_cast<int>(i))
      best_of_a[i] = -1;
  }
  return best_of_a;
}

// Where a rotation moves the pixel of one image in another.
std::optional<Eigen::Vector2d> Rotated(const Eigen::Vector2d& pixel, const CameraModel& from,
                                       const Rotation3& to_from_from, const CameraModel& to) {
  const auto ray = from.Unproject(pixel);
  return ray ? to.Project(to_from_from * *ray) : std::nullopt;
}

// Refines the pixel of b to a fraction of a pixel: aligns the patch around the pixel of a, as the rotation
// shows it. Both in level 0.
std::optional<Eigen::Vector2d> Refine(const InitialPair::View& a, const Eigen::Vector2d& pixel_a,
                                      const CameraImage& b, const Eigen::Vector2d& pixel_b,
                                      const Rotation3& a_from_b, int level) {
  constexpr double kStepPx = 2;
  Eigen::Matrix2f a_from_patch;
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::Vector2d step = kStepPx * Eigen::Vector2d::Unit(axis);
    const auto before = Rotated(pixel_b - step, *b.camera, a_from_b, *a.camera),
               after = Rotated(pixel_b + step, *b.camera, a_from_b, *a.camera);
    if (!before || !after) return std::nullopt;
    a_from_patch.col(axis) = ((*after - *before) / (2 * kStepPx)).cast<float>();
  }
  const auto index = static_cast<std::size_t>(level);
  PatchTemplate patch;
  if (!CutPatch(a.features->levels[index], LevelFromLevelZero(pixel_a, level).cast<float>(), a_from_patch,
                &patch))
    return std::nullopt;
  const auto aligned =
      AlignPatch(patch, b.features->levels[index], LevelFromLevelZero(pixel_b, level).cast<float>());
  if (!aligned || aligned->correlation < kMinCorrelation) return std::nullopt;
  return LevelZeroFromLevel(aligned->pixel.cast<double>(), level);
}

}  // namespace

void WideBaselineViews::Reset() {
  images_.clear();
  calls_ = 0;
  remembered_every_ = 1;
  calls_again_ = 0;
}

void WideBaselineViews::TryAgain(const View& earlier) {
  again_ = earlier.image.time;
  calls_again_ = kCallsAgain;
}

// Once there are too many, every second one is forgotten, and from then on only half as many are remembered:
// they go back to the beginning.
void WideBaselineViews::Remember(Remembered image) {
  if (calls_ % remembered_every_ != 0) return;
  images_.push_back(std::move(image));
  if (images_.size() < kMaxRemembered) return;
  // The first one stays where it is: moved to itself, it would lose its corners.
  for (std::size_t i = 1; 2 * i < images_.size(); ++i) images_[i] = std::move(images_[2 * i]);
  images_.resize((images_.size() + 1) / 2);
  remembered_every_ *= 2;
}

std::vector<WideBaselineViews::Remembered*> WideBaselineViews::Choose(Timestamp now,
                                                                      const Rigid3& camera_from_map) {
  std::vector<Remembered*> chosen;
  for (Remembered& earlier : images_) {
    if (ToSeconds(now - earlier.view.image.time) < kMinGap_s) continue;
    const Rotation3 rotation = camera_from_map.rotation * earlier.view.camera_from_map.rotation.inverse();
    if (rotation.Angle() <= kMaxRotation_rad) chosen.push_back(&earlier);
  }
  const auto comes_first = [&](const Remembered* image) {
    return calls_again_ > 0 && image->view.image.time == again_;
  };
  std::stable_sort(chosen.begin(), chosen.end(), [&](const Remembered* x, const Remembered* y) {
    return comes_first(x) != comes_first(y) ? comes_first(x) : x->tried < y->tried;
  });
  if (chosen.size() > kPairsPerCall) chosen.resize(kPairsPerCall);
  return chosen;
}

std::optional<WideBaselineViews::Pair> WideBaselineViews::Match(
    const Remembered& earlier, const CameraImage& image, const Rigid3& camera_from_map,
    const std::vector<DescribedKeypoint>& corners) const {
  const std::vector<int> matched = MatchMutually(earlier.corners, corners);
  const Rotation3 earlier_from_now =
      earlier.view.camera_from_map.rotation * camera_from_map.rotation.inverse();
  Pair pair;
  std::vector<std::pair<int, int>> taken;  // cells of the earlier image, ascending
  for (std::size_t i = 0; i < matched.size(); ++i) {
    if (matched[i] < 0) continue;
    const DescribedKeypoint &a = earlier.corners[i], &b = corners[static_cast<std::size_t>(matched[i])];
    const std::pair<int, int> cell(static_cast<int>(a.pixel.x() / kSamePlacePx),
                                   static_cast<int>(a.pixel.y() / kSamePlacePx));
    const auto place = std::lower_bound(taken.begin(), taken.end(), cell);
    if (place != taken.end() && *place == cell) continue;
    const int level = std::min(a.level, b.level);
    const auto pixel_b = Refine(earlier.view.image, a.pixel.cast<double>(), image, b.pixel.cast<double>(),
                                earlier_from_now, level);
    if (!pixel_b) continue;
    taken.insert(place, cell);
    pair.matches.push_back({a.pixel, pixel_b->cast<float>(), static_cast<std::uint8_t>(level)});
    pair.ids.push_back(static_cast<std::uint32_t>(i));
  }
  if (pair.matches.size() < kMinMatches) return std::nullopt;
  pair.earlier = earlier.view;
  return pair;
}

std::vector<WideBaselineViews::Pair> WideBaselineViews::Pairs(const CameraImage& image,
                                                              const Rigid3& camera_from_map,
                                                              const Eigen::Vector3d& rotation_rate) {
  ++calls_;
  Remembered now;
  now.view = {{image.time, image.features, image.camera}, camera_from_map, rotation_rate};
  now.corners = DescribeCorners(*image.features);
  std::vector<Pair> pairs;
  for (Remembered* const earlier : Choose(image.time, camera_from_map)) {
    earlier->tried = calls_;
    if (auto pair = Match(*earlier, image, camera_from_map, now.corners)) pairs.push_back(std::move(*pair));
  }
  calls_again_ = std::max(0, calls_again_ - 1);
  Remember(std::move(now));
  return pairs;
}

}  // namespace docent::engine
