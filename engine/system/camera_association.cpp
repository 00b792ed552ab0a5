// SPDX-License-Identifier: Apache-2.0
#include "engine/system/camera_association.h"

#include <algorithm>

namespace docent::engine {

bool CameraAssociation::AnyTracked() const {
  return std::find(tracked_.begin(), tracked_.end(), true) != tracked_.end();
}

std::uint64_t CameraAssociation::SearchedMap() const {
  return AnyTracked() || beginning_ ? map_ : 0;
}

std::uint64_t CameraAssociation::SearchedMap(std::size_t camera) const {
  const auto others = static_cast<std::ptrdiff_t>(tracked_.at(camera));
  return std::count(tracked_.begin(), tracked_.end(), true) > others || beginning_ ? map_ : 0;
}

bool CameraAssociation::SetTracked(std::size_t camera, std::uint64_t map) {
  tracked_.at(camera) = false;
  const std::uint64_t searched = SearchedMap();
  if (searched != 0 && searched != map) return false;
  tracked_[camera] = true;
  map_ = map;
  beginning_ = false;
  return true;
}

void CameraAssociation::Begin(std::uint64_t map) {
  Release();
  map_ = map;
  beginning_ = true;
}

void CameraAssociation::Release() {
  tracked_.assign(tracked_.size(), false);
  map_ = 0;
  beginning_ = false;
}

}  // namespace docent::engine
