// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "content/edits.h"
#include "engine/base/time.h"
#include "engine/geometry/sim3.h"
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
struct RenameMap {
  std::string name, new_name;
  bool operator==(const RenameMap&) const = default;
};
// Removes the map with its content, which cannot be undone.
struct RemoveMap {
  std::string name;
  bool operator==(const RemoveMap&) const = default;
};
// Joins this map into the current one if both show the same place, which is found out while tracking goes on.
struct JoinMap {
  std::string name;
  bool operator==(const JoinMap&) const = default;
};
// Makes the level surface at a pixel the ground of the current map, or lets its keyframes say again which way
// is up.
struct SetMapUp {
  std::optional<Eigen::Vector2d> pixel = std::nullopt;
  bool operator==(const SetMapUp&) const = default;
};
// Says how far the surfaces at two pixels are apart, or, with length 0, that the scale of the current map is
// not known.
struct SetMapScale {
  Eigen::Vector2d from = Eigen::Vector2d::Zero(), to = Eigen::Vector2d::Zero();
  double length_m = 0;
  bool operator==(const SetMapScale&) const = default;
};
// Lets the image of the keyframe whose view is most like the camera's stand for the current map where
// visitors choose a place, or again that of its first keyframe.
struct SetMapEntrance {
  bool here = true;
  bool operator==(const SetMapEntrance&) const = default;
};
// The pixel denotes the point of the map's surface that is visible there in the command's frame.
struct PlaceModel {
  std::string file;  // as given; relative to the script's folder or the working folder
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  // Map units per metre of the model. Without it, the largest side of the model becomes a fifth of the
  // distance between the camera and the surface.
  std::optional<double> scale = std::nullopt;
  double yaw_deg = 0;  // about the up axis; at 0 the model faces the viewer
  bool operator==(const PlaceModel&) const = default;
};
struct PlaceSignpost {
  std::string text;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  std::string to_map;  // the map it leads to; empty for none
  bool operator==(const PlaceSignpost&) const = default;
};
// A text about the surface at the pixel, with a leader line to its board.
struct PlaceLabel {
  std::string text;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  // Of the board, in map units along the map's axes. Without it, the board is above the surface by a seventh
  // of its distance from the camera.
  std::optional<Eigen::Vector3d> offset = std::nullopt;
  bool operator==(const PlaceLabel&) const = default;
};
struct PlaceImage {
  std::string file;  // as that of a model
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  // Length of the longer side in map units; without it, a fifth of the distance, as for a model.
  std::optional<double> scale = std::nullopt;
  // False: it lies flush with the surface. True: it stands upright on it and faces the viewer.
  bool upright = false;
  bool operator==(const PlaceImage&) const = default;
};
struct PlaceSound {
  std::string file;     // as that of a model
  std::string caption;  // shown while it plays
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  // Within which it plays, in map units; without it, one and a half times the distance from the camera.
  std::optional<double> range = std::nullopt;
  bool operator==(const PlaceSound&) const = default;
};
// A point of the map: that of its surface at a pixel, or coordinates.
struct MapPoint {
  Eigen::Vector3d in_map = Eigen::Vector3d::Zero();  // map units; ignored with `pixel`
  std::optional<Eigen::Vector2d> pixel = std::nullopt;
  bool operator==(const MapPoint&) const = default;
};
struct PlaceTrail {
  std::vector<MapPoint> points;
  // Of the ribbon, in map units; without it, a fifteenth of the distance of the first point from the camera.
  std::optional<double> width = std::nullopt;
  bool operator==(const PlaceTrail&) const = default;
};
// Adds a point at the end of a trail.
struct ExtendTrail {
  std::string name;
  MapPoint point;
  bool operator==(const ExtendTrail&) const = default;
};
// Removes the last point of a trail.
struct ShortenTrail {
  std::string name;
  bool operator==(const ShortenTrail&) const = default;
};
// Puts a shape where a real thing is, so that content behind it is hidden.
struct PlaceOccluder {
  content::Occluder::Shape shape = content::Occluder::Shape::kBox;
  // In map units, as content::Occluder has it; without it, each side is a fifth of the distance. Not of a
  // polygon.
  std::optional<Eigen::Vector3d> size = std::nullopt;
  // Where it stands; the middle of a plane that does not stand; the corners of a polygon.
  std::vector<MapPoint> points;
  double yaw_deg = 0;  // Of a box, about the up axis; at 0 it faces the viewer.
  bool upright =
      false;  // Of a plane: it stands on the surface and faces the viewer, or else lies flush with it.
  bool operator==(const PlaceOccluder&) const = default;
};
// Gives an occluder that is no polygon other sides.
struct ResizeOccluder {
  std::string name;
  Eigen::Vector3d size = Eigen::Vector3d::Ones();  // width, height and depth; the depth counts only of a box
  bool operator==(const ResizeOccluder&) const = default;
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
// The pose that a model gets. A signpost gets its translation as its place and its scale as its height.
struct EntityPose {
  std::string name;
  engine::Sim3 map_from_entity;
  // Rotations are equal when they are equal after all rounding (Settled).
  bool operator==(const EntityPose& other) const;
};
struct TransformEntities {
  std::vector<EntityPose> poses;
  bool operator==(const TransformEntities&) const = default;
};
// A point of a model and its place in the map: a point of the surface at a pixel, or coordinates.
struct PointPair {
  Eigen::Vector3d in_model = Eigen::Vector3d::Zero();  // model axes, metres
  Eigen::Vector3d in_map = Eigen::Vector3d::Zero();    // map units; ignored with `pixel`
  std::optional<Eigen::Vector2d> pixel;
  bool operator==(const PointPair&) const = default;
};
// Gives a model the pose that fits the pairs best; see content/alignment.h.
struct AlignEntity {
  std::string name;
  std::vector<PointPair> pairs;
  bool operator==(const AlignEntity&) const = default;
};
// Bends a model so that it fits each pair exactly; see content/warp.h.
struct BendEntity {
  std::string name;
  std::vector<PointPair> pairs;
  bool operator==(const BendEntity&) const = default;
};
struct UnbendEntity {
  std::string name;
  bool operator==(const UnbendEntity&) const = default;
};
struct RemoveEntities {
  std::vector<std::string> names;
  bool operator==(const RemoveEntities&) const = default;
};
// Each copy stands beside its original.
struct DuplicateEntities {
  std::vector<std::string> names;
  bool operator==(const DuplicateEntities&) const = default;
};
struct RenameEntity {
  std::string name, new_name;
  bool operator==(const RenameEntity&) const = default;
};
// Of a signpost, a label, or the caption of a sound.
struct SetEntityText {
  std::string name, text;
  // A tag as "de" or "es-419": the variant in this language, which an empty text removes. Empty: the text for
  // all other readers.
  std::string language = {};
  bool operator==(const SetEntityText&) const = default;
};
// Puts the board of a label elsewhere beside what it is about.
struct SetLabelOffset {
  std::string name;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  // map units along the map's axes
  bool operator==(const SetLabelOffset&) const = default;
};
struct SetSignpostTarget {
  std::string name;
  std::string to_map;  // the map it leads to; empty for none
  bool operator==(const SetSignpostTarget&) const = default;
};
// Says where one leaves for the map that a signpost leads to; its arrow points there.
struct SetSignpostDirection {
  std::string name;
  // Of any length along the map's axes; empty: it is not known. Ignored with `ahead`.
  std::optional<Eigen::Vector3d> direction = std::nullopt;
  bool ahead = false;  // The viewing direction of the camera in the command's frame.
  bool operator==(const SetSignpostDirection&) const = default;
};
// Locks, unlocks, hides or shows entities.
struct SetEntityFlag {
  std::vector<std::string> names;
  content::EntityFlag flag = content::EntityFlag::kLocked;
  bool value = true;
  bool operator==(const SetEntityFlag&) const = default;
};
struct GroupEntities {
  std::vector<std::string> names;
  std::string group;  // empty: they are in no group any more
  bool operator==(const GroupEntities&) const = default;
};
// Copies entities of a map (which may be this one) to the surface at the pixel, or at the middle of the image
// without one, where the middle of their bases then is. What is copied from another map is turned upright,
// and is scaled by the ratio of the distances at which the first keyframes of the two maps see them.
struct PasteEntities {
  std::vector<std::string> names;
  std::string from_map;
  std::optional<Eigen::Vector2d> to_pixel;
  bool operator==(const PasteEntities&) const = default;
};
// What a visitor does on a tour. Everything else is refused there but UseMap.
struct GuideVisitor {
  enum class Step {
    kSkip,   // Passes over the next stop; only on a tour with stops.
    kBack,   // Leads back to the stop before; only on a tour with stops.
    kOpen,   // Opens the card of the entity with this name.
    kPress,  // The one button: opens the card of what is marked, turns its page, or closes it after the last.
    kMark,   // Marks the next thing in view that has a card.
    kClose,  // Closes the card.
    kRestart,   // Begins anew, as for the next visitor.
    kContinue,  // Goes on with a tour that was left, when the visitor is asked (LeftTour).
  };
  Step step = Step::kSkip;
  std::string name = {};  // Only of kOpen.
  bool operator==(const GuideVisitor&) const = default;
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

using Command = std::variant<NewMap, StopMap, UseMap, SetPolicy, RenameMap, RemoveMap, JoinMap, SetMapUp,
                             SetMapScale, SetMapEntrance, PlaceModel, PlaceSignpost, PlaceLabel, PlaceImage,
                             PlaceSound, PlaceTrail, ExtendTrail, ShortenTrail, PlaceOccluder, ResizeOccluder,
                             SetLabelOffset, MoveEntity, RotateEntity, ScaleEntity, TransformEntities,
                             AlignEntity, BendEntity, UnbendEntity, RemoveEntities, DuplicateEntities,
                             RenameEntity, SetEntityText, SetSignpostTarget, SetSignpostDirection,
                             SetEntityFlag, GroupEntities, PasteEntities, GuideVisitor, Undo, Redo, Save>;

// The same rotation, with a quaternion that normalizing does not change any more. A command that was written
// to a script and read again thereby has exactly the rotation of the original.
engine::Rotation3 Settled(const engine::Rotation3& rotation);

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
