// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/point_creation.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "engine/geometry/triangulation.h"

namespace docent::engine {

namespace {

struct DepthRange {
  double near = 0, far = 0;  // metres along the ray
};

// A point of the target that is known already: its pixel and distance.
struct KnownDepth {
  Eigen::Vector2f pixel;
  double distance;
};

std::vector<KnownDepth> KnownDepths(Map& map, const Map::KeyFrameRecord& target) {
  std::vector<KnownDepth> known;
  for (const Observation& observation : target.observations) {
    const Map::PointRecord* point = map.FindPoint(observation.point);
    if (!point || point->point.infinite()) continue;
    const Eigen::Vector3d x = target.keyframe.camera_from_map * point->point.position();
    if (x.z() > 0) known.push_back({observation.pixel, x.norm()});
  }
  return known;
}

// Depths near a pixel say how far to look; where the picture knows nothing, the keyframe's own spread does.
DepthRange GuessRange(const std::vector<KnownDepth>& known, const KeyFrame& target,
                      const Eigen::Vector2f& pixel) {
  constexpr std::size_t kNeighbours = 6;
  std::array<std::pair<float, double>, kNeighbours> nearest;
  nearest.fill({std::numeric_limits<float>::max(), 0});
  for (const KnownDepth& depth : known) {
    const float distance = (depth.pixel - pixel).squaredNorm();
    if (distance >= nearest.back().first) continue;
    std::size_t slot = kNeighbours - 1;
    while (slot > 0 && nearest[slot - 1].first > distance) {
      nearest[slot] = nearest[slot - 1];
      --slot;
    }
    nearest[slot] = {distance, depth.distance};
  }
  const double spread = target.mean_depth + 3 * target.depth_sigma;
  DepthRange range{0.25 * target.mean_depth, 4 * spread};
  if (nearest.back().first < std::numeric_limits<float>::max()) {
    double near = std::numeric_limits<double>::max(), far = 0;
    for (const auto& [distance, depth] : nearest) {
      near = std::min(near, depth);
      far = std::max(far, depth);
    }
    range.near = 0.5 * near;
    range.far = 2.5 * far;
  }
  return range;
}

struct EpipolarMatch {
  Eigen::Vector2d pixel;  // level 0 of the partner
  int level = 0;
};

class PairSearch {
 public:
  PairSearch(const PointCreationOptions& options, const KeyFrame& target, const KeyFrame& partner,
             PointSearcher* searcher)
      : options_(options),
        target_(target),
        partner_(partner),
        searcher_(searcher),
        map_from_target_(target.camera_from_map.inverse()),
        partner_from_target_(partner.camera_from_map * map_from_target_) {}

  std::optional<EpipolarMatch> Search(const Eigen::Vector2f& source_pixel, int level,
                                      const Eigen::Vector3d& ray, const DepthRange& range) {
    const auto predicted = PredictPatch(source_pixel, level, ray, range);
    if (!predicted) return std::nullopt;
    const auto search_level = static_cast<std::size_t>(predicted->level);
    const cv::Mat& image = partner_.features->levels[search_level];
    PatchTemplate patch;
    const float scale = 1.0f / static_cast<float>(1 << predicted->level);
    if (!CutPatch(target_.features->levels[static_cast<std::size_t>(level)], source_pixel,
                  (predicted->pixel_from_source * scale).inverse(), &patch)) {
      return std::nullopt;
    }
    TraceLine(ray, range, predicted->level);
    const Corner* corner = BestCorner(patch, search_level);
    if (!corner) return std::nullopt;
    const auto aligned = AlignPatch(patch, image, {corner->x, corner->y});
    if (!aligned || aligned->correlation < options_.min_correlation) return std::nullopt;
    return EpipolarMatch{LevelZeroFromLevel(aligned->pixel.cast<double>(), predicted->level),
                         predicted->level};
  }

  std::optional<Eigen::Vector3d> Intersect(const Eigen::Vector3d& ray, const EpipolarMatch& match,
                                           int level) const {
    const auto partner_ray = partner_.camera->Unproject(match.pixel);
    if (!partner_ray) return std::nullopt;
    const auto point = Triangulate(ray, *partner_ray, partner_from_target_);
    if (!point) return std::nullopt;
    const double parallax =
        ParallaxAngle(Eigen::Vector3d::Zero(), partner_from_target_.OriginInSource(), *point) * 180 /
        std::numbers::pi;
    if (parallax < options_.min_parallax_deg) return std::nullopt;
    const auto in_target = target_.camera->Project(*point), original = target_.camera->Project(ray);
    const auto in_partner = partner_.camera->Project(partner_from_target_ * *point);
    if (!in_target || !in_partner || !original) return std::nullopt;
    if ((*in_target - *original).norm() > options_.max_reprojection_sigma * (1 << level)) return std::nullopt;
    if ((*in_partner - match.pixel).norm() > options_.max_reprojection_sigma * (1 << match.level))
      return std::nullopt;
    return map_from_target_ * *point;
  }

