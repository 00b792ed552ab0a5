// SPDX-License-Identifier: Apache-2.0
#include "app/session/system_event_handler.h"

#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "app/files/text_file.h"
#include "app/output/engine_text.h"
#include "app/session/joined_scenes.h"
#include "content/map_settings.h"
#include "maps/library/signposts.h"

namespace docent::app {

namespace {

std::string Percent(double ratio) {
  return std::to_string(std::lround(100 * ratio)) + " %";
}

std::string ReasonOf(const engine::MapDiscarded& what, const std::string& other) {
  using Reason = engine::MapDiscarded::Reason;
  switch (what.reason) {
    case Reason::kFalseDepth:
      if (what.fault.jump > 0)
        return "its depth was wrong: the camera relocalized " + Percent(what.fault.jump) +
               " of the depth away from where it had just been";
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

// By what signposts know a map.
maps::MapInfo IdentityOf(const SessionMap& map) {
  maps::MapInfo info;
  info.key = map.key;
  info.name = map.name;
  return info;
}

bool LeadsTo(const content::Signpost& signpost, const maps::MapInfo& map) {
  return maps::LeadsTo({signpost.to_key, signpost.to_map}, map);
}

std::string TextOf(const engine::CalibrationMonitor::Mismatch& mismatch) {
  const auto radius = [](double px) { return std::to_string(std::lround(px)); };
  const auto pixels = [](double px) { return FormatNumber(std::round(10 * px) / 10, 3); };
  return "The calibration does not fit this lens: points " + radius(mismatch.outward_radius_px) +
         " pixels from the image centre appear " + pixels(mismatch.outward_px) +
         " pixels too far out, and points " + radius(mismatch.inward_radius_px) + " pixels from it appear " +
         pixels(mismatch.inward_px) +
         " pixels too far in. Calibrate the camera again with `docent calibrate`.";
}

}  // namespace

void SystemEventHandler::HandleEvents() {
  for (const engine::SystemEvent& event : system_.TakeEvents())
    std::visit([&](const auto& what) { Handle(event, what); }, event.what);
}

void SystemEventHandler::ReportRejection(const engine::TrackedFrame& frame) {
  SessionCamera& camera = state_.cameras[CameraOf(frame)];
  const auto name = [this](std::uint64_t key) { return state_.NameOf(key); };
  const bool is_new = camera.relocalization_message.Update(frame.frame.time, engine::HasPose(frame.state),
                                                           frame.relocalization, name);
  if (!is_new) return;
  state_.AddEvent(frame.frame.time, "rejected",
                  state_.CameraPrefix(CameraOf(frame)) +
                      ReasonOf(camera.relocalization_message.rejection(), frame.relocalization.inliers));
}

void SystemEventHandler::Handle(const engine::SystemEvent& event, const engine::MapEntered&) {
  state_.AddEvent(event.time, "map", "entered " + state_.NameOf(event.map));
  memory_.PinMapsInUse();
  if (const SessionMap* const map = state_.FindMap(event.map)) memory_.ExpectNeighbours(*map);
  saving_.InterruptMaintenance();  // maintenance may be adjusting this map
}

void SystemEventHandler::Handle(const engine::SystemEvent& event, const engine::Relocalized&) {
  const std::string by =
      state_.cameras.size() > 1 ? " by camera " + std::to_string(event.camera) : std::string();
  state_.AddEvent(event.time, "relocalized", state_.NameOf(event.map) + by);
}

void SystemEventHandler::Handle(const engine::SystemEvent& event, const engine::PoseRejected&) {
  state_.cameras[event.camera].relocalization_message = {};
}

void SystemEventHandler::Handle(const engine::SystemEvent& event, const engine::MapLeft& what) {
  const auto found = state_.maps.find(event.map);
  if (found == state_.maps.end()) return;
  if (!what.forgotten) {
    if (options_.may_write) saving_.SaveMap(&found->second, event.time);
    return;
  }
  state_.AddEvent(event.time, "warning",
                  "the map " + found->second.name + " was not created, because it was never initialized");
  state_.Retarget(event.map, found->second.name, 0, "");
  state_.maps.erase(found);
}

void SystemEventHandler::Handle(const engine::SystemEvent& event, const engine::MapUpdated& what) {
  if (SessionMap* const map = state_.FindMap(event.map)) map->UpdateSnapshot(what.snapshot);
}

void SystemEventHandler::Handle(const engine::SystemEvent& event, const engine::MapDiscarded& what) {
  SessionMap* const found = state_.FindMap(event.map);
  if (found == nullptr) return;
  SessionMap& map = *found;
  map.Discard();
  state_.AddEvent(event.time, "map",
                  "discarded " + map.name + ": " + ReasonOf(what, state_.NameOf(what.other)));
  if (what.replacement == 0) {
    state_.Retarget(event.map, map.name, 0, "");
    return;
  }
  state_.AddMap(what.replacement, map.name);
  state_.Retarget(event.map, map.name, what.replacement, map.name);
  // Content of the false initialization has lost its anchor.
  for (const content::Entity& entity : map.scene->entities) {
    state_.AddEvent(event.time, "warning", "'" + entity.name + "' was removed with the discarded map");
  }
}

void SystemEventHandler::Handle(const engine::SystemEvent& event, const engine::MapStartedAfterLoss& what) {
  const std::string before = state_.NameOf(what.lost_in);
  const std::string name = state_.FreeMapName(before);
  state_.AddMap(event.map, name);
  state_.AddEvent(event.time, "map", "started " + name + ": the camera was lost in " + before);
}

// Maintenance goes on: its thread has a lower priority than those of the active map.
void SystemEventHandler::Handle(const engine::SystemEvent&, const engine::KeyFrameOffered&) {}

void SystemEventHandler::Handle(const engine::SystemEvent&, const engine::JoinRequested&) {
  saving_.InterruptMaintenance();  // maintenance may be adjusting the map
}

void SystemEventHandler::Handle(const engine::SystemEvent& event, const engine::MapsJoined& what) {
  SessionMap* const into = state_.FindMap(event.map);
  SessionMap* const from = state_.FindMap(what.from);
  if (into == nullptr || from == nullptr) return;
  AbsorbMap(from, *what.joined, into);
  const std::string sentence = "maps " + into->name + " and " + from->name + " were joined";
  state_.AddEvent(
      event.time, "map",
      sentence + ": " + std::to_string(what.joined->points_merged) + " pairs of duplicate points were fused");
  for (SessionCamera& camera : state_.cameras) camera.Advise(sentence);
}

void SystemEventHandler::Handle(const engine::SystemEvent& event, const engine::JoinRefused& what) {
  const std::string sentence =
      "maps " + state_.NameOf(event.map) + " and " + state_.NameOf(what.from) + " were not joined: ";
  state_.AddEvent(event.time, "map", sentence + TextOf(what.refusal, what.overlap));
  if (!what.asked) return;
  for (SessionCamera& camera : state_.cameras)
    camera.Advise(sentence + TextForAuthors(what.refusal, what.overlap));
}

void SystemEventHandler::Handle(const engine::SystemEvent& event, const engine::RigChanged& what) {
  std::string detail = state_.NameOf(event.map) + ": " + TextOf(what.estimate);
  if (what.estimate.rigid && options_.baseline_m > 0) {
    const double metres_per_unit = options_.baseline_m / what.estimate.Baseline();
    detail += ", one map unit is " + FormatNumber(metres_per_unit, 4) + " m";
    AddScale(event.map, metres_per_unit);
  }
  state_.AddEvent(event.time, "rig", detail);
}

void SystemEventHandler::Handle(const engine::SystemEvent& event, const engine::CalibrationMismatch& what) {
  state_.AddEvent(event.time, "warning", state_.CameraPrefix(event.camera) + TextOf(what.mismatch));
  if (!options_.may_write) return;  // Visitors cannot help it.
  state_.cameras[event.camera].Advise(
      "The calibration does not fit the lens of this camera, so that maps become less accurate. Calibrate it "
      "again with `docent calibrate`.");
}

void SystemEventHandler::Handle(const engine::SystemEvent& event, const engine::LensEstimated& what) {
  state_.cameras[event.camera].model = what.lens.model;
  state_.AddEvent(event.time, "lens",
                  "Estimated calibration of camera \"" + what.lens.name + "\"" +
                      (what.lens.fixed ? " (final)" : "") + ": focal length " + FormatFocalLength(what.lens));
}

void SystemEventHandler::Handle(const engine::SystemEvent& event, const engine::MapperFailed& what) {
  const std::string error = what.what + (what.what.ends_with('.') ? "" : ".");
  if (!options_.may_write) {  // Visitors cannot help it.
    state_.AddEvent(event.time, "warning",
                    "Visual odometry beyond the maps has stopped because of an error: " + error +
                        " Tracking in the maps continues.");
    return;
  }
  const std::string text = "Mapping has stopped because of an error: " + error +
                           " Tracking continues, and what was mapped is saved.";
  state_.AddEvent(event.time, "warning", text);
  for (SessionCamera& camera : state_.cameras) camera.Advise(text);
}

void SystemEventHandler::Handle(const engine::SystemEvent& event, const engine::MapperEvent& what) {
  const std::optional<EventText> text = TextOf(what, state_.NameOf(event.map));
  if (!text) return;
  state_.AddEvent(event.time, text->event, text->detail);
  // A map that is initialized from a target is in metres.
  if (options_.tracker.target && std::holds_alternative<engine::MapperEvent::MapStarted>(what.what))
    AddScale(event.map, 1);
  if (!std::holds_alternative<engine::MapperEvent::CalibrationContradicted>(what.what)) return;
  for (std::size_t i = 0; i < state_.cameras.size(); ++i) {
    if (system_.EstimatedLensOf(i)) continue;
    state_.cameras[i].Advise(
        "The calibration of this camera is probably wrong. Calibrate it with `docent calibrate`.");
  }
}

void SystemEventHandler::AddScale(std::uint64_t key, double metres_per_unit) {
  SessionMap* const map = state_.FindMap(key);
  if (!options_.may_write || map == nullptr || !map->Exists() || !maps::MayChangeContent(map->policy)) return;
  if (map->scene->settings.metres_per_unit != 0) return;
  content::MapSettings gained;
  gained.metres_per_unit = metres_per_unit;
  if (!content::Validate(gained).empty()) return;
  auto scene = std::make_shared<content::Scene>(*map->scene);
  scene->settings.metres_per_unit = metres_per_unit;
  map->history.AddSettings(gained);
  map->Follow(std::move(scene));
}

// `into` already has the joined snapshot. Edits in `from` can no longer be undone, as its content was moved.
void SystemEventHandler::AbsorbMap(SessionMap* from, const engine::JoinedMap& joined, SessionMap* into) {
  auto scene = std::make_shared<content::Scene>(*into->scene);
  const maps::MapInfo map_into = IdentityOf(*into), map_from = IdentityOf(*from);
  MergeScene(*from->scene, map_into, map_from, joined, into->history.Names(), scene.get());
  content::MapSettings gained = scene->settings;
  if (into->scene->settings.up) gained.up.reset();
  if (into->scene->settings.metres_per_unit != 0) gained.metres_per_unit = 0;
  into->history.AddSettings(gained);
  into->scene = std::move(scene);
  into->history.RetargetSignposts([&](content::Signpost* signpost) {
    if (!LeadsTo(*signpost, map_into) && !LeadsTo(*signpost, map_from)) return false;
    content::LeadNowhere(signpost);
    return true;
  });
  into->joined_keys.push_back(from->key);
  into->joined_keys.insert(into->joined_keys.end(), from->joined_keys.begin(), from->joined_keys.end());
  from->joined_into = into->key;
  system_.SetPermissions(into->key, into->Permissions());
  for (auto& [key, map] : state_.maps) {
    if (!map.Exists() || key == into->key || !maps::MayChangeContent(map.policy)) continue;
    auto other = std::make_shared<content::Scene>(*map.scene);
    const bool changed = RedirectSceneSignposts(map_from, map_into, other.get());
    const bool history_changed = map.history.RetargetSignposts([&](content::Signpost* signpost) {
      if (!LeadsTo(*signpost, map_from)) return false;
      signpost->to_map = map_into.name;
      signpost->to_key = map_into.key;
      return true;
    });
    // The history is saved with the scene.
    if (changed || history_changed) map.Follow(std::move(other));
  }
}

}  // namespace docent::app
