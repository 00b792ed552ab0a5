// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/map_tracker.h"

#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <span>

#include "engine/base/option_check.h"
#include "engine/geometry/image_grid.h"
#include "engine/recognition/absolute_pose.h"

namespace docent::engine {

namespace {

constexpr int kSpreadCells = 4;  // rows and columns of the grid that measures the spread of inliers
constexpr int kCoverageColumns = 4, kCoverageRows = 3;  // hybrid-slam §4.1
constexpr int kContradictionColumns = 8, kContradictionRows = 6;
// An infinite point is skipped if a finite point, or another infinite one, projects into the same cell
// (hybrid-slam §3.1).
constexpr int kProjectedCellPx = 16;
constexpr std::size_t kMissesSlots = 16384;
constexpr std::uint8_t kMaxMisses = 4;  // consecutive misses are counted up to this value

// See MapTrackResult::contradicted_ratio and contradicted_area.
void SetContradictedRatios(std::span<const MapTracker::Attempt> attempts, MapTrackResult* result) {
  struct Count {
    int searched = 0, inliers = 0;
  };
  std::array<Count, kContradictionColumns * kContradictionRows> cells{};
  for (const MapTracker::Attempt& attempt : attempts) {
    ++cells[attempt.cell].searched;
    if (attempt.inlier) ++cells[attempt.cell].inliers;
  }
  // At an inlier ratio of 0.4, none of five, and at most one inlier of ten, have probabilities of 0.08 and
  // 0.05.
  constexpr int kMinSearchedOfArea = 5, kMinSearched = 8;
  constexpr double kMaxRatio = 0.1;
  constexpr int kMinPoints = 60;  // fewer points lie in too few cells
  int points = 0, contradicted_points = 0, area = 0, contradicted_area = 0;
  for (const Count& cell : cells) {
    const bool contradicts = cell.inliers <= kMaxRatio * cell.searched;
    if (cell.searched >= kMinSearchedOfArea) {
      ++area;
      if (contradicts) ++contradicted_area;
    }
    if (cell.searched >= kMinSearched) {
      points += cell.searched;
      if (contradicts) contradicted_points += cell.searched;
    }
  }
  const bool judged = points >= kMinPoints;
  result->contradicted_ratio = judged ? static_cast<double>(contradicted_points) / points : 0;
  result->contradicted_area = judged ? static_cast<double>(contradicted_area) / area : 0;
}

}  // namespace

std::optional<std::string> MapTrackerOptions::Validate() const {
  return OptionCheck()
      .AtLeast(min_coarse, 0, "number of coarse points")
      .AtLeast(max_coarse, min_coarse, "largest number of coarse points")
      .AtLeast(max_relocalization, 1, "number of points after a loss")
      .Positive(relocalization_inlier_px, "distance of an inlier after a loss")
      .AtLeast(max_fine, 1, "number of fine points")
      .Positive(coarse_radius_px, "coarse search radius")
      .Positive(wide_radius_px, "wide search radius")
      .Positive(fine_radius_px, "fine search radius")
      .Positive(fine_radius_without_coarse_px, "fine search radius without a coarse pose")
      .Positive(infinite_radius_px, "search radius of infinite points")
      .AtLeast(max_infinite, 0, "number of infinite points")
      .AtLeast(min_points_per_cell, 1, "number of points in a covered cell")
      .Contained(nearby.Validate())
      .Contained(search.Validate())
      .Contained(refinement.Validate())
      .fault();
}

MapTracker::MapTracker(const MapTrackerOptions& options, std::shared_ptr<const CameraModel> camera)
    : options_(Checked(options)),
      camera_(std::move(camera)),
      searcher_(options.search),
      nearby_(options.nearby) {}

void MapTracker::Clear() {
  searcher_.Clear();
  misses_.clear();
  ForgetLastFrame();
}

// Collects the points that project into the image in visible_.
void MapTracker::Project(const std::vector<NearbyPoint>& points, bool infinite,
                         const Rigid3& camera_from_map) {
  visible_.clear();
  const Eigen::Matrix3d rotation = camera_from_map.rotation.matrix();
  const Eigen::Vector3d translation = camera_from_map.translation;
  const double min_cosine = options_.search.min_view_cosine;
  const int columns = camera_->width_px() / kProjectedCellPx + 1;
  // Where the rolling shutter moves a point by a few pixels does not matter here.
  const CameraModel& lens = camera_->WithoutMotion();
  for (const NearbyPoint& local : points) {
    const Eigen::Vector3d x = rotation * local.point_in_map.head<3>() + local.point_in_map[3] * translation;
    if (!(x.z() > 0)) continue;
    const Eigen::Vector3d normal = rotation * local.normal.cast<double>();
    const double facing = -normal.dot(x);
    if (facing <= 0 || facing * facing < min_cosine * min_cosine * x.squaredNorm()) continue;
    const auto pixel = lens.Project(x);
    if (!pixel || !camera_->IsInside(*pixel, kPatchSize / 2)) continue;
    if (rim_ && !rim_->IsInside(*pixel, 0)) continue;
    std::uint8_t& cell =
        projected_cells_[static_cast<std::size_t>(static_cast<int>(pixel->y()) / kProjectedCellPx * columns +
                                                  static_cast<int>(pixel->x()) / kProjectedCellPx)];
    if (infinite && cell != 0) continue;
    cell = 1;
    visible_.push_back(local);
  }
}

void MapTracker::RecordMisses() {
  misses_.resize(kMissesSlots);
  for (const Attempt& attempt : attempts_) {
    Misses& misses = misses_[attempt.point % kMissesSlots];
    if (misses.point != attempt.point) misses = {attempt.point, 0};
    misses.in_a_row =
        attempt.inlier ? std::uint8_t{0} : std::min<std::uint8_t>(misses.in_a_row + 1, kMaxMisses);
  }
}

// The probability of a search falls with the number of consecutive misses, but never to zero: the occluder
// may be gone.
bool MapTracker::ShouldSearch(MapPointId point, Random* random) const {
  if (misses_.empty()) return true;
  const Misses& misses = misses_[point % kMissesSlots];
  if (misses.point != point || misses.in_a_row == 0) return true;
  return random->Below(1 + misses.in_a_row) == 0;
}

// Determines the search order of visible_. It is pseudo-random, so that a subset is spread over the image and
// the map, but mostly the same as in the previous frame: warped patches remain valid, and the pose does not
// jitter with the selection. Each point gets a new position once in kOrderFrames frames.
void MapTracker::SetSearchOrder() {
  constexpr std::size_t kBins = 256;
  std::array<std::uint32_t, kBins + 1> begin{};
  bins_.clear();
  for (const NearbyPoint& local : visible_) {
    const std::uint64_t draw = (order_frame_ + local.id) / kOrderFrames;
    const auto bin = static_cast<std::uint8_t>(Random(std::uint64_t{local.id} << 32 ^ draw).Next() >> 56);
    bins_.push_back(bin);
    ++begin[bin + std::size_t{1}];
  }
  for (std::size_t bin = 0; bin < kBins; ++bin) begin[bin + 1] += begin[bin];
  order_.resize(visible_.size());
  for (std::size_t i = 0; i < visible_.size(); ++i) order_[begin[bins_[i]]++] = static_cast<std::uint32_t>(i);
}

void MapTracker::AddCandidates(const Rigid3& camera_from_map, std::size_t wanted, Random* random) {
  SetSearchOrder();
  const std::size_t before = candidates_.size();
  for (const std::uint32_t which : order_) {
    if (candidates_.size() - before >= wanted) break;
    const NearbyPoint& local = visible_[which];
    if (!ShouldSearch(local.id, random)) {
      ++skipped_as_occluded_;
      continue;
    }
    const auto predicted =
        searcher_.Predict(*local.point, *local.source, *camera_, camera_from_map, local.point_in_map);
    if (predicted) candidates_.push_back({local.point, local.source, local.point_in_map, *predicted});
  }
  const std::size_t count = candidates_.size() - before;
  if (count == 0) return;
  // The start is random, so that large patches that fail are not searched first again in the next frame.
  const std::size_t first = random->Below(static_cast<std::uint32_t>(count));
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t index = before + (first + i) % count;
    const bool top =
        candidates_[index].predicted.level >= 2 && static_cast<int>(coarse_.size()) < options_.max_coarse;
    (top ? coarse_ : fine_).push_back(static_cast<std::uint32_t>(index));
  }
}

