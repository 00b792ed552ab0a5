// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/readout_update.h"

#include <memory>

namespace docent::engine {

bool UpdateReadout(const CameraModel& newest, Map* map) {
  constexpr double kTolerance_s = 0.0005;     // half of the smallest change that ReadoutEstimator makes
  if (!newest.lens_of_image()) return false;  // its motion is not known
  const Eigen::Vector2d& readout_s = newest.readout_motion().readout_s;
  bool changed = false;
  for (auto& [id, record] : map->keyframes()) {
    std::shared_ptr<const CameraModel>& camera = record.keyframe.camera;
    const ReadoutMotion& motion = camera->readout_motion();
    // Without a rotation there is nothing to correct: the motion is unknown, or there was none.
    if (motion.rotation_rate.isZero(0) || !camera->HasSameLens(newest)) continue;
    if ((motion.readout_s - readout_s).cwiseAbs().maxCoeff() < kTolerance_s) continue;
    camera =
        std::make_shared<CameraModel>(CameraModel::WithReadout(camera, {motion.rotation_rate, readout_s}));
    changed = true;
  }
  if (!changed) return false;
  for (Map::PointRecord& record : map->points()) {
    if (record.alive && record.point.infinite()) map->UpdateDirection(&record);
  }
  return true;
}

}  // namespace docent::engine
