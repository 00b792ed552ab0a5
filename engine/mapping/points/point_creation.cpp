// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/points/point_creation.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "engine/base/option_check.h"
#include "engine/geometry/image_grid.h"
#include "engine/geometry/triangulation.h"
#include "engine/mapping/points/unmatched_corners.h"

namespace docent::engine {

namespace {

struct DepthRange {
  double near = 0, far = 0;  // map units along the ray
};

// A finite point that the target observes: its pixel and its distance from the camera.
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

// The range to search, from the depths of nearby points, or from the depth statistics of the keyframe if
// there are none.
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

// Maximum search distance for the background, as a ratio of the keyframe's median depth.
constexpr double kFarthestDepths = 30;

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
    target_.features->MarkInUse();
    partner_.features->MarkInUse();
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
  // The appearance of the patch in the partner at the middle of the depth range (harmonic mean).
  std::optional<PredictedPoint> PredictPatch(const Eigen::Vector2f& source_pixel, int level,
                                             const Eigen::Vector3d& ray, const DepthRange& range) {
    MapPoint point;
    // Ids of existing points stay below these, so the searcher's cache cannot confuse them.
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
    if (line_.empty()) return;
    const Eigen::Vector2f chord = line_.back() - line_.front();
    across_ = chord.norm() > 1e-3f ? chord.unitOrthogonal() : Eigen::Vector2f::Zero();
    band_ = options_.epipolar_tolerance_px;
    for (const Eigen::Vector2f& p : line_)
      band_ = std::max(band_, options_.epipolar_tolerance_px + std::abs(across_.dot(p - line_.front())));
  }