void MapTracker::CollectVisible(const MapSnapshot& map, const Rigid3& camera_from_map, Random* random) {
  candidates_.clear();
  coarse_.clear();
  fine_.clear();
  skipped_as_occluded_ = 0;
  ++order_frame_;
  projected_cells_.assign(static_cast<std::size_t>((camera_->width_px() / kProjectedCellPx + 1) *
                                                   (camera_->height_px() / kProjectedCellPx + 1)),
                          0);
  nearby_.Update(map, camera_from_map, last_inliers_, panorama_, pivot_estimate_.pivot);
  Project(nearby_.finite(), false, camera_from_map);
  visible_finite_ = static_cast<int>(visible_.size());
  AddCandidates(camera_from_map, static_cast<std::size_t>(options_.max_fine), random);
  if (panorama_ == kNoId) return;
  Project(nearby_.infinite(), true, camera_from_map);
  AddCandidates(camera_from_map, static_cast<std::size_t>(options_.max_infinite), random);
}

void MapTracker::Search(const std::vector<std::uint32_t>& which, const ImageFeatures& features, float radius,
                        bool direct) {
  for (const std::uint32_t index : which) {
    const Candidate& candidate = candidates_[index];
    const float reach = candidate.point->infinite() ? std::max(radius, options_.infinite_radius_px) : radius;
    const auto found =
        searcher_.Find(*candidate.point, *candidate.source, candidate.predicted, features, reach, direct);
    const std::size_t cell =
        GridCell(candidate.predicted.pixel, *camera_, kContradictionColumns, kContradictionRows);
    attempts_.push_back({candidate.point->id, found.has_value(), false, static_cast<std::uint8_t>(cell)});
    if (!found) continue;
    measured_.push_back(index);
    measurements_.push_back({candidate.point_in_map, found->pixel.cast<double>(),
                             1.0 / static_cast<double>(1 << candidate.predicted.level), 1.0,
                             candidate.point->infinite()});
    matches_.push_back(
        {candidate.point->id, found->pixel, static_cast<std::uint8_t>(candidate.predicted.level), false});
  }
}

