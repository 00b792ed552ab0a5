// SPDX-License-Identifier: Apache-2.0
#include "app/visits/visit_record.h"

#include <utility>

namespace docent::app {

std::optional<VisitRecord> VisitRecorder::Add(std::chrono::sys_seconds now, double seconds,
                                              const std::string& map, const Eigen::Vector3d& place) {
  std::optional<VisitRecord> ended;
  if (visit_ && last_pose_s_ && seconds - begin_s_ - *last_pose_s_ >= limits_.idle_s) ended = Finish();
  if (visit_ && !last_pose_s_ && seconds - begin_s_ >= limits_.idle_s) {
    // Nothing was recognized at all: the device waits for its first visitor.
    visit_.reset();
    is_unused_ = true;
  }
  if (!visit_) {
    // The images of a device that was put down are nobody's.
    if (map.empty() && (last_pose_s_ || is_unused_)) return ended;
    is_unused_ = false;
    visit_.emplace();
    visit_->begin = now;
    begin_s_ = seconds;
    last_pose_s_.reset();
    last_step_s_.reset();
  }
  ++visit_->images;
  visit_->duration_s = seconds - begin_s_;
  if (map.empty()) return ended;
  ++visit_->localized;
  AddPose(seconds - begin_s_, map, place);
  return ended;
}

void VisitRecorder::AddPose(double seconds, const std::string& map, const Eigen::Vector3d& place) {
  EndLoss(seconds);
  const bool is_pause = last_pose_s_ && seconds - *last_pose_s_ >= limits_.loss_s;
  const bool is_new = !last_pose_s_ || is_pause || map != last_map_;
  if (is_new && visit_->stays.size() < limits_.stays) visit_->stays.push_back({map, seconds, 0});
  VisitRecord::Stay& stay = visit_->stays.back();
  const bool is_in_stay = stay.map == map;
  if (is_in_stay) stay.duration_s = seconds - stay.begin_s;
  if (is_in_stay && (is_new || !last_step_s_ || seconds - *last_step_s_ >= limits_.step_s) &&
      visit_->path.size() < limits_.steps) {
    visit_->path.push_back({static_cast<std::uint32_t>(visit_->stays.size() - 1), place});
    last_step_s_ = seconds;
  }
  last_pose_s_ = seconds;
  last_map_ = map;
  last_place_ = place;
}

void VisitRecorder::EndLoss(double seconds) {
  if (!last_pose_s_ || seconds - *last_pose_s_ < limits_.loss_s || visit_->losses.size() >= limits_.losses)
    return;
  visit_->losses.push_back({last_map_, *last_pose_s_, seconds - *last_pose_s_, last_place_});
}

void VisitRecorder::SetTour(const std::string& name, std::uint32_t stops, std::uint32_t seen) {
  if (!visit_) return;
  visit_->tour = name;
  visit_->stops = stops;
  visit_->seen = seen;
}

// What follows the last pose is no loss: the visitor has left.
std::optional<VisitRecord> VisitRecorder::Finish() {
  if (visit_ && !last_pose_s_) {
    visit_.reset();
    is_unused_ = true;
  }
  if (visit_) visit_->duration_s = *last_pose_s_;
  return std::exchange(visit_, std::nullopt);
}

}  // namespace docent::app
