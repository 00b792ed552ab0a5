// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "content/language.h"
#include "content/map_settings.h"
#include "content/model.h"
#include "engine/geometry/sim3.h"

// The content of one map.
namespace docent::content {

// Limits of a scene: edits refuse what exceeds them, and scene_codec.h neither writes nor reads it. They are
// far beyond any room that is measured in map units, and keep all arithmetic finite.
inline constexpr double kMaxCoordinate = 1e6;         // map units
inline constexpr double kMinModelScale = 1e-9;        // map units per metre
inline constexpr double kMaxModelScale = 1e9;         // map units per metre
inline constexpr double kMinBoardHeight = 1e-6;       // map units
inline constexpr double kMaxBoardHeight = 1e6;        // map units
inline constexpr double kMinSoundRange = 1e-6;        // map units
inline constexpr double kMaxSoundRange = 1e6;         // map units
inline constexpr double kMinTrailWidth = 1e-6;        // map units
inline constexpr double kMaxTrailWidth = 1e6;         // map units
inline constexpr std::size_t kMinTrailPoints = 2;     // of one trail
inline constexpr std::size_t kMaxTrailPoints = 200;   // of one trail
inline constexpr double kMinOccluderSide = 1e-6;      // map units
inline constexpr double kMaxOccluderSide = 1e6;       // map units
inline constexpr std::size_t kMinOutlinePoints = 3;   // of one polygon
inline constexpr std::size_t kMaxOutlinePoints = 64;  // of one polygon
// Of a rotation; beyond it little of the angle is left of a double.
inline constexpr double kMaxAngle_deg = 1e6;
inline constexpr int kMaxAnimation = 1'000'000;       // Index of an animation of a model.
inline constexpr std::size_t kMaxTextBytes = 10'000;  // of each text and name
// With the texts below, the encoded scene stays within LoadLimits.
inline constexpr std::size_t kMaxEntities = 50'000;
inline constexpr std::size_t kMaxSceneTextBytes = 4u << 20;  // all names and texts together

inline constexpr std::size_t kMaxSceneWarpPoints = 50'000;    // Of all bent models together.
inline constexpr std::size_t kMaxSceneTranslations = 20'000;  // Of all texts together.
inline constexpr std::size_t kMaxSceneTrailPoints = 20'000;   // Of all trails and polygons together.

// A smooth deformation of a model (warp.h).
struct Warp;

// What a stored file is.
enum class AssetKind { kModel, kImage, kSound };

// A file as the library stores it, identified by the hash of its bytes: a model as one self-contained GLB, an
// image (PNG or JPEG) or a sound (WAV, FLAC or Ogg) as it is. Where only ids are needed, there are assets
// without bytes.
struct Asset {
  std::string id;                           // Lower-case hex of a hash of `bytes` with at least 128 bits.
  std::string name;                         // The file's name without its folder, for display.
  AssetKind kind = AssetKind::kModel;       // What the bytes are.
  std::vector<std::uint8_t> bytes;          // The file's bytes.
  std::shared_ptr<const Model> model = {};  // The decoded model, or a flat one that shows the image.
  double seconds = 0;                       // Length of a sound.
};

// A model in a map, or an image as a flat model. map_from_model transforms from glTF axes (y up) to the map.
struct PlacedModel {
  std::shared_ptr<const Asset> asset;  // Never null.
  engine::Sim3 map_from_model;         // Its scale is the number of map units per metre of the model.
  int animation = 0;                   // None if it is -1 or out of range.
  // Deforms the model, before map_from_model, into one without animations; null for none.
  std::shared_ptr<const Warp> warp;
};

// Length of a signpost's pole, below the board, in heights of the board.
inline constexpr double kSignpostPole = 0.7;

// A board with text that rotates about its `up` axis to face the reader; `anchor` is its foot in the map.
struct Signpost {
  std::string text;                                  // UTF-8.
  Translations translations;                         // Its variants in other languages, UTF-8.
  Eigen::Vector3d anchor = Eigen::Vector3d::Zero();  // In the map, map units.
  Eigen::Vector3d up = -Eigen::Vector3d::UnitY();    // Unit vector in the map.
  double height = 0.1;                               // Height of the board, in map units.
  std::uint64_t to_key = 0;  // Key of the map it leads to in the library; 0 for none, or if it is not known.
  // Name of the map it leads to when this was written, empty for none. Where there is a map with the key, its
  // name is shown instead.
  std::string to_map;
  // Where one leaves for that map, seen from the board: a unit vector in the map. Empty if it is not known;
  // then the signpost has no arrow.
  std::optional<Eigen::Vector3d> direction;
};

// A text about a point of the map, on a board beside it that faces the reader. A leader line joins the two.
struct Label {
  std::string text;                                  // UTF-8.
  Translations translations;                         // Its variants in other languages, UTF-8.
  Eigen::Vector3d anchor = Eigen::Vector3d::Zero();  // The point, in map units.
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  // From there to the middle of the board's lower edge.
  Eigen::Vector3d up = -Eigen::Vector3d::UnitY();    // Unit vector in the map.
  double text_height = 0.05;                         // Height of a line of text, in map units.
};

// A sound that plays while the camera is near its position. Only authors see it.
struct Sound {
  std::shared_ptr<const Asset> asset;                  // Never null.
  std::string caption;                                 // Shown while it plays. UTF-8.
  Translations translations;                           // Variants of the caption.
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // In the map, map units.
  double range = 1;                                    // It plays within this distance, in map units.
};

// A way over a surface, drawn as a flat ribbon with arrows from its first point to its last one.
struct Trail {
  std::vector<Eigen::Vector3d> points;             // In the map; kMinTrailPoints to kMaxTrailPoints.
  Eigen::Vector3d up = -Eigen::Vector3d::UnitY();  // Unit vector across the surface, towards its front.
  double width = 0.1;                              // Of the ribbon, in map units.
};

// A shape that an author puts where a real thing is: content behind it is hidden, and it is not drawn itself
// but for authors. Its unit is the map unit, unless its pose has a scale.
struct Occluder {
  // In the shape's axes, where y is up and z the front.
  enum class Shape {
    kPlane,     // A rectangle across z, with its middle at the origin.
    kBox,       // It stands on the plane y = 0, with the origin in the middle of its base.
    kCylinder,  // The same, about the y axis.
    kPolygon,   // A flat area across z.
  };
  Shape shape = Shape::kBox;    // What it is.
  engine::Sim3 map_from_shape;  // Where it is.
  // Width, height and depth; the depth of a plane is 0, that of a cylinder its width. Not of a polygon.
  Eigen::Vector3d size = Eigen::Vector3d::Ones();
  // Of a polygon: its corners in x and y, kMinOutlinePoints to kMaxOutlinePoints, in either direction.
  std::vector<Eigen::Vector2d> outline;
};

// An entity with a name that is unique in its scene ("helmet", "helmet-2", "sign-1").
struct Entity {
  std::string name;  // Unique in the scene.
  // Which of the members below counts.
  enum class Kind { kModel, kSignpost, kLabel, kImage, kSound, kTrail, kOccluder };
  Kind kind = Kind::kSignpost;  // What it is.
  PlacedModel model;            // Of kModel and kImage; an image is neither animated nor bent.
  Signpost signpost;            // Of kSignpost.
  Label label;                  // Of kLabel.
  Sound sound;                  // Of kSound.
  Trail trail;                  // Of kTrail.
  Occluder occluder;            // Of kOccluder.
  bool locked = false;          // No edit but unlocking changes it.
  bool hidden = false;          // It is not drawn, and a sound does not play.
  std::string group;            // Shared by entities that are selected together; empty for none.
};

// "model", "signpost", "label", "image", "sound", "trail" or "occluder".
const char* NameOf(Entity::Kind kind);
// Whether Entity::model counts: a model or an image.
bool HasModel(const Entity& entity);
// The file that an entity needs; null for an entity without one.
std::shared_ptr<const Asset> AssetOf(const Entity& entity);
// The first text of a signpost, label or sound; null for other kinds.
std::string* TextOf(Entity* entity);
// The same of an entity that is not changed.
const std::string* TextOf(const Entity& entity);
// The variants of that text; null for kinds without text.
Translations* TranslationsOf(Entity* entity);
// The same of an entity that is not changed.
const Translations* TranslationsOf(const Entity& entity);
// The text of an entity for a reader of this language (TextFor); empty for kinds without text.
const std::string& ShownText(const Entity& entity, const std::string& language);

// The position of an entity in the map: of a model its origin, of an image its middle, of a signpost its
// foot, of a label its anchor, of a trail its first point, of an occluder its origin.
Eigen::Vector3d PlaceOf(const Entity& entity);
// The middle of a signpost's board in the map, in map units.
Eigen::Vector3d BoardMiddle(const Signpost& signpost);
// Place, rotation and size as one similarity. Of a model and an image it is map_from_model, of an occluder
// map_from_shape. Of a trail y is up, z the direction in which it begins, and the scale its width. Of the
// others the scale is the height of a signpost, that of a label's text, or the range of a sound, and there is
// no rotation.
engine::Sim3 PoseOf(const Entity& entity);
// Gives an entity this pose; where PoseOf has no rotation, none is taken.
void SetPose(const engine::Sim3& pose, Entity* entity);
// Lets a signpost lead to no map, and so in no direction.
void LeadNowhere(Signpost* signpost);
// Transforms an entity by a similarity of the map, wherever that takes it.
void TransformBy(const engine::Sim3& motion, Entity* entity);
// Transforms an entity after its anchor has moved in the map by `motion`. An entity that would leave the
// limits above stays as it is.
void MoveWithAnchor(const engine::Sim3& motion, Entity* entity);

// A value type with cheap copies (assets are shared), so that edits change a copy that then replaces the
// original.
struct Scene {
  std::vector<Entity> entities;  // In the order of placement.
  MapSettings settings = {};     // Of the map that holds the entities.