void MapTracker::Repredict(const Rigid3& camera_from_map) {
  std::size_t kept = 0;
  for (const std::uint32_t index : fine_) {
    Candidate& candidate = candidates_[index];
    if (searcher_.Repredict(*candidate.point, *camera_, camera_from_map, candidate.point_in_map,
                            &candidate.predicted))
      fine_[kept++] = index;
  }
  fine_.resize(kept);
}

// The search is wide and many of these matches are wrong; three-point RANSAC finds the consistent ones.
std::optional<Rigid3> MapTracker::PoseFromPatches(const ImageFeatures& features, Random* random) {
  std::vector<std::uint32_t> chosen = coarse_;
  for (const std::uint32_t index : fine_) {
    if (static_cast<int>(chosen.size()) >= options_.max_relocalization) break;
    if (candidates_[index].predicted.level >= 1) chosen.push_back(index);
  }
  Search(chosen, features, options_.wide_radius_px, false);
  std::vector<Eigen::Vector3d> rays, points;
  for (const PoseMeasurement& measurement : measurements_) {
    const auto ray = camera_->Unproject(measurement.pixel);
    if (!ray || measurement.infinite()) continue;
    rays.push_back(*ray);
    points.push_back(measurement.point_in_map.head<3>());
  }
  AbsolutePoseOptions options;
  options.pixel_angle = camera_->PixelAngle();
  options.inlier_px = options_.relocalization_inlier_px;
  options.min_inliers = options_.min_coarse;
  options.seed = random->Next();
  const auto pose = EstimateAbsolutePose(rays, points, options);
  if (!pose) return std::nullopt;
  return pose->camera_from_map;
}

MapTrackResult MapTracker::Track(const MapSnapshot& map, const ImageFeatures& features,
                                 const Rigid3& predicted, Effort effort, Random* random,
                                 const CameraAtPose& camera_at_pose) {
  MapTrackResult result;
  result.camera_from_map = predicted_ = predicted;
  matches_.clear();
  attempts_.clear();
  measured_.clear();
  measurements_.clear();
  CollectVisible(map, predicted, random);

  if (effort == Effort::kRelocalization) {
    // RANSAC needs finite points. Infinite points are searched from the prediction, which includes the
    // rotation of the whole image.
    if (!nearby_.infinite().empty() && panorama_ != kNoId && visible_finite_ < options_.min_coarse)
      return Track(map, features, predicted, Effort::kWide, random, camera_at_pose);
    const auto pose = PoseFromPatches(features, random);
    if (!pose) return result;
    ForgetLastFrame();
    return Track(map, features, *pose, Effort::kStandard, random, camera_at_pose);
  }
  const bool wide = effort == Effort::kWide;
  Search(coarse_, features, wide ? options_.wide_radius_px : options_.coarse_radius_px, false);
  float radius = wide ? options_.coarse_radius_px : options_.fine_radius_without_coarse_px;
  if (static_cast<int>(measurements_.size()) >= options_.min_coarse) {
    const PoseRefinement coarse =
        RefinePose(*camera_, predicted, options_.refinement, &measurements_, &memory_,
                   {pivot_estimate_.pivot, predicted, pivot_estimate_.reliable});
    if (coarse.converged && coarse.inliers >= options_.min_coarse / 2) {
      result.camera_from_map = coarse.camera_from_map;
      radius = options_.fine_radius_px;
      Repredict(coarse.camera_from_map);
    }
  }
  Search(fine_, features, radius, true);
  result.attempted = static_cast<int>(attempts_.size());
  result.skipped_as_occluded = skipped_as_occluded_;
  result.found = static_cast<int>(measurements_.size());
  Refine(predicted, camera_at_pose, &result);
  return result;
}

