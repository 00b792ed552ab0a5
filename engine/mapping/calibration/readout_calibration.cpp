// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/calibration/readout_calibration.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "engine/map/map_readout.h"
#include "engine/mapping/bundle/map_assembly.h"

namespace docent::engine {

ReadoutCalibration CalibrateReadout(const ReadoutEstimationOptions& options,
                                    const MapAdjustmentOptions& window, KeyFrameId newest, Map* map) {
  const Map::KeyFrameRecord* record = options.enabled ? map->FindKeyFrame(newest) : nullptr;
  if (!record) return {};
  const std::shared_ptr<const CameraModel> image = record->keyframe.camera;
  if (image->known_readout_s()) return {};
  const auto before = ReadoutIn(*map, *image);
  if (!before) return {};
  const MapAssembly assembly = AssembleAround(window.window, window.max_fixed, newest, map);
  std::vector<char> of_lens;
  for (const BundleProblem::Camera& camera : assembly.problem.cameras)
    of_lens.push_back(camera.model->HasSameLens(*image));
  const auto estimate = EstimateReadout(options, of_lens, assembly.problem);
  if (!estimate) return {};
  // Rows are exposed one after another, or columns.
  const Eigen::Vector2d sigmas = estimate->readout_s.cwiseAbs().cwiseQuotient(estimate->sigma_s);
  const Eigen::Index axis = ReadoutAxis(*image).value_or(sigmas.x() > sigmas.y() ? 0 : 1);
  const double value = estimate->readout_s[axis], sigma = estimate->sigma_s[axis];
  const double smallest = std::max(options.min_readout_s, options.min_sigmas * sigma);
  if ((*before)[axis] == 0 && std::abs(value) < smallest) return {};
  ReadoutPrior known;
  known.readout_s[axis] = value;
  known.sigma_s = (options.prior ? 1 : kReadoutRateErrors) * sigma;
  const bool differs = (known.readout_s - *before).norm() >= std::max(options.min_change_s, sigma);
  return {differs && SetReadout(*image, known.readout_s, map), known};
}

}  // namespace docent::engine
