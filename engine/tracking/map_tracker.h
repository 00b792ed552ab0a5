// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/random.h"
#include "engine/map/map_snapshot.h"
#include "engine/matching/point_search.h"
#include "engine/matching/pose_refinement.h"
#include "engine/tracking/frame_inspection.h"
#include "engine/tracking/nearby_points.h"
#include "engine/tracking/rotation_center.h"
#include "engine/tracking/tracked_frame.h"
#include "engine/vision/rim_mask.h"

// Estimates the pose of one frame in one map from a predicted pose: coarse stage, fine stage, robust pose
// estimate (ptamm §2.1). It does not model time; motion prediction and relocalization belong to the Tracker.
namespace docent::engine {

struct MapTrackerOptions {
  int max_coarse = 60;                  // ptamm §2.1: up to 50 on the top levels
  int min_coarse = 12;                  // With fewer points found the coarse stage does not update the pose.
  int max_relocalization = 220;         // patches of the upper levels that are searched after a loss
  double relocalization_inlier_px = 5;  // level-0 pixels; keypoints of upper levels are no more accurate
  int max_fine = 600;  // ptamm §2.1 allows 1000; above 600 no improvement of the pose was measurable
  float coarse_radius_px = 30;  // search radius of the coarse stage, level-0 pixels
  float wide_radius_px = 70;    // coarse radius of the second attempt, before a frame counts as lost
  float fine_radius_px = 7;     // fine radius after a coarse pose
  float fine_radius_without_coarse_px = 14;  // fine radius when the coarse stage estimated no pose
  // Search radius of infinite points. The camera's translation since the panorama map was opened shifts their
  // projections, all by about the same amount, so that they still determine the rotation when no finite
  // points are left.
  float infinite_radius_px = 20;
  int max_infinite = 250;       // infinite points searched per frame when a panorama map is enabled
  int min_points_per_cell = 2;  // inliers that a cell of the coverage grid needs (hybrid-slam §4.1)
  NearbyPointOptions nearby;
  SearchOptions search;
  PoseRefinementOptions refinement;

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

struct MapTrackResult {
  Rigid3 camera_from_map;
  Rigid3 camera_from_map_without_prior;  // the pose without the rotation prior, see PoseRefinement
  bool used_center = false;              // the predicted centre is part of the pose
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  ObservedMotion observed = ObservedMotion::kSixDof;
  int attempted = 0, found = 0, inliers = 0;
  int skipped_as_occluded = 0;  // points in view that were not searched because they were missed repeatedly
  int finite_inliers = 0;       // contained in `inliers`
  // Ratio of the cells of a 4x3 image grid that hold enough inliers, of finite points and of all points
  // (hybrid-slam §4.1).
  double finite_coverage = 0, coverage = 0;
  double sigma = 0;  // robust, of the normalized residuals
  // Cells of a 4x4 image grid with an inlier; measures how well the inliers are spread.
  int occupied_cells = 0;
  // Of the points that were searched: the ratio of those in parts of the image where hardly any was an
  // inlier. Occlusion causes this too; where it is large, the place may be another one with some of the same
  // objects.
  double contradicted_ratio = 0;
  // The same ratio of the parts themselves, cells of an 8x6 image grid. An object with many points does not
  // outweigh all others here.
  double contradicted_area = 0;
  bool converged = false;
  double median_depth = 0;  // map units, of the finite inliers
  // Inlier ratio: inliers / attempted (ptamm §2.1).
  double Quality() const { return attempted > 0 ? static_cast<double>(inliers) / attempted : 0; }
  // Visible inlier ratio: inliers over all points in view, including those skipped as occluded. Used to
  // compare maps.
  double VisibleInlierRatio() const {
    return inliers > 0 ? static_cast<double>(inliers) / (attempted + skipped_as_occluded) : 0;
  }
};

class MapTracker {
 public:
  MapTracker(const MapTrackerOptions& options, std::shared_ptr<const CameraModel> camera);

  enum class Effort {
    kStandard,  // the prediction is reliable
    kWide,      // after unexpected motion: larger search radii
    // After a loss, when the prediction may be wrong: largest search radius on the upper levels, then a pose
    // by RANSAC.
    kRelocalization,
  };
  // Estimates the pose. matches() returns the matches of the last call. camera_at_pose: as in RefinePose, for
  // the fine stage.
  MapTrackResult Track(const MapSnapshot& map, const ImageFeatures& features, const Rigid3& predicted,
                       Effort effort, Random* random, const CameraAtPose& camera_at_pose = nullptr);
  // One per match, with the weights of the last estimate.
  const std::vector<PoseMeasurement>& measurements() const { return measurements_; }
  // The rotation centre to assume where the translation cannot be observed.
  void SetPivot(const PivotEstimate& pivot) { pivot_estimate_ = pivot; }
  // The camera centre to expect in the next calls, until it is set again; empty if it is not known.
  void SetPredictedCenter(const std::optional<PredictedPosition>& center) { predicted_center_ = center; }

