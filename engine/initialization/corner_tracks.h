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
#include "engine/initialization/corner_sequence.h"
#include "engine/initialization/initial_pair.h"
#include "engine/vision/features.h"

namespace docent::engine {

struct CornerTracksOptions {
  std::array<int, 3> corners = {350, 200, 100};  // maximum number to track, by level
  // Surfaces of low texture have corners only where there are objects. Where the grid finds fewer than this,
  // one twice as fine is used, since the tracks of a third are lost within ten images of a hand-held phone,
  // and with fewer than min_alive the search starts again: of six runs with such a recording, one had depth
  // within four seconds with the coarse grid, all with the fine one. In a furnished room, 360 corners are
  // found.
  int low_texture_corners = 200;
  double min_alive_ratio = 0.3;  // of the corners of a first view; with fewer, it ends
  int min_alive = 80;            // corners; with fewer, a first view ends
  int max_age_frames = 240;      // a first view that is older than this and than max_age ends
  // The time of 240 images at 30 a second: a camera with more images a second needs as long to move.
  Timestamp max_age = std::chrono::seconds(8);
  // In a scene of low texture, once fewer corners of the newest first view than this ratio are left, the
  // image becomes a further first view, and corners are added where none are left. In fast motion, the
  // corners of a first view are lost just before their parallax is significant, and with a single one it is
  // chance whether that was a suitable image: of 60 runs with a recording of such a scene and its variants
  // (half of the images, half the resolution, turned, backwards), 29 % of the images had depth with one first
  // view, 66 % with up to six. Not elsewhere: the corners that remain are the distant ones, and more of them
  // cost time.
  double next_view_alive_ratio = 0.85;
  int max_views = 6;  // at most CornerTracks::kMaxViews

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// The rotation between two consecutive images, from the whole images; none if it is not found.
Rotation3 AlignedRotation(const ImageFeatures& previous, const ImageFeatures& now, const CameraModel& camera);

// Corners that are tracked from one image to the next by their patches, since one or more first views. Each
// is tracked back again, and discarded where it does not return. One thread.
class CornerTracks {
 public:
  static constexpr std::size_t kMaxViews = 8;
  static constexpr std::uint32_t kRememberedImages = 32;  // a second at 30 Hz
  // An image from which corners are tracked.
  struct FirstView {
    Timestamp time{};
    std::shared_ptr<const ImageFeatures> features;
    // Mean rotation rates, radians per second, of the first two intervals between images.
    std::array<Eigen::Vector3d, 2> rates = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
    int age_frames = 0;
    std::size_t slot = 0;                         // differs from those of the other first views
    std::size_t corners_at_start = 0, alive = 0;  // alive: tracked still
  };

  explicit CornerTracks(const CornerTracksOptions& options);

  // Forgets the first views and their corners.
  void Reset();
  // Makes an image the only first view.
  void Start(Timestamp time, const std::shared_ptr<const ImageFeatures>& features);
  // Tracks the corners into the next image, which becomes the only first view if all others end there, and
  // may become a further one in a scene of low texture. now_from_previous: predicts where the corners are.
  void Track(Timestamp time, const std::shared_ptr<const ImageFeatures>& features, const CameraModel& camera,
             const Rotation3& now_from_previous);

  bool started() const { return !views_.empty(); }
  // In the order of their times.
  const std::vector<FirstView>& views() const { return views_; }
  // Whether a first view has as many corners as it needs not to end.
  bool HasEnough(const FirstView& view) const;
  const std::shared_ptr<const ImageFeatures>& newest() const { return previous_; }
  // Of the last two intervals between images.
  const std::array<Eigen::Vector3d, 2>& last_rates() const { return last_rates_; }

  // The corners of a first view that are tracked still: in it and in the current image, with ids that
  // identify them in other calls, ascending.
  void Matches(const FirstView& view, std::vector<InitialPair::Match>* matches,
               std::vector<std::uint32_t>* ids) const;
  // The corners of a first view that are tracked still, in all images since then, or in the last ones that
  // are remembered.
  CornerSequence Sequence(const FirstView& view) const;
  // Median distance of the corners from their pixels in a first view.
  double MedianMotionPx(const FirstView& view) const;
  // Median difference of the image speed between the current image and a first view, pixels per image.
  double MedianSpeedChangePx(const FirstView& view) const;

 private:
  // A corner in an image: its pixel of level 0, and its motion there in pixels per image.
  struct Seen {
    Eigen::Vector2f pixel = Eigen::Vector2f::Zero(), step = Eigen::Vector2f::Zero();
  };
  struct Trail {
    Seen now;
    int level = 0;
    std::uint32_t id = 0;
    std::uint8_t views = 0;             // bits of the slots of the first views that contain it
    std::array<Seen, kMaxViews> first;  // by slot
    std::array<Eigen::Vector2f, kRememberedImages> pixels;  // by number of the image, modulo
    bool IsIn(std::size_t slot) const { return ((views >> slot) & 1) != 0; }
  };
  void AddView(Timestamp time, const std::shared_ptr<const ImageFeatures>& features);
  void AddCorners(const ImageFeatures& features, double density);
  bool HasFewCorners() const;
  void TrackTrails(const ImageFeatures& features, const CameraModel& camera,
                   const Rotation3& now_from_previous);
  // Removes first views with too few corners or of too great an age, and corners without a first view.
  void EndViews();
  std::size_t FreeSlot() const;

  CornerTracksOptions options_;
  std::vector<Trail> trails_;  // in the order of their ids
  std::vector<FirstView> views_;
  bool is_low_texture_ = false;  // the first image had few corners
  std::uint32_t next_id_ = 0;
  std::uint32_t image_ = 0;                                      // number of the current image
  std::array<CornerSequence::Image, kRememberedImages> images_;  // by number, modulo
  std::array<Eigen::Vector3d, 2> last_rates_ = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  Timestamp previous_time_{};
  std::shared_ptr<const ImageFeatures> previous_;
};

}  // namespace docent::engine
