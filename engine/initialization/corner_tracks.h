// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/time.h"
#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"
#include "engine/vision/features.h"

namespace docent::engine {

struct CornerTracksOptions {
  std::array<int, 3> corners = {350, 200, 100};  // maximum number to track, by level
  // Plain surfaces have corners only where there are objects. Where the grid finds fewer than this, one twice
  // as fine is used, since the tracks of a third are lost within ten images of a hand-held phone, and with
  // fewer than min_alive the search starts again: of six runs with such a recording, one had depth within
  // four seconds with the coarse grid, all with the fine one. In a furnished room, 360 corners are found.
  int plain_scene_corners = 200;
  double min_alive_ratio = 0.3;  // of the initial corners; with fewer, a new first view is taken
  int min_alive = 80;            // corners; with fewer, a new first view is taken
  int max_age_frames = 240;      // a first view older than this is replaced

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// The rotation between two consecutive images, from the whole images; none if it is not found.
Rotation3 AlignedRotation(const ImageFeatures& previous, const ImageFeatures& now, const CameraModel& camera);

// Corners of a first view, tracked from one image to the next by their patches. Each is tracked back again,
// and discarded where it does not return. One thread.
class CornerTracks {
 public:
  // A tracked corner: its pixel in the first view and in the current image, level 0.
  struct Trail {
    Eigen::Vector2f first, now;
    int level = 0;
    std::uint32_t id = 0;                                                                  // ascending
    Eigen::Vector2f first_step = Eigen::Vector2f::Zero(), step = Eigen::Vector2f::Zero();  // pixels per image
  };

  explicit CornerTracks(const CornerTracksOptions& options);

  // Forgets the first view and its corners.
  void Reset();
  // Takes the corners of a first view.
  void Start(Timestamp time, const std::shared_ptr<const ImageFeatures>& features);
  // Tracks the corners into the next image. now_from_previous: predicts where they are.
  void Track(Timestamp time, const std::shared_ptr<const ImageFeatures>& features, const CameraModel& camera,
             const Rotation3& now_from_previous);

  bool started() const { return first_ != nullptr; }
  // Whether too few corners are left, or the first view is too old.
  bool ended() const;
  bool has_enough() const { return static_cast<int>(trails_.size()) >= options_.min_alive; }
  const std::vector<Trail>& trails() const { return trails_; }
  int age_frames() const { return age_frames_; }  // since the first view
  // Time of the first view; Timestamp::min() if there is none.
  Timestamp first_time() const { return first_ ? first_time_ : Timestamp::min(); }
  const std::shared_ptr<const ImageFeatures>& first() const { return first_; }
  const std::shared_ptr<const ImageFeatures>& newest() const { return previous_; }
  // Mean rotation rates, radians per second: of the first two intervals between images, and of the last two.
  const std::array<Eigen::Vector3d, 2>& first_rates() const { return first_rates_; }
  const std::array<Eigen::Vector3d, 2>& last_rates() const { return last_rates_; }
  // Median distance of the corners from their first pixels.
  double MedianMotionPx() const;
  // Median difference of the image speed between the current and the first view, pixels per image.
  double MedianSpeedChangePx() const;

 private:
  void AddCorners(const ImageFeatures& features, double density);

  CornerTracksOptions options_;
  std::vector<Trail> trails_;
  std::size_t trails_at_start_ = 0;
  int age_frames_ = 0;
  std::array<Eigen::Vector3d, 2> first_rates_, last_rates_;
  Timestamp first_time_{}, previous_time_{};
  std::shared_ptr<const ImageFeatures> first_, previous_;
};

}  // namespace docent::engine
