// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace docent::app {

// A visit as the operator of a museum sees it: where the visitor was and where the camera was lost. It holds
// no image and nothing about the person.
struct VisitRecord {
  // The visitor was in a map for a while, with pauses of at most Limits::loss_s.
  struct Stay {
    std::string map;
    double begin_s = 0, duration_s = 0;  // From the first image.

    bool operator==(const Stay&) const = default;
  };
  // There was no pose for a while after the visitor was in a map.
  struct Loss {
    std::string map;                                  // The last one before.
    double begin_s = 0, duration_s = 0;               // From the first image.
    Eigen::Vector3d place = Eigen::Vector3d::Zero();  // The last one of the camera, in the map, map units.

    bool operator==(const Loss&) const = default;
  };
  // A point of the way, about one a second.
  struct Step {
    std::uint32_t stay = 0;                           // Index in `stays`.
    Eigen::Vector3d place = Eigen::Vector3d::Zero();  // Of the camera, in the stay's map, map units.

    bool operator==(const Step&) const = default;
  };

  std::chrono::sys_seconds begin;  // Of the first image, UTC.
  double duration_s = 0;
  std::uint64_t images = 0, localized = 0;  // All, and those with a pose.
  std::string tour;                         // The named tour that the visitor was led along; empty for none.
  std::uint32_t stops = 0, seen = 0;        // Of the tour: all, and those that were reached.
  std::vector<Stay> stays;
  std::vector<Loss> losses;
  std::vector<Step> path;

  bool operator==(const VisitRecord&) const = default;
};

// Makes the records of one camera's visits from its images. A visit ends when nothing is recognized for two
// minutes, or by Finish, and is none if nothing was recognized before; the next one begins with the next
// pose. One thread.
class VisitRecorder {
 public:
  // Design choices.
  struct Limits {
    double loss_s = 1;    // A shorter pause is no loss: a hand that passes.
    double idle_s = 120;  // After such a pause, the next visitor has the device.
    double step_s = 1;    // Between two points of the way.
    // What exceeds these in one visit is left out, so that a record stays below a megabyte.
    std::size_t stays = 1000, losses = 1000, steps = 10'000;
  };

  VisitRecorder() : limits_() {}
  explicit VisitRecorder(const Limits& limits) : limits_(limits) {}

  // An image. `now`: the time of day. `seconds` from any beginning do not decrease. `map` is the name of the
  // map in which the camera is at `place`; empty without a pose. Returns the record of a visit that ended
  // before.
  std::optional<VisitRecord> Add(std::chrono::sys_seconds now, double seconds, const std::string& map,
                                 const Eigen::Vector3d& place);
  // How far the visitor has come along a tour.
  void SetTour(const std::string& name, std::uint32_t stops, std::uint32_t seen);
  // Ends the visit; empty if nothing was recognized since the last one ended.
  std::optional<VisitRecord> Finish();

 private:
  void AddPose(double seconds, const std::string& map, const Eigen::Vector3d& place);
  void EndLoss(double seconds);

  const Limits limits_;
  std::optional<VisitRecord> visit_;
  double begin_s_ = 0;                               // Of the visit, on the clock of Add.
  std::optional<double> last_pose_s_, last_step_s_;  // From begin_s_.
  bool is_unused_ = false;                           // No visit yet, since nothing was recognized.
  std::string last_map_;
  Eigen::Vector3d last_place_ = Eigen::Vector3d::Zero();
};

}  // namespace docent::app
