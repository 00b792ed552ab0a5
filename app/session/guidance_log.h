// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "app/files/checked_file.h"
#include "app/session/way_on.h"
#include "engine/tracking/tracked_frame.h"

namespace docent::app {

// Logs which way a visitor is shown, in guidance.csv: one line for each frame with a way on,
// `timestamp,camera,map,signpost,to,towards,x,y,z,u,v`. `towards` is `signpost` or `direction`
// (ShownWay::follows_direction), x, y and z are the unit vector ShownWay::towards, and u and v the pixel of
// the arrow's tip. One thread.
class GuidanceLog {
 public:
  // Throws Error when the file cannot be created.
  explicit GuidanceLog(const std::filesystem::path& folder);

  // The way that is shown in a frame with a pose in the map of this name.
  void Add(const engine::TrackedFrame& frame, const std::string& map_name, const ShownWay& way);
  // Completes the file; throws Error when that fails.
  void Close() { file_.Close(); }

 private:
  CheckedFile file_;
};

}  // namespace docent::app
