// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "engine/base/random.h"
#include "engine/map/map_snapshot.h"
#include "engine/tracking/frame_inspection.h"
#include "engine/tracking/nearby_points.h"
#include "engine/tracking/point_search.h"
#include "engine/tracking/pose_refinement.h"
#include "engine/tracking/rotation_center.h"
#include "engine/tracking/tracked_frame.h"

// Finds the pose of one frame in one map from a guess: coarse stage, fine stage, robust pose (ptamm §2.1).
// Knows nothing of time: prediction, loss and recovery are the Tracker's.
namespace docent::engine {

struct MapTrackerOptions {
  int max_coarse = 60;              // ptamm §2.1: up to 50 on the top levels
  int min_coarse = 12;              // found ones, for the coarse pose to be believed
  int max_recovery = 220;           // patches of the upper levels looked for after a loss
  double recovery_inlier_px = 5;    // level 0: corners of upper levels are that coarse
  int max_fine = 600;               // ptamm §2.1 allows 1000; beyond 600 the pose gains nothing that shows
  float coarse_radius_px = 30;      // level 0, about the prediction
  float wide_radius_px = 70;        // the second try before a frame is called lost
  float fine_radius_px = 7;         // after a coarse pose
  float fine_radius_alone_px = 14;  // when the coarse stage had nothing to say
  // Infinite points are off their prediction by what the camera has moved since its panorama map was opened;
  // all by about the same, so that they still tell the rotation when the finite points are gone.
  float infinite_radius_px = 20;
  int max_infinite = 250;     // of the points, where a panorama map is enabled
  int min_points_a_cell = 2;  // for a cell of the coverage grid to count as covered (hybrid-slam §4.1)
  NearbyPointOptions nearby;
  SearchOptions search;
  PoseRefinementOptions refinement;
};

struct MapTrackResult {
  Rigid3 camera_from_map;
  Rigid3 camera_from_map_without_prior;  // without the turn that was expected, see PoseRefinement
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  ObservedMotion observed = ObservedMotion::kSixDof;
  int attempted = 0, found = 0, inliers = 0;
  int skipped_as_occluded = 0;  // points in view that were not looked for, as they have long been hidden
  int finite_inliers = 0;       // of the inliers
  // Shares of a 4x3 grid over the image in which enough inliers lie, finite ones and all (hybrid-slam
  // §4.1).
  double finite_coverage = 0, coverage = 0;
  int coarse_attempted = 0, coarse_found = 0;
  double sigma = 0;        // robust, of the normalised residuals
  int occupied_cells = 0;  // of a 4x4 grid over the image: how well the inliers are spread
  bool converged = false;
  double median_depth = 0;  // metres, of the inliers
  // found / attempted (ptamm §2.1).
  double Quality() const { return attempted > 0 ? static_cast<double>(inliers) / attempted : 0; }
  // How much of the map in view is seen, hidden points among it: tells maps from each other.
  double VisibleInlierRatio() const {
    return inliers > 0 ? static_cast<double>(inliers) / (attempted + skipped_as_occluded) : 0;
  }
};

class MapTracker {
 public:
  MapTracker(const MapTrackerOptions& options, std::shared_ptr<const CameraModel> camera);

  enum class Effort {
    kStandard,  // the prediction is a good one
    kWide,      // the motion was a surprise: look further
    kRecovery,  // the guess may be altogether wrong: look far, and stop early where the large patches
                // disagree
  };
  // Estimates the pose. The matches of the last call stay in matches().
  MapTrackResult Track(const MapSnapshot& map, const ImageFeatures& features, const Rigid3& predicted,
                       Effort effort, Random* random);
  // What the camera turns about where its place cannot be told.
  void SetRotationPrior(const Turn& turn) { turn_ = turn; }

  const std::vector<PointMatch>& matches() const { return matches_; }
  // Every point looked for in the last call: whether it was found, and whether it agreed with the pose.
  struct Attempt {
    MapPointId point;
    bool found, inlier;
  };
  const std::vector<Attempt>& attempts() const { return attempts_; }
  // All about the last call of Track, and of the pose that came of it. The snapshot that it was given must
  // live still. Leaves the image's features to the caller.
  FrameInspection Inspect(const Rigid3& camera_from_map) const;
  // To be called when another map is tracked from now on.
  void Clear();
  // Infinite points of this panorama map are looked for from now on beside the finite points; kNoId for none.
  void EnablePanorama(PanoramaId panorama) { panorama_ = panorama; }
  PanoramaId panorama() const { return panorama_; }
  // How patches are compared from now on; kStandard at first.
  void Compare(PatchComparison comparison) { searcher_.Compare(comparison); }
  // The frame just tracked was not believed: the next one chooses its points by the guessed pose alone.
  void Forget() {
    last_inliers_.clear();
    nearby_.Forget();
    draw_frame_ += kDrawFrames;
  }
  // The frame just tracked was believed: points that were not found where they should be, as something hides
  // them from here, are looked for less often from now on, until they are found again.
  void Remember();

 private:
  static constexpr std::uint64_t kDrawFrames = 32;  // about a second
  struct Candidate {
    const MapPoint* point;
    const KeyFrame* source;
    Eigen::Vector4d place;
    PredictedPoint predicted;
  };
  void CollectVisible(const MapSnapshot& map, const Rigid3& camera_from_map, Random* random);
  void Project(const std::vector<NearbyPoint>& points, bool infinite, const Rigid3& camera_from_map);
  void Draw();
  void AddCandidates(const Rigid3& camera_from_map, std::size_t wanted, Random* random);
  bool IsWorthATry(MapPointId point, Random* random) const;
  void CountInliers(MapTrackResult* result);
  void Search(const std::vector<std::uint32_t>& which, const ImageFeatures& features, float radius,
              bool direct);
  std::optional<Rigid3> PoseFromPatches(const ImageFeatures& features, Random* random);
  void Repredict(const Rigid3& camera_from_map);

  MapTrackerOptions options_;
  std::shared_ptr<const CameraModel> camera_;
  PointSearcher searcher_;
  Rigid3 predicted_;  // that the last search began with
  PanoramaId panorama_ = kNoId;
  Turn turn_;
  std::vector<PointMatch> matches_;
  std::vector<Attempt> attempts_;
  std::vector<MapPointId> last_inliers_;  // of the last frame, by ascending id
  struct Misses {
    MapPointId point = kNoId;
    std::uint8_t in_a_row = 0;
  };
  std::vector<Misses> misses_;    // direct mapped: slot id % size
  std::uint64_t draw_frame_ = 0;  // counts searches; on by kDrawFrames, and all points draw anew
  NearbyPoints nearby_;
  // Scratch, kept to save allocations.
  std::vector<NearbyPoint> visible_;
  std::vector<std::uint8_t> bins_;    // of visible_
  std::vector<std::uint32_t> order_;  // in which visible_ is tried
  int visible_finite_ = 0, skipped_as_occluded_ = 0;
  std::vector<std::uint8_t> taken_;  // cells of the image where finite points are expected
  std::vector<Candidate> candidates_;
  std::vector<std::uint32_t> coarse_, fine_;
  std::vector<std::uint32_t> measured_;  // candidate of each measurement
  std::vector<PoseMeasurement> measurements_;
  PoseRefinementMemory memory_;
  std::vector<double> depths_;
};

}  // namespace docent::engine
