// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "content/scene.h"

namespace docent::app {

// Decides which sounds of a map play. A sound begins when the camera comes within its range, plays once, and
// stops when the camera has left the range by a fifth; it begins again when the camera comes back. The
// hysteresis keeps a camera at the border from starting it over and over. Times are seconds that do not
// decrease. One thread.
class SoundDirector {
 public:
  // `language`: that of the reader of the captions (content::TextFor).
  explicit SoundDirector(std::string language) : language_(std::move(language)) {}

  // A sound by the key of its map and its name.
  using Key = std::pair<std::uint64_t, std::string>;
  struct Orders {
    std::vector<std::pair<Key, std::shared_ptr<const content::Asset>>> start;
    std::vector<Key> stop;
    std::string caption;  // Of all sounds that play, one below the other; empty for none.
  };
  // A visitor asks for a sound: it begins anew with the next frame that has a place, wherever that is, and
  // plays to its end.
  void Ask(std::uint64_t map_key, const std::string& name) { asked_.insert({map_key, name}); }
  // For the next visitor, everything begins anew, and what plays stops with the next frame.
  void BeginAnew();
  // A frame whose camera is at this place in the map with this key; without a place, what plays goes on.
  Orders Update(double seconds, std::uint64_t map_key, const content::Scene& scene,
                const std::optional<Eigen::Vector3d>& camera_in_map);

 private:
  struct Near {
    double end_seconds = 0;  // Of sound and caption.
    bool is_asked = false;   // It plays to its end also out of range.
    std::string caption;
  };
  bool IsHeard(const content::Sound& sound, const Eigen::Vector3d& camera, bool was_near) const;

  const std::string language_;
  std::map<Key, Near> near_;  // The sounds that the camera is within the range of, and those asked for.
  std::set<Key> asked_;       // Since the last frame with a place.
  std::vector<Key> left_;     // What the visitor before has left playing.
};

}  // namespace docent::app