 private:
  // How the patch would look in the partner if it stood in the middle of the range.
  std::optional<PredictedPoint> PredictPatch(const Eigen::Vector2f& source_pixel, int level,
                                             const Eigen::Vector3d& ray, const DepthRange& range) {
    MapPoint point;
    // Ids of points that exist never reach this one, so the searcher's cache cannot confuse them.
    point.id = kNoId - 1 - (scratch_id_++ % 1024);
    point.source_keyframe = target_.id;
    point.source_level = static_cast<std::uint8_t>(level);
    point.source_pixel = source_pixel;
    point.normal = -(map_from_target_.rotation * ray).cast<float>();
    const double middle = 2.0 / (1.0 / range.near + 1.0 / range.far);
    for (const double distance : {middle, range.far, range.near}) {
      point.point_in_map.head<3>() = map_from_target_ * Eigen::Vector3d(distance * ray);
      const auto predicted = searcher_->Predict(point, target_, *partner_.camera, partner_.camera_from_map);
      if (predicted) return predicted;
    }
    return std::nullopt;
  }

  // The epipolar line as a chain of pixels of the partner's level, uniform in inverse depth.
  void TraceLine(const Eigen::Vector3d& ray, const DepthRange& range, int level) {
    constexpr int kSteps = 14;
    line_.clear();
    for (int i = 0; i <= kSteps; ++i) {
      const double inverse = 1.0 / range.near + (1.0 / range.far - 1.0 / range.near) * i / kSteps;
      const auto pixel = partner_.camera->Project(partner_from_target_ * Eigen::Vector3d(ray / inverse));
      if (pixel && partner_.camera->IsInside(*pixel, -40.0)) {
        line_.push_back(LevelFromLevelZero(*pixel, level).cast<float>());
      }
    }
  }

  bool NearLine(float x, float y) const {
    const float tolerance = options_.epipolar_tolerance_px;
    const Eigen::Vector2f p(x, y);
    if (line_.size() == 1) return (p - line_[0]).squaredNorm() <= tolerance * tolerance;
    for (std::size_t i = 1; i < line_.size(); ++i) {
      const Eigen::Vector2f along = line_[i] - line_[i - 1], offset = p - line_[i - 1];
      const float length = along.squaredNorm();
      const float t = length > 0 ? std::clamp(offset.dot(along) / length, 0.0f, 1.0f) : 0.0f;
      if ((offset - t * along).squaredNorm() <= tolerance * tolerance) return true;
    }
    return false;
  }

  // The corner near the line that resembles the patch most, when no other one comes close.
  const Corner* BestCorner(const PatchTemplate& patch, std::size_t level) const {
    if (line_.empty()) return nullptr;
    Eigen::Vector2f low = line_[0], high = line_[0];
    for (const Eigen::Vector2f& p : line_) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    const float tolerance = options_.epipolar_tolerance_px;
    const ImageFeatures& features = *partner_.features;
    const int rows = features.levels[level].rows;
    const int first = std::clamp(static_cast<int>(low.y() - tolerance), 0, rows);
    const int last = std::clamp(static_cast<int>(high.y() + tolerance) + 1, 0, rows);
    const Corner* best_corner = nullptr;
    float best = options_.min_correlation - 0.1f, second = -1;
    for (int i = features.row_begin[level][static_cast<std::size_t>(first)];
         i < features.row_begin[level][static_cast<std::size_t>(last)]; ++i) {
      const Corner& corner = features.corners[level][static_cast<std::size_t>(i)];
      if (corner.x < low.x() - tolerance || corner.x > high.x() + tolerance || !NearLine(corner.x, corner.y))
        continue;
      const float correlation = PatchCorrelation(patch, features.levels[level], corner.x, corner.y);
      if (correlation > best) {
        // A neighbour on the same structure is no rival.
        const bool rival =
            best_corner && std::abs(best_corner->x - corner.x) + std::abs(best_corner->y - corner.y) > 4;
        if (rival) second = best;
        best = correlation;
        best_corner = &corner;
      } else if (best_corner &&
                 std::abs(best_corner->x - corner.x) + std::abs(best_corner->y - corner.y) > 4) {
        second = std::max(second, correlation);
      }
    }
    if (!best_corner || (1 - best) > options_.ambiguity_ratio * (1 - second)) return nullptr;
    return best_corner;
  }

