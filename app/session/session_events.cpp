// SPDX-License-Identifier: Apache-2.0
// What a change in the system means for the session: its maps, their content, and what the user is told.
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "app/files/text_file.h"
#include "app/output/engine_text.h"
#include "app/session/joined_scenes.h"
#include "app/session/session.h"

namespace docent::app {

namespace {

std::string Percent(double ratio) {
  return std::to_string(std::lround(100 * ratio)) + " %";
}

std::string ReasonOf(const engine::MapDiscarded& what, const std::string& other) {
  using Reason = engine::MapDiscarded::Reason;
  switch (what.reason) {
    case Reason::kFalseDepth:
      return "its depth was wrong: the inlier ratio fell from " + Percent(what.fault.initial_inlier_ratio) +
             " to " + Percent(what.fault.recent_inlier_ratio) + " while the camera hardly moved";
    case Reason::kLostWhileProvisional:
      return "tracking was lost " + FormatNumber(ToSeconds(what.tracked_for), 3) +
             " s after initialization, with " + std::to_string(what.keyframes) + " keyframes";
    case Reason::kLostWithoutDepth:
      return "tracking was lost before the map had finite points";
    case Reason::kRelocalizedElsewhere:
      return "the camera relocalized in " + other;
  }
  return {};
}

std::string TextOf(const engine::CalibrationMonitor::Mismatch& mismatch) {
  const auto radius = [](double px) { return std::to_string(std::lround(px)); };
  const auto pixels = [](double px) { return FormatNumber(std::round(10 * px) / 10, 3); };
  return "The calibration does not fit this lens: " + radius(mismatch.outward_radius_px) +
         " pixels from the image centre, points appear " + pixels(mismatch.outward_px) +
         " pixels too far out, and " + radius(mismatch.inward_radius_px) + " pixels from it " +
         pixels(mismatch.inward_px) +
         " pixels too far in. Calibrate the camera again with `docent calibrate`.";
}

}  // namespace

void Session::HandleSystemEvents() {
  for (const engine::SystemEvent& event : system_.TakeEvents())
    std::visit([&](const auto& what) { Handle(event, what); }, event.what);
}

std::string Session::NameOf(std::uint64_t key) const {
  const auto found = maps_.find(key);
  return found != maps_.end() ? found->second.name : std::string();
}

std::string Session::CameraPrefix(std::size_t camera) const {
  return cameras_.size() > 1 ? "camera " + std::to_string(camera) + ": " : std::string();
}

void Session::Handle(const engine::SystemEvent& event, const engine::MapEntered&) {
  AddEvent(event.time, "map", "entered " + NameOf(event.map));
  PinMapsInUse();
  if (const auto found = maps_.find(event.map); found != maps_.end()) ExpectNeighbours(found->second);
  if (saver_) saver_->InterruptMaintenance();  // maintenance may be adjusting this map
}

void Session::Handle(const engine::SystemEvent& event, const engine::Relocalized&) {
  const std::string by = cameras_.size() > 1 ? " by camera " + std::to_string(event.camera) : std::string();
  AddEvent(event.time, "relocalized", NameOf(event.map) + by);
}

void Session::Handle(const engine::SystemEvent& event, const engine::PoseRejected&) {
  cameras_[event.camera].relocalization_message = {};
}

void Session::Handle(const engine::SystemEvent& event, const engine::MapLeft& what) {
  const auto found = maps_.find(event.map);
  if (found == maps_.end()) return;
  if (!what.forgotten) {
    if (options_.may_write) SaveMap(&found->second, event.time);
    return;
  }
  AddEvent(event.time, "warning",
           "the map " + found->second.name + " was not created, because it was never initialized");
  maps_.erase(found);
}

void Session::Handle(const engine::SystemEvent& event, const engine::MapUpdated& what) {
  const auto found = maps_.find(event.map);
  if (found != maps_.end()) found->second.UpdateSnapshot(what.snapshot);
}

void Session::Handle(const engine::SystemEvent& event, const engine::MapDiscarded& what) {
  const auto found = maps_.find(event.map);
  if (found == maps_.end()) return;
  SessionMap& map = found->second;
  map.discarded = true;
  AddEvent(event.time, "map", "discarded " + map.name + ": " + ReasonOf(what, NameOf(what.other)));
  if (what.replacement == 0) return;
  AddMap(what.replacement, map.name);
  Retarget(event.map, map.name, what.replacement, map.name);
  // Content of the false initialization has lost its anchor.
  for (const content::Entity& entity : map.scene->entities) {
    AddEvent(event.time, "warning", "'" + entity.name + "' was removed with the discarded map");
  }
}

void Session::Handle(const engine::SystemEvent& event, const engine::MapStartedAfterLoss& what) {
  const std::string before = NameOf(what.lost_in);
  const std::string name = FreeMapName(before);
  AddMap(event.map, name);
  AddEvent(event.time, "map", "began " + name + ": the camera was lost in " + before);
}

void Session::Handle(const engine::SystemEvent&, const engine::KeyFrameOffered&) {
  if (saver_) saver_->InterruptMaintenance();  // the active map has priority
}

void Session::Handle(const engine::SystemEvent&, const engine::JoinRequested&) {
  if (saver_) saver_->InterruptMaintenance();  // maintenance may be adjusting the map
}

void Session::Handle(const engine::SystemEvent& event, const engine::MapsJoined& what) {
  const auto into = maps_.find(event.map), from = maps_.find(what.from);
  if (into == maps_.end() || from == maps_.end()) return;
  AbsorbMap(&from->second, *what.joined, &into->second);
  const std::string sentence = "maps " + into->second.name + " and " + from->second.name + " were joined";
  AddEvent(
      event.time, "map",
      sentence + ": " + std::to_string(what.joined->points_merged) + " pairs of duplicate points were fused");
  for (Camera& camera : cameras_) Advise(&camera, sentence);
}

void Session::Handle(const engine::SystemEvent& event, const engine::JoinRefused& what) {
  AddEvent(event.time, "map",
           "maps " + NameOf(event.map) + " and " + NameOf(what.from) +
               " were not joined: " + TextOf(what.refusal, what.overlap));
}

void Session::Handle(const engine::SystemEvent& event, const engine::RigChanged& what) {
  std::string detail = NameOf(event.map) + ": " + what.estimate.ToString();
  if (what.estimate.rigid && options_.baseline_m > 0) {
    detail += ", one map unit is " + FormatNumber(options_.baseline_m / what.estimate.Baseline(), 4) + " m";
  }
  AddEvent(event.time, "rig", detail);
}

void Session::Handle(const engine::SystemEvent& event, const engine::CalibrationMismatch& what) {
  const std::string text = TextOf(what.mismatch);
  AddEvent(event.time, "warning", CameraPrefix(event.camera) + text);
  Advise(&cameras_[event.camera], text);
}

void Session::Handle(const engine::SystemEvent& event, const engine::LensEstimated& what) {
  cameras_[event.camera].model = what.lens.model;
  AddEvent(event.time, "lens",
           "Estimated calibration of camera \"" + what.lens.name + "\"" +
               (what.lens.fixed ? " (final)" : "") + ": focal length " + FormatFocalLength(what.lens));
}

void Session::Handle(const engine::SystemEvent& event, const engine::MapperFailed& what) {
  const std::string text = "Mapping has stopped because of an error: " + what.what +
                           " Tracking continues, and what was mapped is saved.";
  AddEvent(event.time, "warning", text);
  for (Camera& camera : cameras_) Advise(&camera, text);
}

void Session::Handle(const engine::SystemEvent& event, const engine::MapperEvent& what) {
  const std::optional<EventText> text = TextOf(what, NameOf(event.map));
  if (!text) return;
  AddEvent(event.time, text->event, text->detail);
  if (!std::holds_alternative<engine::MapperEvent::CalibrationContradicted>(what.what)) return;
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    if (!system_.EstimatedLensOf(i)) Advise(&cameras_[i], text->detail);
  }
}