  // Lens distortion bends the line only slightly, so this test rejects most corners cheaply.
  bool NearChord(float x, float y) const {
    return std::abs(across_.dot(Eigen::Vector2f(x, y) - line_.front())) <= band_;
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

  // The corner near the line with the highest correlation, if it is unambiguous.
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
      if (corner.x < low.x() - tolerance || corner.x > high.x() + tolerance ||
          !NearChord(corner.x, corner.y) || !NearLine(corner.x, corner.y))
        continue;
      const float correlation = PatchCorrelation(patch, features.levels[level], corner.x, corner.y);
      if (correlation > best) {
        // A corner within four pixels belongs to the same structure and does not make the match ambiguous.
        const bool competitor =
            best_corner && std::abs(best_corner->x - corner.x) + std::abs(best_corner->y - corner.y) > 4;
        if (competitor) second = best;
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
  // Unit vector perpendicular to the line's chord; zero if there is no chord.
  Eigen::Vector2f across_ = Eigen::Vector2f::Zero();
  float band_ = 0;  // half the width of the band about the chord that contains the line
  std::uint32_t scratch_id_ = 0;
};

// The number of points in each cell of the image.
class CellCounts {
 public:
  explicit CellCounts(const CameraModel& camera) : camera_(camera) {}
  int& At(const Eigen::Vector2f& pixel) {  // level 0
    return counts_[GridCell(pixel.cast<int>().eval(), camera_, kColumns, kRows)];
  }

 private:
  static constexpr int kColumns = 8, kRows = 6;
  const CameraModel& camera_;
  std::array<int, kColumns * kRows> counts_{};
};

}  // namespace

std::optional<std::string> PointCreationOptions::Validate() const {
  return OptionCheck()
      .That(std::ranges::all_of(max_points, [](int points) { return points >= 0; }),
            "The number of new points of a level must be at least 0.")
      .AtLeast(min_corner_score, 0, "corner score of a new point")
      .AtLeast(min_faint_corner_score, 0, "corner score of a new point in low texture")
      .AtLeast(few_points, 0, "number of points of a cell in low texture")
      .Positive(min_distance_px, "distance between new points")
      .Positive(epipolar_tolerance_px, "distance from the epipolar line")
      .Within(min_correlation, -1, 1, "correlation of a new point")
      .Ratio(ambiguity_ratio, "ratio of two correlations")
      .Positive(min_parallax_deg, "parallax of a new point")
      .Positive(max_reprojection_sigma, "reprojection error of a new point")
      .fault();
}

std::vector<MapPointId> CreatePoints(const PointCreationOptions& options, KeyFrameId target_id,
                                     KeyFrameId partner_id, Map* map, PointSearcher* searcher) {
  std::vector<MapPointId> created;
  const Map::KeyFrameRecord* target = map->FindKeyFrame(target_id);
  const Map::KeyFrameRecord* partner = map->FindKeyFrame(partner_id);
  if (!target || !partner || target == partner) return created;
  const std::vector<KnownDepth> known = KnownDepths(*map, *target);
  PairSearch search(options, target->keyframe, partner->keyframe, searcher);
  CellCounts cells(*target->keyframe.camera);
  for (const Observation& observation : target->observations) ++cells.At(observation.pixel);
  for (int level = kPyramidLevels - 1; level >= 0; --level) {
    const auto index = static_cast<std::size_t>(level);
    Occupancy occupancy(target->keyframe.features->levels[index], options.min_distance_px);
    int accepted = 0;
    for (const ScoredCorner& scored :
         UnmatchedCorners(*target, index, options.min_faint_corner_score, &occupancy)) {
      if (accepted >= options.max_points[index]) break;
      const Eigen::Vector2f pixel(scored.corner.x, scored.corner.y);
      if (occupancy.Taken(pixel)) continue;
      const Eigen::Vector2d pixel_zero = LevelZeroFromLevel(pixel.cast<double>(), level);
      int& in_cell = cells.At(pixel_zero.cast<float>());
      if (scored.score < options.min_corner_score && in_cell >= options.few_points) continue;
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
      ++in_cell;
      ++accepted;
    }
  }
  return created;
}

namespace {

// The finite point that a keyframe already observes at this pixel; null if there is none.
Map::PointRecord* FinitePointAt(Map* map, const Map::KeyFrameRecord& keyframe, const Eigen::Vector2f& pixel,
                                int level) {
  constexpr float kSamePx = 1.5f;  // of the level
  const float limit = kSamePx * static_cast<float>(1 << level);
  for (const Observation& observation : keyframe.observations) {
    if ((observation.pixel - pixel).squaredNorm() > limit * limit) continue;
    Map::PointRecord* record = map->FindPoint(observation.point);
    if (record && !record->point.infinite()) return record;
  }
  return nullptr;
}

}  // namespace

InfiniteConversion ConvertInfinitePoints(const PointCreationOptions& options, KeyFrameId reference_id,
                                         KeyFrameId partner_id, Map* map, PointSearcher* searcher) {
  InfiniteConversion conversion;
  Map::KeyFrameRecord* reference = map->FindKeyFrame(reference_id);
  Map::KeyFrameRecord* partner = map->FindKeyFrame(partner_id);
  if (!reference || !partner || reference == partner) return conversion;
  PairSearch search(options, reference->keyframe, partner->keyframe, searcher);
  const std::vector<KnownDepth> known = KnownDepths(*map, *reference);
  const std::vector<Observation> observations = reference->observations;
  for (const Observation& observation : observations) {
    Map::PointRecord* record = map->FindPoint(observation.point);
    if (!record || !record->point.infinite() || record->point.source_keyframe != reference_id) continue;
    const auto ray = reference->keyframe.camera->Unproject(observation.pixel.cast<double>());
    if (!ray) continue;
    const int level = record->point.source_level;
    // A point next to known surfaces may be as near as they are; the background may be at any distance.
    DepthRange range = GuessRange(known, reference->keyframe, observation.pixel);
    range.far = std::max(range.far, kFarthestDepths * reference->keyframe.mean_depth);
    const auto match = search.Search(record->point.source_pixel, level, *ray, range);
    if (!match) continue;
    const auto position = search.Intersect(*ray, *match, level);
    if (!position) continue;
    // The map may already contain this point as a finite one, created from elsewhere.
    const MapPointId id = record->point.id;
    if (Map::PointRecord* same = FinitePointAt(map, *partner, match->pixel.cast<float>(), match->level)) {
      const auto reprojected =
          reference->keyframe.camera->Project(reference->keyframe.camera_from_map * same->point.position());
      if (!reprojected || (*reprojected - observation.pixel.cast<double>()).norm() >
                              options.max_reprojection_sigma * (1 << level)) {
        continue;
      }
      const MapPointId same_id = same->point.id;
      map->RemovePoint(id);
      map->AddObservation({reference_id, same_id, observation.pixel, observation.level});
      ++conversion.merged;
      continue;
    }
    map->MakeFinite(record, *position);
    map->AddObservation(
        {partner_id, id, match->pixel.cast<float>(), static_cast<std::uint8_t>(match->level)});
    map->UpdateNormal(map->FindPoint(id));
    conversion.converted.push_back(id);
  }
  return conversion;
}

}  // namespace docent::engine