void MapTracker::Refine(const Rigid3& predicted, const CameraAtPose& camera_at_pose, MapTrackResult* result) {
  const std::shared_ptr<const CameraModel> camera = camera_;  // camera_at_pose may set another one
  const PoseRefinement fine = RefinePose(
      *camera, result->camera_from_map, options_.refinement, &measurements_, &memory_,
      {pivot_estimate_.pivot, predicted, pivot_estimate_.reliable, predicted_center_}, camera_at_pose);
  result->camera_from_map = fine.camera_from_map;
  result->camera_from_map_without_prior = fine.camera_from_map_without_prior;
  result->used_center = fine.used_center;
  result->covariance = fine.covariance;
  result->observed = fine.observed;
  result->converged = fine.converged;
  result->sigma = fine.sigma;
  CountInliers(result);
}

void MapTracker::CountInliers(MapTrackResult* result) {
  std::bitset<kSpreadCells * kSpreadCells> cells;
  std::array<int, kCoverageColumns * kCoverageRows> finite{}, all{};
  depths_.clear();
  last_inliers_.clear();
  std::size_t match = 0;
  for (Attempt& attempt : attempts_) {
    if (!attempt.found) continue;
    const PoseMeasurement& measurement = measurements_[match];
    attempt.inlier = matches_[match].inlier = measurement.weight > options_.refinement.min_weight;
    ++match;
    if (!attempt.inlier) continue;
    ++result->inliers;
    cells.set(GridCell(measurement.pixel, *camera_, kSpreadCells, kSpreadCells));
    const std::size_t cell = GridCell(measurement.pixel, *camera_, kCoverageColumns, kCoverageRows);
    ++all[cell];
    last_inliers_.push_back(attempt.point);
    if (measurement.infinite()) continue;
    ++result->finite_inliers;
    ++finite[cell];
    depths_.push_back((result->camera_from_map * measurement.point_in_map).z());
  }
  SetContradictedRatios(attempts_, result);
  std::sort(last_inliers_.begin(), last_inliers_.end());
  result->occupied_cells = static_cast<int>(cells.count());
  const auto share = [&](const auto& counts) {
    return static_cast<double>(std::count_if(counts.begin(), counts.end(),
                                             [&](int n) { return n >= options_.min_points_per_cell; })) /
           static_cast<double>(counts.size());
  };
  result->finite_coverage = share(finite);
  result->coverage = share(all);
  if (!depths_.empty()) {
    const auto middle = depths_.begin() + static_cast<std::ptrdiff_t>(depths_.size() / 2);
    std::nth_element(depths_.begin(), middle, depths_.end());
    result->median_depth = *middle;
  }
}

FrameInspection MapTracker::Inspect(const Rigid3& camera_from_map) const {
  FrameInspection inspection;
  inspection.predicted = predicted_;
  inspection.visible_points = visible_finite_;
  inspection.panorama = panorama_;
  // After a relocalization search without a pose not all candidates were attempted.
  std::vector<std::uint32_t> order = coarse_;
  order.insert(order.end(), fine_.begin(), fine_.end());
  if (order.size() != attempts_.size()) return inspection;
  std::size_t match = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const Candidate& candidate = candidates_[order[i]];
    InspectedPoint& point = inspection.points.emplace_back();
    point.point = candidate.point->id;
    point.infinite = candidate.point->infinite();
    point.level = candidate.predicted.level;
    point.predicted = candidate.predicted.pixel;
    if (!attempts_[i].found) continue;
    const PoseMeasurement& measurement = measurements_[match++];
    point.found = measurement.pixel;
    point.weight = measurement.weight;
    point.inlier = attempts_[i].inlier;
    const Eigen::Vector4d in_camera = camera_from_map * measurement.point_in_map;
    if (const auto pixel = camera_->Project(in_camera.head<3>()))
      point.residual_px = measurement.pixel - *pixel;
  }
  return inspection;
}

}  // namespace docent::engine