// "Hall" becomes "Hall 2", and "Hall 2" becomes "Hall 3".
std::string Session::FreeMapName(const std::string& name) const {
  std::string stem = name;
  const std::size_t space = name.rfind(' ');
  if (space != std::string::npos && space + 1 < name.size() &&
      name.find_first_not_of("0123456789", space + 1) == std::string::npos)
    stem = name.substr(0, space);
  for (int number = 2;; ++number) {
    const std::string candidate = stem + " " + std::to_string(number);
    const bool taken = std::any_of(maps_.begin(), maps_.end(), [&](const auto& entry) {
      return entry.second.Exists() && entry.second.name == candidate;
    });
    if (!taken) return candidate;
  }
}

// `into` already has the joined snapshot. Edits in `from` can no longer be undone, as its content was moved.
void Session::AbsorbMap(SessionMap* from, const engine::JoinedMap& joined, SessionMap* into) {
  auto scene = std::make_shared<content::Scene>(*into->scene);
  MergeScene(*from->scene, into->name, from->name, joined, scene.get());
  into->scene = std::move(scene);
  into->joined_keys.push_back(from->key);
  into->joined_keys.insert(into->joined_keys.end(), from->joined_keys.begin(), from->joined_keys.end());
  from->joined_into = into->key;
  UpdatePermissions(*into);
  for (auto& [key, map] : maps_) {
    if (!map.Exists() || key == into->key) continue;
    auto other = std::make_shared<content::Scene>(*map.scene);
    if (maps::MayChangeContent(map.policy) && RedirectSceneSignposts(from->name, into->name, other.get()))
      map.scene = std::move(other);
  }
}

}  // namespace docent::app