  const std::vector<PointMatch>& matches() const { return matches_; }
  // Each point searched in the last call: whether it was found, and whether it was an inlier.
  struct Attempt {
    MapPointId point;
    bool found, inlier;
    std::uint8_t cell = 0;  // of the image, where the point was predicted
  };
  const std::vector<Attempt>& attempts() const { return attempts_; }
  // A record of the last call of Track, evaluated at this pose. The snapshot given to Track must still exist.
  // The caller sets the image's features.
  FrameInspection Inspect(const Rigid3& camera_from_map) const;
  // Sets the camera model of the images from the next one on.
  void SetCamera(std::shared_ptr<const CameraModel> camera) { camera_ = std::move(camera); }
  // To be called before another map is tracked.
  void Clear();
  // Searches the infinite points of this panorama map in addition to the finite points; kNoId disables it.
  void EnablePanorama(PanoramaId panorama) { panorama_ = panorama; }
  // Points that project outside the image circle are not searched. Null for none; must outlive its use.
  void SetRim(const RimMask* rim) { rim_ = rim; }
  PanoramaId panorama() const { return panorama_; }
  // Selects how patches are compared from now on; kStandard initially.
  void SetComparison(PatchComparison comparison) { searcher_.SetComparison(comparison); }
  // To be called when the pose of the last frame was rejected: the next frame selects its points by the
  // predicted pose alone.
  void ForgetLastFrame() {
    last_inliers_.clear();
    nearby_.ForgetLastFrame();
    order_frame_ += kOrderFrames;
  }
  // To be called when the pose of the last frame was accepted. Records which points were not inliers, so that
  // points that are probably occluded are searched less often until they are found again.
  void RecordMisses();

 private:
  static constexpr std::uint64_t kOrderFrames = 32;  // about a second
  struct Candidate {
    const MapPoint* point;
    const KeyFrame* source;
    Eigen::Vector4d point_in_map;
    PredictedPoint predicted;
  };
  void CollectVisible(const MapSnapshot& map, const Rigid3& camera_from_map, Random* random);
  void Project(const std::vector<NearbyPoint>& points, bool infinite, const Rigid3& camera_from_map);
  void SetSearchOrder();
  void AddCandidates(const Rigid3& camera_from_map, std::size_t wanted, Random* random);
  bool ShouldSearch(MapPointId point, Random* random) const;
  void Refine(const Rigid3& predicted, const CameraAtPose& camera_at_pose, MapTrackResult* result);
  void CountInliers(MapTrackResult* result);
  void Search(const std::vector<std::uint32_t>& which, const ImageFeatures& features, float radius,
              bool direct);
  std::optional<Rigid3> PoseFromPatches(const ImageFeatures& features, Random* random);
  void Repredict(const Rigid3& camera_from_map);

  MapTrackerOptions options_;
  std::shared_ptr<const CameraModel> camera_;
  PointSearcher searcher_;
  const RimMask* rim_ = nullptr;
  Rigid3 predicted_;  // pose that the last search started from
  PanoramaId panorama_ = kNoId;
  PivotEstimate pivot_estimate_;
  std::optional<PredictedPosition> predicted_center_;
  std::vector<PointMatch> matches_;
  std::vector<Attempt> attempts_;
  std::vector<MapPointId> last_inliers_;  // of the last frame, by ascending id
  struct Misses {
    MapPointId point = kNoId;
    std::uint8_t in_a_row = 0;
  };
  std::vector<Misses> misses_;  // direct-mapped cache: slot id % size
  // Counts searches; each point gets a new position in the search order every kOrderFrames.
  std::uint64_t order_frame_ = 0;
  NearbyPoints nearby_;
  // Scratch memory, kept to avoid allocations.
  std::vector<NearbyPoint> visible_;
  std::vector<std::uint8_t> bins_;    // bin of each visible_ point
  std::vector<std::uint32_t> order_;  // order in which visible_ is searched
  int visible_finite_ = 0, skipped_as_occluded_ = 0;
  std::vector<std::uint8_t> projected_cells_;  // image cells that hold a projected point already
  std::vector<Candidate> candidates_;
  std::vector<std::uint32_t> coarse_, fine_;
  std::vector<std::uint32_t> measured_;  // candidate index of each measurement
  std::vector<PoseMeasurement> measurements_;
  PoseRefinementMemory memory_;
  std::vector<double> depths_;
};

}  // namespace docent::engine
