// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "app/command_line/author_view.h"
#include "app/script/commands.h"
#include "ui/authoring_actions.h"

namespace docent::app {

// What a click with the occluder tool places; a plane stands on the surface.
PlaceOccluder OccluderAt(const ui::AuthoringChoices& choices, const Eigen::Vector2d& pixel);

// Makes commands of the clicks that place something with the chosen tool. A trail takes two clicks; further
// ones extend it as long as it is selected. On the window's thread.
class PlacingTool {
 public:
  // The command for a click at this pixel. Empty, with a note that says why or what comes next, if there is
  // none. `trail` is the name of the selected trail; empty for none.
  std::optional<Command> Click(const AuthorView& view, const ui::AuthoringChoices& choices,
                               const Eigen::Vector2d& pixel, const std::string& trail, std::string* note);
  // Forgets the beginning of a trail. Returns whether there was one.
  bool Cancel();
  // The point of the map where the trail begins whose second point is still missing.
  const std::optional<Eigen::Vector3d>& trail_begin() const { return trail_begin_; }

 private:
  std::optional<Command> ClickTrail(const AuthorView& view, const Eigen::Vector2d& pixel,
                                    const std::string& trail, std::string* note);

  std::optional<Eigen::Vector3d> trail_begin_;
};

}  // namespace docent::app