  const PointCreationOptions& options_;
  const KeyFrame& target_;
  const KeyFrame& partner_;
  PointSearcher* searcher_;
  Rigid3 map_from_target_, partner_from_target_;
  std::vector<Eigen::Vector2f> line_;
  std::uint32_t scratch_id_ = 0;
};

// Which places of a level are taken: a coarse raster about the matched features.
class Occupancy {
 public:
  Occupancy(const cv::Mat& image, float cell)
      : cell_(cell), columns_(static_cast<int>(static_cast<float>(image.cols) / cell) + 1) {
    taken_.resize(static_cast<std::size_t>(columns_) *
                  (static_cast<std::size_t>(static_cast<float>(image.rows) / cell) + 1));
  }
  void Take(const Eigen::Vector2f& pixel) {
    const std::size_t at = Index(pixel);
    if (at < taken_.size()) taken_[at] = true;
  }
  bool Taken(const Eigen::Vector2f& pixel) const {
    const std::size_t at = Index(pixel);
    return at >= taken_.size() || taken_[at];
  }

 private:
  std::size_t Index(const Eigen::Vector2f& pixel) const {
    return static_cast<std::size_t>(static_cast<int>(pixel.y() / cell_) * columns_ +
                                    static_cast<int>(pixel.x() / cell_));
  }
  float cell_;
  int columns_;
  std::vector<bool> taken_;
};

struct ScoredCorner {
  float score;
  Corner corner;
};

std::vector<ScoredCorner> FreeCorners(const PointCreationOptions& options, const Map::KeyFrameRecord& target,
                                      std::size_t level, Occupancy* occupancy) {
  const ImageFeatures& features = *target.keyframe.features;
  const cv::Mat& image = features.levels[level];
  for (const Observation& observation : target.observations) {
    // A point of a neighbouring level stands for the same structure.
    if (std::abs(static_cast<int>(observation.level) - static_cast<int>(level)) > 1) continue;
    occupancy->Take(
        LevelFromLevelZero(observation.pixel.cast<double>(), static_cast<int>(level)).cast<float>());
  }
  std::vector<ScoredCorner> corners;
  for (const Corner& corner : features.corners[level]) {
    if (!PatchFits(image, corner.x, corner.y, 2.0f) || occupancy->Taken({corner.x, corner.y})) continue;
    const float score = ShiTomasiScore(image, corner.x, corner.y);
    if (score >= options.min_corner_score) corners.push_back({score, corner});
  }
  std::stable_sort(corners.begin(), corners.end(),
                   [](const ScoredCorner& a, const ScoredCorner& b) { return a.score > b.score; });
  return corners;
}

}  // namespace

std::vector<MapPointId> CreatePoints(const PointCreationOptions& options, KeyFrameId target_id,
                                     KeyFrameId partner_id, Map* map, PointSearcher* searcher) {
  std::vector<MapPointId> created;
  const Map::KeyFrameRecord* target = map->FindKeyFrame(target_id);
  const Map::KeyFrameRecord* partner = map->FindKeyFrame(partner_id);
  if (!target || !partner || target == partner) return created;
  const std::vector<KnownDepth> known = KnownDepths(*map, *target);
  PairSearch search(options, target->keyframe, partner->keyframe, searcher);
  for (int level = kPyramidLevels - 1; level >= 0; --level) {
    const auto index = static_cast<std::size_t>(level);
    Occupancy occupancy(target->keyframe.features->levels[index], options.min_distance_px);
    int accepted = 0;
    for (const ScoredCorner& scored : FreeCorners(options, *target, index, &occupancy)) {
      if (accepted >= options.max_points[index]) break;
      const Eigen::Vector2f pixel(scored.corner.x, scored.corner.y);
      if (occupancy.Taken(pixel)) continue;
      const Eigen::Vector2d pixel_zero = LevelZeroFromLevel(pixel.cast<double>(), level);
      const auto ray = target->keyframe.camera->Unproject(pixel_zero);
      if (!ray) continue;
      const DepthRange range = GuessRange(known, target->keyframe, pixel_zero.cast<float>());
      const auto match = search.Search(pixel, level, *ray, range);
      if (!match) continue;
      const auto position = search.Intersect(*ray, *match, level);
      if (!position) continue;
      MapPoint point;
      point.point_in_map << *position, 1.0;
      point.source_keyframe = target_id;
      point.source_level = static_cast<std::uint8_t>(level);
      point.source_pixel = pixel;
      const MapPointId id = map->AddPoint(point);
      map->AddObservation({target_id, id, pixel_zero.cast<float>(), static_cast<std::uint8_t>(level)});
      map->AddObservation(
          {partner_id, id, match->pixel.cast<float>(), static_cast<std::uint8_t>(match->level)});
      map->UpdateNormal(map->FindPoint(id));
      occupancy.Take(pixel);
      created.push_back(id);
      ++accepted;
    }
  }
  return created;
}

}  // namespace docent::engine
