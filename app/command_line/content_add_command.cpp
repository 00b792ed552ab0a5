// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/content_add_command.h"

#include <CLI/CLI.hpp>
#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>
#include <string>

#include "app/command_line/number_option.h"
#include "app/command_line/stored_scene.h"
#include "app/script/script_file.h"
#include "app/session/file_kind.h"
#include "app/session/library_scene.h"
#include "app/session/map_axes.h"
#include "app/session/new_entities.h"
#include "app/session/session_options.h"
#include "content/asset.h"
#include "content/edits.h"
#include "content/placement.h"
#include "engine/base/error.h"
#include "engine/map/upright_axes.h"
#include "maps/library/library.h"
#include "maps/library/session_lock.h"

namespace docent::app {

namespace {

// See the help for units and frames.
struct AddOptions {
  std::filesystem::path library, file;
  std::string map, name;
  std::string signpost, label, trail, occluder, caption, to_map;
  std::optional<Eigen::Vector3d> position, offset, direction;
  std::optional<double> scale, height, range, width;
  double yaw_deg = 0;
  std::optional<Eigen::Quaterniond> rotation;
};

// Where an entity is added. Lengths that are not given are those of a click at the median distance of what
// the first keyframe shows.
struct Target {
  engine::UprightAxes axes;
  double distance = 1;
};

// A model or an image stands upright and faces the place of the first keyframe's camera, unless a rotation is
// given.
void StandUp(const AddOptions& options, const Target& target, double scale, content::Entity* entity) {
  engine::Sim3& pose = entity->model.map_from_model;
  pose = content::UprightPose(*options.position, -target.axes.ahead, target.axes.up,
                              options.yaw_deg * std::numbers::pi / 180, scale);
  if (options.rotation) pose.rotation = engine::Rotation3(*options.rotation);
  pose.translation += *options.position - content::BaseInMap(*entity);
}

content::Entity NewFromFile(const AddOptions& options, const Target& target) {
  content::Entity entity;
  switch (KindOfFile(options.file)) {
    case content::AssetKind::kSound: {
      const auto sound = std::make_shared<content::Asset>(content::ImportSound(options.file));
      entity = NewSound(sound, *options.position, target.distance);
      entity.sound.caption = options.caption;
      if (options.range) entity.sound.range = *options.range;
      break;
    }
    case content::AssetKind::kImage:
      entity.kind = content::Entity::Kind::kImage;
      entity.model.asset = std::make_shared<content::Asset>(content::ImportImage(options.file));
      StandUp(options, target, options.scale.value_or(SessionOptions().model_side * target.distance),
              &entity);
      break;
    case content::AssetKind::kModel:
      entity.kind = content::Entity::Kind::kModel;
      entity.model.asset = std::make_shared<content::Asset>(content::ImportAsset(options.file));
      for (const std::string& warning : entity.model.asset->model->warnings)
        std::fprintf(stderr, "Warning: %s\n", warning.c_str());
      StandUp(options, target, options.scale.value_or(1), &entity);
      break;
  }
  return entity;
}

content::Entity NewSignpost(const AddOptions& options, const Target& target, std::uint64_t to_key) {
  content::Entity entity;
  entity.signpost.text = options.signpost;
  entity.signpost.anchor = *options.position;
  entity.signpost.up = target.axes.up;
  entity.signpost.to_map = options.to_map;
  entity.signpost.to_key = to_key;
  if (options.direction) entity.signpost.direction = options.direction->stableNormalized();
  entity.signpost.height = options.height.value_or(SessionOptions().signpost_height * target.distance);
  return entity;
}

content::Entity NewLabelFrom(const AddOptions& options, const Target& target) {
  content::Entity entity = NewLabel(options.label, *options.position, target.axes.up, target.distance);
  if (options.offset) entity.label.offset = *options.offset;
  if (options.height) entity.label.text_height = *options.height;
  return entity;
}

// The points of --trail, which have the form of those of the script command `trail`. Throws Error.
std::vector<Eigen::Vector3d> TrailPoints(const std::string& text) {
  const auto parsed = ParseScript("0 trail at " + text, "--trail");
  const auto* const trail = parsed.size() == 1 ? std::get_if<PlaceTrail>(&parsed.front().command) : nullptr;
  if (trail == nullptr) throw Error("--trail: expected one list of points.");
  std::vector<Eigen::Vector3d> points;
  for (const MapPoint& point : trail->points) {
    if (point.pixel) throw Error("--trail: a saved map has no image with this pixel; give X Y Z instead.");
    points.push_back(point.in_map);
  }
  return points;
}

content::Entity NewTrailFrom(const AddOptions& options, const Target& target) {
  content::Entity entity =
      NewTrail(TrailPoints(options.trail), Eigen::Vector3d::Zero(), target.axes.up, target.distance);
  if (options.width) entity.trail.width = *options.width;
  return entity;
}

// The shape of --occluder, which has the form of that of the script command `occluder`. Throws Error.
PlaceOccluder OccluderShape(const std::string& text) {
  const auto parsed = ParseScript("0 occluder " + text, "--occluder");
  const auto* const command =
      parsed.size() == 1 ? std::get_if<PlaceOccluder>(&parsed.front().command) : nullptr;
  if (command == nullptr) throw Error("--occluder: expected one shape.");
  for (const MapPoint& point : command->points) {
    if (point.pixel) throw Error("--occluder: a saved map has no image with this pixel; give X Y Z instead.");
  }
  return *command;
}

content::Entity NewOccluderFrom(const AddOptions& options, const Target& target) {
  const PlaceOccluder command = OccluderShape(options.occluder);
  std::vector<content::SurfaceHit> places;
  for (const MapPoint& point : command.points) places.push_back({point.in_map, target.axes.up});
  const Eigen::Vector3d viewer = places.front().point - target.distance * target.axes.ahead;
  return NewOccluder(command, places, viewer, target.axes.up);
}

std::string FreeNameFor(const content::Scene& scene, const content::Entity& entity,
                        const std::filesystem::path& file) {
  if (!file.empty()) return scene.FreeName(content::NameFromFile(file));
  if (entity.kind == content::Entity::Kind::kSignpost) return scene.FreeSignpostName();
  return scene.FreeNumberedName(content::NameOf(entity.kind));
}

void Add(const AddOptions& options, Verbosity verbosity) {
  maps::Library library = OpenLibrary(options.library, maps::Access::kReadWrite);
  const maps::SessionLock lock(options.library, maps::SessionLockKind::kReplace);
  const maps::MapInfo map = library.FindByName(options.map);
  std::uint64_t to_key = 0;
  if (!options.to_map.empty()) to_key = library.FindByName(options.to_map).key;  // Throws if there is none.
  if (to_key == map.key) throw Error(WhereStored(library, map) + ": a signpost cannot lead to its own map.");
  const auto snapshot = library.Load(map.key).snapshot;
  const content::Scene scene = StoredNames(library, map);
  Target target{AxesOf(scene, *snapshot)};
  if (!snapshot->keyframes.empty()) target.distance = snapshot->keyframes.front().mean_depth;
  content::Entity entity = !options.file.empty()       ? NewFromFile(options, target)
                           : !options.label.empty()    ? NewLabelFrom(options, target)
                           : !options.trail.empty()    ? NewTrailFrom(options, target)
                           : !options.occluder.empty() ? NewOccluderFrom(options, target)
                                                       : NewSignpost(options, target, to_key);
  entity.name = options.name.empty() ? FreeNameFor(scene, entity, options.file) : options.name;
  const MakeEdit edits[] = {[&](const content::Scene& stored) { return content::AddEdit(stored, entity); }};
  EditStoredScene(&library, map, edits);
  if (verbosity != Verbosity::kQuiet) std::printf("%s\n", entity.name.c_str());
}

// What is added: exactly one of these.
std::vector<CLI::Option*> AddKindOptions(CLI::App* add, AddOptions* options) {
  CLI::Option* file =
      add->add_option("FILE", options->file,
                      "Model (glTF, GLB, or a format that is converted), image (PNG, JPEG) or "
                      "sound (WAV, FLAC, Ogg)");
  CLI::Option* signpost =
      add->add_option("--signpost", options->signpost, "Add a signpost with this text instead");
  CLI::Option* label = add->add_option("--label", options->label, "Add a label with this text instead");
  CLI::Option* trail =
      add->add_option("--trail", options->trail, "Add a trail over these points, in map units, instead");
  for (CLI::Option* option : {signpost, label}) option->type_name("TEXT");
  trail->type_name("\"X Y Z, X Y Z, ...\"");
  CLI::Option* occluder = add->add_option(
      "--occluder", options->occluder,
      "Add a shape that hides the content behind it instead: box, cylinder, plane or polygon, as the script "
      "command occluder has it, in map units");
  occluder->type_name("\"SHAPE [size W H D] at X Y Z\"");
  const std::vector<CLI::Option*> kinds = {file, signpost, label, trail, occluder};
  for (CLI::Option* one : kinds) {
    for (CLI::Option* other : kinds) {
      if (one != other) one->excludes(other);
    }
  }
  return kinds;
}

void AddPoseOptions(CLI::App* add, AddOptions* options, const std::vector<CLI::Option*>& kinds) {
  CLI::Option* const at = AddNumbers(
      add, "--at", 3, -content::kMaxCoordinate, content::kMaxCoordinate,
      [=](const auto& n) { options->position = Eigen::Vector3d(n[0], n[1], n[2]); },
      "Position of its foot along the map's axes, in map units; of a label, of what it is about");
  at->type_name("X Y Z")->excludes(kinds[3])->excludes(kinds[4]);
  CLI::Option* const scale = AddNumbers(
      add, "--scale", 1, content::kMinModelScale, content::kMaxModelScale,
      [=](const auto& n) { options->scale = n[0]; },
      "Map units per metre of the model (default 1); of an image, its longer side in map units");
  CLI::Option* const yaw = AddNumbers(
      add, "--yaw", 1, -content::kMaxAngle_deg, content::kMaxAngle_deg,
      [=](const auto& n) { options->yaw_deg = n[0]; },
      "Angle about the map's up direction, counter-clockwise seen from above; at 0 the model or image faces "
      "the camera of the map's first keyframe (default 0)");
  CLI::Option* const rotation = AddNumbers(
      add, "--rotation", 4, -1.001, 1.001,
      [=](const auto& n) {
        const Eigen::Quaterniond quaternion(n[3], n[0], n[1], n[2]);
        if (std::abs(quaternion.norm() - 1) > 1e-3)
          throw CLI::ValidationError("--rotation", "the quaternion does not have length 1");
        options->rotation = quaternion;
      },
      "Rotation from the axes of the model or image to the map's as a quaternion, instead of upright");
  scale->type_name("S");
  yaw->type_name("DEG");
  rotation->type_name("X Y Z W")->excludes(yaw);
  for (CLI::Option* option : {scale, yaw, rotation}) {
    for (const std::size_t other : {1, 2, 3, 4}) option->excludes(kinds[other]);
  }
}

void AddPropertyOptions(CLI::App* add, AddOptions* options, const std::vector<CLI::Option*>& kinds) {
  AddNumbers(
      add, "--height", 1, content::kMinBoardHeight, content::kMaxBoardHeight,
      [=](const auto& n) { options->height = n[0]; },
      "Height of the signpost's board, or of a line of the label's text, in map units")
      ->type_name("H")
      ->excludes(kinds[0])
      ->excludes(kinds[3])
      ->excludes(kinds[4]);
  add->add_option("--to", options->to_map, "The map that the signpost leads to")
      ->type_name("MAP")
      ->needs(kinds[1]);
  AddNumbers(
      add, "--direction", 3, -content::kMaxCoordinate, content::kMaxCoordinate,
      [=](const auto& n) {
        options->direction = Eigen::Vector3d(n[0], n[1], n[2]);
        if (options->direction->norm() < 1e-6)
          throw CLI::ValidationError("--direction", "the direction is too short");
      },
      "Direction in which visitors leave for that map, along the map's axes; the signpost's arrow points in "
      "it")
      ->type_name("X Y Z")
      ->needs(kinds[1]);
  AddNumbers(
      add, "--offset", 3, -content::kMaxCoordinate, content::kMaxCoordinate,
      [=](const auto& n) { options->offset = Eigen::Vector3d(n[0], n[1], n[2]); },
      "Offset of the label's board from --at along the map's axes, in map units (default: above)")
      ->type_name("X Y Z")
      ->needs(kinds[2]);
  add->add_option("--caption", options->caption, "The text that is shown while the sound plays")
      ->type_name("TEXT")
      ->needs(kinds[0]);
  AddNumbers(
      add, "--range", 1, content::kMinSoundRange, content::kMaxSoundRange,
      [=](const auto& n) { options->range = n[0]; }, "Distance within which the sound plays, in map units")
      ->type_name("R")
      ->needs(kinds[0]);
  AddNumbers(
      add, "--width", 1, content::kMinTrailWidth, content::kMaxTrailWidth,
      [=](const auto& n) { options->width = n[0]; }, "Width of the trail in map units")
      ->type_name("W")
      ->needs(kinds[3]);
}

// Refuses options of a FILE that are for files of another kind.
void CheckKindOfFile(const CLI::App& add, const AddOptions& options) {
  if (options.file.empty()) return;
  const bool is_sound = KindOfFile(options.file) == content::AssetKind::kSound;
  for (const char* name : {"--scale", "--yaw", "--rotation"}) {
    if (is_sound && add.count(name) > 0) throw CLI::ValidationError(name, "is not for a sound");
  }
  for (const char* name : {"--caption", "--range"}) {
    if (!is_sound && add.count(name) > 0)
      throw CLI::ValidationError(name, "is only for a sound (.wav, .flac, .ogg or .oga)");
  }
  if (is_sound && options.caption.empty()) throw CLI::ValidationError("--caption", "a sound needs a caption");
}

}  // namespace

void AddContentAddCommand(CLI::App* group, Invocation* invocation) {
  const auto options = std::make_shared<AddOptions>();
  CLI::App* add = AddSubcommand(
      group, "add", "Add a model, image, sound, signpost, label, trail or occluder to a saved map",
      "docent content add fox.glb --map \"Desk 3\" --at 0.2 0.1 1.5 --scale 0.1 --library museum.docent\n"
      "  docent content add --signpost \"To the foxes\" --to \"Desk 4\" --map \"Desk 3\" --at 0 0 2 "
      "--library museum.docent\n"
      "  docent content add --trail \"0 1 1, 0 1 2, 1 1 3\" --map \"Desk 3\" --library museum.docent\n"
      "  docent content add --occluder \"box size 1 0.7 0.6 at 0 1 2 yaw 30\" --map \"Desk 3\" "
      "--library museum.docent");
  add->alias("import");
  const std::vector<CLI::Option*> kinds = AddKindOptions(add, options.get());
  add->add_option("--map", options->map, "The map that it is added to")->required();
  AddLibraryOption(add, LibraryUse::kChange, &options->library, invocation);
  add->add_option("--name", options->name,
                  "Its name; by default made from the file, or sign-1, label-1, trail-1, occluder-1, ...");
  AddPoseOptions(add, options.get(), kinds);
  AddPropertyOptions(add, options.get(), kinds);
  add->callback([=] {
    const bool has_place = !options->trail.empty() || !options->occluder.empty();
    if (options->file.empty() && options->signpost.empty() && options->label.empty() && !has_place)
      throw CLI::RequiredError("FILE, --signpost TEXT, --label TEXT, --trail POINTS or --occluder SHAPE");
    if (!options->position && !has_place) throw CLI::RequiredError("--at");
    CheckKindOfFile(*add, *options);
    try {
      if (!options->trail.empty()) TrailPoints(options->trail);
      if (!options->occluder.empty()) OccluderShape(options->occluder);
    } catch (const Error& error) {
      throw CLI::ValidationError(error.what());
    }
    invocation->run = [=] { Add(*options, invocation->verbosity); };
  });
}

}  // namespace docent::app
