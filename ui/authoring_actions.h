// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "content/scene.h"
#include "engine/geometry/rigid3.h"
#include "engine/geometry/sim3.h"
#include "ui/selection.h"

// What passes between the author's window and the program: what the window shows, what the person chose in
// it, and what the person asks for. On the window's thread.
namespace docent::ui {

// The pose that an entity gets; see TransformOf in entity_shapes.h.
struct NewPose {
  std::string name;
  engine::Sim3 map_from_entity;
};

// What happens while a model is fitted to the room by pairs of points.
enum class FitStep { kBegin, kRemoveLast, kAlign, kBend, kEnd };

// What a person asks for. Implementations do not throw; what cannot be done becomes a message.
class AuthoringActions {
 public:
  virtual ~AuthoringActions() = default;
  virtual void NewMap(const std::string& name) = 0;
  virtual void StopMap() = 0;
  // Goes on in a map of the library.
  virtual void UseMap(const std::string& name) = 0;
  virtual void RenameMap(const std::string& name, const std::string& new_name) = 0;
  virtual void RemoveMap(const std::string& name) = 0;
  // Joins the map into the current one if both show the same place.
  virtual void JoinMap(const std::string& name) = 0;
  // `policy`: one of strings::kPolicies.
  virtual void SetPolicy(const std::string& name, const std::string& policy) = 0;
  virtual void Undo() = 0;
  virtual void Redo() = 0;
  virtual void Save() = 0;
  virtual void Quit(bool save) = 0;
  // Opens the file dialog of the desktop for a file of this kind, which the choices then name.
  virtual void ChooseFile(content::AssetKind kind) = 0;

  // `add`: adds it to the selection, or takes it from there.
  virtual void Select(const std::string& name, bool add) = 0;
  virtual void RemoveSelected() = 0;
  virtual void DuplicateSelected() = 0;
  virtual void CopySelected() = 0;
  virtual void Paste() = 0;
  virtual void Rename(const std::string& name, const std::string& new_name) = 0;
  // For readers of this language, which is a tag (content/language.h); empty: for all others.
  virtual void SetText(const std::string& name, const std::string& text, const std::string& language) = 0;
  // Of the board of a label, in map units along the map's axes.
  virtual void SetOffset(const std::string& name, const Eigen::Vector3d& offset) = 0;
  // Removes the last point of a trail.
  virtual void ShortenTrail(const std::string& name) = 0;
  // Width, height and depth of an occluder that is no polygon; the depth counts only of a box.
  virtual void SetOccluderSize(const std::string& name, const Eigen::Vector3d& size) = 0;
  // To no map with an empty name.
  virtual void SetTarget(const std::string& name, const std::string& to_map) = 0;
  // Where one leaves for the map that a signpost leads to, as a vector of any length along the map's axes;
  // empty if it is not known.
  virtual void SetDirection(const std::string& name, const std::optional<Eigen::Vector3d>& direction) = 0;
  // The same, the viewing direction of the camera.
  virtual void PointAhead(const std::string& name) = 0;
  virtual void SetLocked(const std::vector<std::string>& names, bool locked) = 0;
  virtual void SetHidden(const std::vector<std::string>& names, bool hidden) = 0;
  virtual void Group(const std::vector<std::string>& names) = 0;
  virtual void Ungroup(const std::vector<std::string>& names) = 0;
  // All together, as one change.
  virtual void Transform(const std::vector<NewPose>& poses) = 0;

  // Begins with the selected model, takes the last point back, moves or bends the model so that the pairs
  // fit, or ends.
  virtual void Fit(FitStep step) = 0;
  // Gives a bent model its original shape again.
  virtual void Unbend(const std::string& name) = 0;

  // Of the current map: its keyframes say which way is up; its scale is not known.
  virtual void ForgetUp() = 0;
  virtual void ForgetScale() = 0;
  // Visitors find the current map by an image of the present view, or by its first one.
  virtual void SetEntrance(bool here) = 0;

  virtual void ToggleFullScreen() = 0;
};

// A map of the library.
struct MapFacts {
  std::string name;
  std::string policy;                        // One of strings::kPolicies.
  bool is_initialized = false;               // It has keyframes, here or in the library.
  bool objects_known = false;                // It is in memory, so that its size and content are known.
  std::uint64_t keyframes = 0, objects = 0;  // Valid with objects_known.
};

// A model that is being fitted to the room by pairs of points.
struct FitFacts {
  std::string name;
  bool waits_for_place = false;  // The next click says where the last point of the model belongs.
  std::size_t pairs = 0;
  std::vector<double> residuals;  // Of each pair if the model is aligned, map units; empty if it cannot be.
  std::vector<bool> used;         // Of each pair: whether it agrees with the others.
  std::string problem;            // Why it cannot be aligned, as a sentence; often empty.
};

// What the window shows. The pointers are valid while it is drawn.
struct AuthoringFacts {
  std::vector<MapFacts> maps;  // All of the library, by name.
  std::string map_name;        // Of the current map; empty for none.
  bool starting = false;       // The current map has no depth yet.
  bool unsaved = false;
  std::optional<double> saved_ago_s;      // Since the last save; empty before the first.
  const content::Scene* scene = nullptr;  // Of the current map; null without one.
  std::uint64_t map_key = 0;              // Of the map that the scene belongs to.
  // Valid with has_pose.
  engine::Rigid3 camera_from_map;
  bool has_pose = false;
  // The axes by which rotations are shown: right, up and towards the first viewer.
  engine::Rotation3 map_from_upright;
  const Selection* selection = nullptr;             // Never null when drawn.
  const std::vector<std::string>* files = nullptr;  // Model files to choose from; null for none.
  bool has_copy = false;                            // Something can be pasted.
  bool has_two_cameras = false;
  std::optional<FitFacts> fit;  // Empty while no model is being fitted.
};

// What a click in the image does.
enum class AuthoringTool { kSelect, kModel, kSignpost, kLabel, kImage, kSound, kTrail, kOccluder };

// What the next click in the image says about the space of the map, before the tool is used.
enum class MapPick { kNone, kFloor, kMeasureFrom, kMeasureTo };

// The person's choices. The panel shows and changes them, and so may its owner.
struct AuthoringChoices {
  AuthoringTool tool = AuthoringTool::kSelect;
  std::string map_name;
  std::string model_file;
  bool automatic_size = true;
  double scale = 1.0, yaw_deg = 0.0;
  std::string sign_text, sign_to_map;
  MapPick pick = MapPick::kNone;
  double length_m = 1;  // Between the two points that are measured.
  std::string label_text;
  std::string image_file;
  bool image_upright = false;  // Else flush with the surface.
  std::string sound_file, caption;
  content::Occluder::Shape occluder_shape = content::Occluder::Shape::kBox;  // No polygon.
  bool show_points = false, show_keyframes = false, show_boundary = true, show_status = true;
  bool from_above = false;     // The map from above instead of the image.
  bool show_coverage = false;  // A small map from above in a corner of the image.
  bool frozen = false;         // The image and its pose stay.
  bool panel_open = true;
};

}  // namespace docent::ui
