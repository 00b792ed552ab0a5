// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "app/output/run_output.h"
#include "app/session/relocalization_message.h"
#include "app/session/session_map.h"
#include "engine/base/time.h"
#include "engine/geometry/camera_model.h"
#include "engine/tracking/tracked_frame.h"

namespace docent::app {

// What a camera's user is told.
struct SessionCamera {
  // The sentence is shown for 15 s in image time, unless another one replaces it.
  void Advise(const std::string& sentence);

  std::shared_ptr<const engine::CameraModel> model;
  Timestamp last_time{};
  std::string advice;  // shown until advice_end
  Timestamp advice_end{};
  RelocalizationMessage relocalization_message;
};

// The index in the session of the camera that took the frame.
inline std::size_t CameraOf(const engine::TrackedFrame& frame) {
  return static_cast<std::size_t>(frame.frame.camera);
}

// What a Session knows of its cameras and maps, and what happened to them, in words. The session's mutex
// guards all of it.
struct SessionState {
  explicit SessionState(std::vector<std::shared_ptr<const engine::CameraModel>> models);

  void AddEvent(Timestamp time, std::string event, std::string detail);
  Timestamp LastTime() const;                          // the latest of any camera
  std::string CameraPrefix(std::size_t camera) const;  // empty when there is only one

  SessionMap& AddMap(std::uint64_t key, const std::string& name);
  // Null if no map has this key.
  SessionMap* FindMap(std::uint64_t key);
  // Null if no map that exists has this name.
  SessionMap* FindByName(const std::string& name);
  // Throws Error if there is no map with this name, or if it has no snapshot.
  SessionMap& InitializedMap(const std::string& name);
  std::string NameOf(std::uint64_t key) const;  // empty when the session has no such map
  // Makes a signpost that was read from the library lead to where its map is now: by its key, with the name
  // that the map has, to the map that it was joined into, or nowhere if it was discarded. Without a key, as
  // in an older library, by its name. One that leads to no map of the session stays as it is. Returns whether
  // it changed.
  bool Resolve(content::Signpost* signpost) const;
  // A name for a map that continues the one of this name: "Hall" becomes "Hall 2", and "Hall 2" "Hall 3". The
  // name of a map that was joined into another one is not used again: frames.csv has it for the images
  // before.
  std::string FreeMapName(const std::string& name) const;
  // Signposts that lead to one map lead to another one from now on, or nowhere (key 0). This is no edit that
  // could be undone: it follows from what happened to the maps.
  void Retarget(std::uint64_t from_key, const std::string& from, std::uint64_t to_key, const std::string& to);

  std::vector<SessionCamera> cameras;
  std::map<std::uint64_t, SessionMap> maps;
  std::vector<Event> events;
};

}  // namespace docent::app
