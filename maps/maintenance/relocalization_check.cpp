// SPDX-License-Identifier: Apache-2.0
#include "maps/maintenance/relocalization_check.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <tuple>

#include "engine/map/map.h"
#include "engine/map/upright_axes.h"
#include "engine/recognition/place_index.h"
#include "engine/tracking/tracker.h"
#include "maps/exchange/view_from_above.h"

namespace docent::maps {

namespace {

constexpr std::uint64_t kKey = 1;

// Finds places in a map without one keyframe: searches an index of the whole map and removes what is no
// longer in it.
class RemainingPlaces : public engine::PlaceFinder {
 public:
  RemainingPlaces(const engine::PlaceIndex& index, std::shared_ptr<const engine::MapSnapshot> rest)
      : index_(index), rest_(std::move(rest)) {}

  std::vector<engine::PlaceCandidate> FindPlaces(const engine::PlaceQuery& query, int count, int per_map,
                                                 std::uint64_t only_map) const override {
    const int gone = static_cast<int>(index_.keyframes() - rest_->keyframes.size());
    auto places = index_.FindPlaces(query, count + gone, per_map + gone, only_map);
    std::erase_if(places, [&](const engine::PlaceCandidate& place) {
      return rest_->FindKeyFrame(place.keyframe) == nullptr;
    });
    places.resize(std::min(places.size(), static_cast<std::size_t>(std::max(0, std::min(count, per_map)))));
    for (engine::PlaceCandidate& place : places) place.map = rest_;
    return places;
  }

 private:
  const engine::PlaceIndex& index_;
  const std::shared_ptr<const engine::MapSnapshot> rest_;
};

RelocalizationTrial::Result Try(const engine::MapSnapshot& map, const engine::PlaceIndex& index,
                                const engine::KeyFrame& keyframe, const RelocalizationOptions& options) {
  using Result = RelocalizationTrial::Result;
  engine::Map without(map);
  without.RemoveKeyFrame(keyframe.id);
  const auto rest = without.Snapshot();
  if (!rest->HasFinitePoints()) return Result::kNotFound;
  const RemainingPlaces places(index, rest);
  engine::TrackerOptions tracker_options;
  tracker_options.build_maps = false;
  engine::Tracker tracker(tracker_options, keyframe.camera, options.seed);
  tracker.SetMap(rest, kKey);
  engine::Frame frame;
  frame.time = keyframe.time;
  frame.image = keyframe.features->levels[0];
  // A pose with a low inlier ratio is accepted only after several consecutive images agree. A visitor's
  // camera delivers them within a tenth of a second, so the image is repeated at 30 Hz.
  engine::TrackedFrame tracked;
  for (int image = 0; image <= tracker_options.confirming_frames; ++image) {
    tracked = tracker.Track(frame, &places);
    if (engine::HasPose(tracked.state)) break;
    frame.time += std::chrono::milliseconds(33);
  }
  if (!engine::HasPose(tracked.state)) return Result::kNotFound;
  const engine::Rigid3 error = tracked.camera_from_map * keyframe.camera_from_map.inverse();
  const double angle_deg = error.rotation.Log().norm() * 180 / std::numbers::pi;
  const double distance =
      (tracked.camera_from_map.OriginInSource() - keyframe.camera_from_map.OriginInSource()).norm();
  const bool right =
      angle_deg <= options.max_rotation_deg && distance <= options.max_distance * keyframe.mean_depth;
  return right ? Result::kFound : Result::kWrongPose;
}

}  // namespace

std::vector<RelocalizationTrial> LeaveEachKeyFrameOut(const engine::MapSnapshot& map,
                                                      const RelocalizationOptions& options,
                                                      const std::function<bool(std::size_t)>& progress) {
  engine::PlaceIndex index;
  index.SetMap(kKey, std::make_shared<const engine::MapSnapshot>(map));
  std::vector<RelocalizationTrial> trials;
  for (const engine::KeyFrame& keyframe : map.keyframes) {
    if (keyframe.kind != engine::KeyFrameKind::kSixDof) continue;
    RelocalizationTrial trial;
    trial.keyframe = keyframe.id;
    trial.place = keyframe.camera_from_map.OriginInSource();
    trial.direction = keyframe.camera_from_map.rotation.inverse() * Eigen::Vector3d::UnitZ();
    trial.result = Try(map, index, keyframe, options);
    trials.push_back(trial);
    if (progress && !progress(trials.size())) break;
  }
  return trials;
}

RelocalizationGrid MakeRelocalizationGrid(const engine::MapSnapshot& map,
                                          const std::vector<RelocalizationTrial>& trials) {
  RelocalizationGrid grid;
  if (trials.empty() || map.keyframes.empty()) return grid;
  std::vector<double> depths;
  for (const engine::KeyFrame& keyframe : map.keyframes) depths.push_back(keyframe.mean_depth);
  std::nth_element(depths.begin(), depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2),
                   depths.end());
  grid.side = std::max(1e-6, 0.5 * depths[depths.size() / 2]);
  const Eigen::Vector3d up = engine::UpInMap(map);
  const Eigen::Matrix<double, 2, 3> sheet_from_map = SheetFromMap(map);
  const Eigen::Vector2d origin = sheet_from_map * map.keyframes.front().camera_from_map.OriginInSource();
  std::map<std::tuple<int, int, int>, RelocalizationCell> cells;
  for (const RelocalizationTrial& trial : trials) {
    const Eigen::Vector2d place = (sheet_from_map * trial.place - origin) / grid.side;
    const Eigen::Vector2d view = sheet_from_map * trial.direction;
    RelocalizationCell cell;
    // The second axis of the plan points down, which is backwards.
    cell.square = {static_cast<int>(std::floor(place.x() + 0.5)),
                   static_cast<int>(std::floor(-place.y() + 0.5))};
    const double eighths = std::atan2(view.x(), -view.y()) * 4 / std::numbers::pi;
    cell.direction = (static_cast<int>(std::lround(eighths)) + 8) % 8;
    auto& kept = cells[{cell.square.x(), cell.square.y(), cell.direction}];
    cell.trials = kept.trials + 1;
    cell.found = kept.found + (trial.result == RelocalizationTrial::Result::kFound ? 1 : 0);
    // The sum of the heights, which is divided by the number of trials below.
    cell.place = kept.place + up.dot(trial.place) * up;
    const double turn = cell.direction * std::numbers::pi / 4;
    cell.view = sheet_from_map.transpose() * Eigen::Vector2d(std::sin(turn), -std::cos(turn));
    kept = cell;
  }
  for (const auto& [key, summed] : cells) {
    RelocalizationCell cell = summed;
    const Eigen::Vector2d middle(origin.x() + cell.square.x() * grid.side,
                                 origin.y() - cell.square.y() * grid.side);
    cell.place = sheet_from_map.transpose() * middle + cell.place / cell.trials;
    grid.cells.push_back(cell);
  }
  return grid;
}

}  // namespace docent::maps
