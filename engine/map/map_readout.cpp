// SPDX-License-Identifier: Apache-2.0
#include "engine/map/map_readout.h"

#include <algorithm>
#include <array>
#include <vector>

namespace docent::engine {

namespace {

// Without a rotation there is nothing to correct: the motion is unknown, or there was none.
bool IsRotatingImage(const CameraModel& image, const CameraModel& camera) {
  return !image.readout_motion().rotation_rate.isZero(0) && image.HasSameLens(camera);
}

// The readout time that a joined map has for a lens; empty if no image has one.
std::optional<Eigen::Vector2d> ReadoutOfBoth(KeyFrameId first_of_b, const CameraModel& lens, const Map& map) {
  std::array<const CameraModel*, 2> newest = {nullptr, nullptr};  // of A and of B
  for (const auto& [id, record] : map.keyframes()) {
    const CameraModel& image = *record.keyframe.camera;
    if (IsRotatingImage(image, lens)) newest[id < first_of_b ? 0 : 1] = &image;
  }
  for (const CameraModel* const image : newest) {
    if (image && image->known_readout_s()) return image->readout_motion().readout_s;
  }
  for (const CameraModel* const image : newest) {
    if (image && !image->readout_motion().readout_s.isZero(0)) return image->readout_motion().readout_s;
  }
  return std::nullopt;
}

}  // namespace

std::optional<Eigen::Vector2d> ReadoutIn(const MapSnapshot& map, const CameraModel& camera) {
  const auto newest =
      std::find_if(map.keyframes.rbegin(), map.keyframes.rend(),
                   [&](const KeyFrame& keyframe) { return IsRotatingImage(*keyframe.camera, camera); });
  if (newest == map.keyframes.rend()) return std::nullopt;
  return newest->camera->readout_motion().readout_s;
}

std::optional<Eigen::Vector2d> ReadoutIn(const Map& map, const CameraModel& camera) {
  const auto newest = std::find_if(map.keyframes().rbegin(), map.keyframes().rend(), [&](const auto& entry) {
    return IsRotatingImage(*entry.second.keyframe.camera, camera);
  });
  if (newest == map.keyframes().rend()) return std::nullopt;
  return newest->second.keyframe.camera->readout_motion().readout_s;
}

double LargestRotationRateIn(const MapSnapshot& map, const CameraModel& camera) {
  double largest = 0;
  for (const KeyFrame& keyframe : map.keyframes) {
    if (keyframe.id < map.first_unadjusted && IsRotatingImage(*keyframe.camera, camera))
      largest = std::max(largest, keyframe.camera->readout_motion().rotation_rate.norm());
  }
  return largest;
}

std::shared_ptr<const CameraModel> WithReadoutIn(const Map& map,
                                                 const std::shared_ptr<const CameraModel>& camera) {
  const ReadoutMotion& motion = camera->readout_motion();
  if (motion.rotation_rate.isZero(0) || camera->known_readout_s()) return camera;
  const auto readout_s = ReadoutIn(map, *camera);
  if (!readout_s || *readout_s == motion.readout_s) return camera;
  return std::make_shared<CameraModel>(CameraModel::WithReadout(camera, {motion.rotation_rate, *readout_s}));
}

bool SetReadout(const CameraModel& camera, const Eigen::Vector2d& readout_s, Map* map) {
  bool changed = false;
  for (auto& [id, record] : map->keyframes()) {
    std::shared_ptr<const CameraModel>& image = record.keyframe.camera;
    const ReadoutMotion& motion = image->readout_motion();
    if (!IsRotatingImage(*image, camera) || motion.readout_s == readout_s) continue;
    image = std::make_shared<CameraModel>(CameraModel::WithReadout(image, {motion.rotation_rate, readout_s}));
    changed = true;
  }
  if (!changed) return false;
  for (Map::PointRecord& record : map->points()) {
    if (record.alive && record.point.infinite()) map->UpdateDirection(&record);
  }
  map->NoteMovement();
  return true;
}

bool UniteReadouts(KeyFrameId first_of_b, Map* map) {
  std::vector<std::shared_ptr<const CameraModel>> lenses;
  for (const auto& [id, record] : map->keyframes()) {
    const std::shared_ptr<const CameraModel>& image = record.keyframe.camera;
    const bool known =
        std::ranges::any_of(lenses, [&](const auto& lens) { return lens->HasSameLens(*image); });
    if (!known && !image->readout_motion().rotation_rate.isZero(0)) lenses.push_back(image);
  }
  bool changed = false;
  for (const auto& lens : lenses) {
    const auto readout_s = ReadoutOfBoth(first_of_b, *lens, *map);
    if (readout_s && SetReadout(*lens, *readout_s, map)) changed = true;
  }
  return changed;
}

}  // namespace docent::engine
