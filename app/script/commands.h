// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "engine/base/time.h"
#include "maps/storage/policy.h"

// Every change that a user can make, as data. The window, script files and tests all use these structs; the
// session executes them. They do not depend on how that is done. docs/scripts.md describes them for users.
namespace docent::app {

struct NewMap {
  std::string name;
  bool operator==(const NewMap&) const = default;
};
// Stop extending the current map and leave it.
struct StopMap {
  bool operator==(const StopMap&) const = default;
};
struct UseMap {
  std::string name;
  bool operator==(const UseMap&) const = default;
};
struct SetPolicy {
  std::string name;  // of the map
  maps::Policy policy = maps::Policy::kOpen;
  bool operator==(const SetPolicy&) const = default;
};
// The pixel denotes the point of the map's surface that is visible there in the command's frame.
struct PlaceModel {
  std::string file;  // as given; relative to the script's folder or the working folder
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double scale = 1;    // map units per metre of the model
  double yaw_deg = 0;  // about the surface's normal
  bool operator==(const PlaceModel&) const = default;
};
struct PlaceSignpost {
  std::string text;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  std::string to_map;  // the map it leads to; empty for none
  bool operator==(const PlaceSignpost&) const = default;
};
struct MoveEntity {
  std::string name;
  // Map units along the map's axes; ignored with `to_pixel`.
  Eigen::Vector3d by_in_map = Eigen::Vector3d::Zero();
  std::optional<Eigen::Vector2d> to_pixel;
  bool operator==(const MoveEntity&) const = default;
};
struct RotateEntity {
  std::string name;
  double angle_deg = 0;  // about the entity's own up axis
  bool operator==(const RotateEntity&) const = default;
};
struct ScaleEntity {
  std::string name;
  double factor = 1;  // positive
  bool operator==(const ScaleEntity&) const = default;
};
struct RemoveEntity {
  std::string name;
  bool operator==(const RemoveEntity&) const = default;
};
struct Undo {
  bool operator==(const Undo&) const = default;
};
struct Redo {
  bool operator==(const Redo&) const = default;
};
struct Save {
  bool operator==(const Save&) const = default;
};

using Command = std::variant<NewMap, StopMap, UseMap, SetPolicy, PlaceModel, PlaceSignpost, MoveEntity,
                             RotateEntity, ScaleEntity, RemoveEntity, Undo, Redo, Save>;

// What is wrong with the command's values, whatever the map holds, as a sentence without capital and full
// stop
// ("the scale must be between 1e-09 and 1e+09"); empty if nothing is. Every command is checked where it
// enters: when a script is parsed, and before the session executes one.
std::string Validate(const Command& command);

struct TimedCommand {
  Timestamp time{};  // from the first frame; not negative
  int line = 0;      // in the script; 0 for a command from elsewhere
  Command command;
};

}  // namespace docent::app
