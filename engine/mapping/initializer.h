// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/base/random.h"
#include "engine/mapping/keyframe_candidate.h"
#include "engine/mapping/start_confirmation.h"
#include "engine/vision/patch.h"

namespace docent::engine {

struct InitializerOptions {
  std::array<int, 3> corners = {350, 200, 100};  // to follow, by level
  double min_motion_px = 8;      // median motion, for a 640 pixel wide image, before geometry is asked
  double min_alive_ratio = 0.3;  // of the corners at the start, else the first view is taken anew
  int min_alive = 80;
  int max_age_frames = 240;  // a first view older than this is taken anew
  int attempt_interval = 2;  // frames between questions
  TwoViewOptions two_view;
  StartConfirmationOptions confirmation;
};

// Waits for two views that start a map: follows corners from a first view by image alone and asks the
// geometry of two views until it answers with certainty (ptamm §2.3) and a third view has confirmed it. While
// it waits it says why. One a camera, on the tracker's thread.
class Initializer {
 public:
  Initializer(const InitializerOptions& options, std::shared_ptr<const CameraModel> camera,
              std::uint64_t seed);

  // Starts again from the next frame.
  void Reset();
  // A pair once the geometry is certain; then Reset() has happened.
  std::optional<InitialPair> Track(Timestamp time, const std::shared_ptr<const ImageFeatures>& features);

  // The same for two views whose keypoints were matched by somebody else, such as the points of a panorama
  // map in one of its keyframes and in the present frame. ids: one a match, ascending. speed_change_px: by
  // how much faster, in pixels a frame, the image moved in one of the views than in the other.
  std::optional<InitialPair> TryViews(const InitialPair::View& a, const InitialPair::View& b,
                                      std::vector<InitialPair::Match> matches,
                                      std::span<const std::uint32_t> ids, double speed_change_px);

  // Of the first view that is waited with; far in the past when there is none.
  Timestamp first_time() const { return first_ ? first_time_ : Timestamp::min(); }
  // Why there is no map so far; empty right after Reset().
  const std::string& hint() const { return hint_; }
  // Corners being followed: where each was in the first view and is now, level-0 pixels.
  struct Trail {
    Eigen::Vector2f first, now;
    int level = 0;
    std::uint32_t id = 0;                                                                  // ascending
    Eigen::Vector2f first_step = Eigen::Vector2f::Zero(), step = Eigen::Vector2f::Zero();  // pixels a frame
  };
  const std::vector<Trail>& trails() const { return trails_; }

 private:
  void Start(Timestamp time, const std::shared_ptr<const ImageFeatures>& features);
  void Follow(const ImageFeatures& features);
  std::optional<InitialPair> Attempt(Timestamp time, const std::shared_ptr<const ImageFeatures>& features);
  std::optional<InitialPair> Solve(const InitialPair::View& a, const InitialPair::View& b,
                                   std::vector<InitialPair::Match> matches,
                                   std::span<const std::uint32_t> ids, double speed_change_px,
                                   StartConfirmation* confirmation);
  double SpeedChange() const;

  InitializerOptions options_;
  std::shared_ptr<const CameraModel> camera_;
  Random random_;
  StartConfirmation confirmation_, views_confirmation_;
  std::vector<Trail> trails_;
  std::size_t trails_at_start_ = 0;
  int age_frames_ = 0;
  Timestamp first_time_{};
  std::shared_ptr<const ImageFeatures> first_, previous_;
  std::string hint_;
};

}  // namespace docent::engine
