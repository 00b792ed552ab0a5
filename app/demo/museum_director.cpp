// SPDX-License-Identifier: Apache-2.0
#include "app/demo/museum_director.h"

#include <algorithm>
#include <filesystem>

#include "content/placement.h"

namespace docent::app {

namespace {

constexpr std::string_view kBuild = "build", kVisit = "visit";

const SimulatedPlace* FindPlace(const Simulation& simulation, const std::string& name) {
  for (const SimulatedPlace& place : simulation.places()) {
    if (place.name == name) return &place;
  }
  return nullptr;
}

std::optional<Eigen::Vector2d> PixelOf(const Simulation& simulation, int frame,
                                       const Eigen::Vector3d& point_in_world) {
  const auto pixel =
      simulation.camera().Project(simulation.world_from_camera(frame).inverse() * point_in_world);
  if (!pixel || !simulation.camera().IsInside(*pixel)) return std::nullopt;
  return pixel;
}

}  // namespace

MuseumDirector::MuseumDirector(const Simulation& simulation, std::string model_file)
    : simulation_(simulation), model_file_(std::move(model_file)) {
  first_visit_frame_ = simulation.frame_count();
  for (int i = simulation.frame_count() - 1; i >= 0; --i) {
    const std::string& label = simulation.label(i);
    const auto [part, is_new] = parts_.try_emplace(label, i, i);
    part->second.first = i;
    if (label.starts_with(kVisit)) first_visit_frame_ = i;
  }
}

std::vector<Command> MuseumDirector::Direct(const ShownFrame& frame) {
  const int index = static_cast<int>(frame.tracked.frame.index);
  if (index < 0 || index >= simulation_.frame_count()) return {};
  const std::string& label = simulation_.label(index);
  const std::string place = label.starts_with(kBuild) ? label.substr(kBuild.size()) : std::string();
  std::vector<Command> commands;
  if (place != building_) {
    if (!building_.empty()) commands.push_back(StopMap{});
    if (!place.empty()) commands.push_back(NewMap{MapName(place)});
    building_ = place;
    content_placed_ = false;
    return commands;
  }
  if (place.empty() || content_placed_) return commands;
  const auto [first, last] = parts_.at(label);
  // At 3/5 of the part the map covers the place, and it is still extended after the content was placed.
  if (index < first + (last - first) * 3 / 5) return commands;
  return PlaceContent(frame, index, place);
}

std::vector<Command> MuseumDirector::PlaceContent(const ShownFrame& frame, int index,
                                                  const std::string& place) {
  constexpr double kModelHeight = 0.25;  // Ratio of the last keyframe's median depth.
  const Eigen::Vector2d kSignOffset(150, -20);
  const SimulatedPlace* spot = FindPlace(simulation_, place);
  if (spot == nullptr || !engine::HasPose(frame.tracked.state) || frame.shown.map_name != MapName(place)) {
    return {};
  }
  const auto seen = PixelOf(simulation_, index, spot->anchor_in_world);
  if (!seen) return {};
  const Eigen::Vector2d pixel = seen->array().round(), sign_pixel = pixel + kSignOffset;
  const auto point = simulation_.SurfaceAt(index, pixel);
  if (!point) return {};
  content_placed_ = true;
  PlaceModel model;
  model.file = model_file_;
  model.pixel = pixel;
  model.scale = kModelHeight * frame.tracked.map->keyframes.back().mean_depth;
  truths_[{MapName(place), std::filesystem::path(model_file_).stem().string()}] = *point;
  std::vector<Command> commands = {model};
  const auto sign_point = simulation_.SurfaceAt(index, sign_pixel);
  if (sign_point && simulation_.camera().IsInside(sign_pixel)) {
    PlaceSignpost sign;
    sign.text = MapName(place);
    sign.pixel = sign_pixel;
    truths_[{MapName(place), "sign-1"}] = *sign_point;
    commands.emplace_back(sign);
  }
  return commands;
}

void DrawingCheck::Add(const ShownFrame& frame) {
  const int index = static_cast<int>(frame.tracked.frame.index);
  const std::string& label = simulation_.label(index);
  const bool has_pose = engine::HasPose(frame.tracked.state);
  if (label.starts_with(kVisit)) {
    ++visit_frames_;
    recognized_ += has_pose;
    recognized_correctly_ +=
        has_pose && frame.shown.map_name == MuseumDirector::MapName(label.substr(kVisit.size()));
  }
  if (!has_pose || !frame.shown.scene) return;
  for (const content::Entity& entity : frame.shown.scene->entities) {
    const auto truth = truths_.find({frame.shown.map_name, entity.name});
    if (truth == truths_.end()) continue;
    const Eigen::Vector3d foot = content::BaseInMap(entity);
    const auto drawn = simulation_.camera().Project(frame.tracked.camera_from_map * foot);
    const auto seen = PixelOf(simulation_, index, truth->second);
    if (drawn && seen) errors_px_.push_back((*drawn - *seen).norm());
  }
}

}  // namespace docent::app