  // Null if there is none with that name.
  const Entity* Find(const std::string& name) const;
  // Returns the first unused name of "base", "base-2", "base-3" …
  std::string FreeName(const std::string& base) const;
  // Returns the first unused name of "base-1", "base-2" …
  std::string FreeNumberedName(const std::string& base) const;
  // The same with "sign".
  std::string FreeSignpostName() const { return FreeNumberedName("sign"); }
};

// What is wrong with an entity by itself, as the end of a sentence about it ("would have no name"); empty if
// nothing is.
std::string Validate(const Entity& entity);
// A sentence that says why the scene cannot be stored (a number outside its limits, a text that is not UTF-8,
// a name that is used twice, a model without its file); empty if it can.
std::string Validate(const Scene& scene);

// The part of Validate that concerns an entity's place, rotation and size.
std::string PoseProblem(const Entity& entity);

// The languages in which any text of a scene has a variant.
std::set<std::string> LanguagesOf(const Scene& scene);
// Those of `languages` in which an entity's text has no variant, so that their readers get the first text;
// empty for an entity without a text.
std::vector<std::string> MissingLanguages(const Entity& entity, const std::set<std::string>& languages);

// Of an entity's names and texts, as kMaxSceneTextBytes counts them.
std::size_t TextBytes(const Entity& entity);
// What the limits of a whole scene count.
struct SceneTally {
  std::size_t text_bytes = 0;    // See TextBytes.
  std::size_t translations = 0;  // Of all texts.
  std::size_t warp_points = 0;   // Of all bent models.
  std::size_t trail_points = 0;  // Of all trails and polygons.
  // Counts an entity. If a limit would be exceeded, it is not counted, and the sentence says which limit.
  std::string Add(const Entity& entity);
};

// The base of an entity's name for a model's file: its name without folder and extension, in which bytes that
// are not UTF-8 are replaced.
std::string NameFromFile(const std::filesystem::path& file);

}  // namespace docent::content
