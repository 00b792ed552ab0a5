// SPDX-License-Identifier: Apache-2.0
#include "app/session/content_commands.h"

#include <memory>
#include <numbers>
#include <utility>

#include "app/files/text_file.h"
#include "app/session/entrance_view.h"
#include "app/session/map_axes.h"
#include "app/session/new_entities.h"
#include "app/session/surface_at_pixel.h"
#include "content/asset.h"
#include "engine/base/error.h"
#include "engine/map/local_points.h"

namespace docent::app {

namespace {

const content::Entity& FindEntity(const content::Scene& scene, const std::string& name) {
  const content::Entity* entity = scene.Find(name);
  if (entity == nullptr) throw Error("there is no '" + name + "' in this map");
  return *entity;
}

// The median distance of what the first keyframe sees: the size of a map's world in its unit.
double FirstDistance(const engine::MapSnapshot& map) {
  return map.keyframes.empty() ? 1 : map.keyframes.front().mean_depth;
}

// A surface that is more than 45 degrees from what the keyframes suggest is a wall rather than a floor.
constexpr double kMinLevelCosine = 0.7071;

// How well the points of an aligned model fit, in words. Residuals are in map units.
std::string TextOf(const std::string& name, const content::Alignment& alignment) {
  std::string residuals, left_out;
  for (std::size_t i = 0; i < alignment.residuals.size(); ++i) {
    residuals += (i > 0 ? ", " : "") + FormatNumber(alignment.residuals[i], 3);
    if (!alignment.inliers[i]) left_out += (left_out.empty() ? "" : ", ") + std::to_string(i + 1);
  }
  return "'" + name + "' was aligned: residuals " + residuals + " map units" +
         (left_out.empty() ? "" : "; without point " + left_out);
}

}  // namespace

SessionMap& ContentCommands::MapToEdit(const engine::TrackedFrame& frame) {
  const std::uint64_t key =
      engine::HasPose(frame.state) ? frame.map_key : system_.CurrentMap(CameraOf(frame));
  SessionMap* const map = state_.FindMap(key);
  if (map == nullptr || !map->snapshot)
    throw Error("there is no current map; start one, or point the camera at a place of a map");
  if (map->discarded)
    throw Error("the map of this image was discarded; make the change in the map that is current now");
  if (!map->Exists()) throw Error("the map of this image was joined into another one");
  if (!maps::MayChangeContent(map->policy)) {
    throw Error(map->PolicyInWords() + "; its content cannot be changed");
  }
  return *map;
}

void ContentCommands::Edit(SessionMap* map, content::SceneChange change) {
  auto scene = std::make_shared<content::Scene>(*map->scene);
  map->history.Do(std::move(change), scene.get());
  map->scene = std::move(scene);
  system_.SetPermissions(map->key, map->Permissions());
}

content::SurfaceHit ContentCommands::SurfaceFor(const engine::TrackedFrame& frame,
                                                const Eigen::Vector2d& pixel) const {
  content::SurfaceHit hit = SurfaceAtPixel(frame, *state_.cameras.at(CameraOf(frame)).model, pixel);
  const engine::Sim3 motion = MotionSince(frame, hit.point);
  hit.point = motion * hit.point;
  hit.normal = motion.rotation * hit.normal;
  return hit;
}

engine::Sim3 ContentCommands::MotionSince(const engine::TrackedFrame& frame,
                                          const Eigen::Vector3d& place) const {
  constexpr std::size_t kPoints = 150;  // As many as content is anchored to.
  const SessionMap* const map = state_.FindMap(frame.map_key);
  if (!frame.map || map == nullptr || !map->snapshot || map->snapshot == frame.map) return {};
  return engine::EstimateMotion(engine::NearestPoints(*frame.map, place, kPoints), *map->snapshot)
      .value_or(engine::Sim3());
}

// The key of the map that a signpost in `map` is to lead to; 0 for none.
std::uint64_t ContentCommands::TargetKey(const SessionMap& map, const std::string& to_map) {
  if (to_map.empty()) return 0;
  const SessionMap* const target = state_.FindByName(to_map);
  if (target == nullptr) throw Error("there is no map '" + to_map + "' that the signpost could lead to");
  if (target == &map) throw Error("a signpost cannot lead to its own map");
  return target->key;
}

void ContentCommands::Apply(const PlaceModel& command, const engine::TrackedFrame& frame) {
  SessionMap& map = MapToEdit(frame);
  const content::SurfaceHit hit = SurfaceFor(frame, command.pixel);
  content::Entity entity;
  entity.kind = content::Entity::Kind::kModel;
  entity.name = map.scene->FreeName(content::NameFromFile(command.file));
  entity.model.asset = assets_.Load(command.file);
  for (const std::string& warning : assets_.TakeWarnings())
    state_.AddEvent(frame.frame.time, "warning", warning);
  const content::Model& model = *entity.model.asset->model;
  const Eigen::Vector3d viewer = frame.camera_from_map.OriginInSource();
  const double side = options_.model_side * (hit.point - viewer).norm();
  const double scale = command.scale.value_or(content::AutomaticScale(model, map.scene->settings, side));
  entity.model.map_from_model =
      content::FacingPose(hit.point, viewer, hit.normal, UpOf(*map.scene, *frame.map),
                          command.yaw_deg * std::numbers::pi / 180, scale);
  entity.model.map_from_model.translation += hit.point - content::BaseInMap(entity);
  Edit(&map, content::AddEdit(*map.scene, std::move(entity)));
}

void ContentCommands::Apply(const PlaceSignpost& command, const engine::TrackedFrame& frame) {
  SessionMap& map = MapToEdit(frame);
  const content::SurfaceHit hit = SurfaceFor(frame, command.pixel);
  content::Entity entity;
  entity.kind = content::Entity::Kind::kSignpost;
  entity.name = map.scene->FreeSignpostName();
  entity.signpost.text = command.text;
  entity.signpost.anchor = hit.point;
  entity.signpost.up = UpOf(*map.scene, *frame.map);
  // Map units mean nothing to the user, so the size is chosen by the distance from the camera.
  entity.signpost.height = options_.signpost_height * (frame.camera_from_map * hit.point).norm();
  entity.signpost.to_map = command.to_map;
  entity.signpost.to_key = TargetKey(map, command.to_map);
  Edit(&map, content::AddEdit(*map.scene, std::move(entity)));
}

void ContentCommands::Apply(const PlaceLabel& command, const engine::TrackedFrame& frame) {
  SessionMap& map = MapToEdit(frame);
  const content::SurfaceHit hit = SurfaceFor(frame, command.pixel);
  const double distance = (frame.camera_from_map * hit.point).norm();
  content::Entity entity = NewLabel(command.text, hit.point, UpOf(*map.scene, *frame.map), distance);
  if (command.offset) entity.label.offset = *command.offset;
  entity.name = map.scene->FreeNumberedName("label");
  Edit(&map, content::AddEdit(*map.scene, std::move(entity)));
}

void ContentCommands::Apply(const PlaceImage& command, const engine::TrackedFrame& frame) {
  SessionMap& map = MapToEdit(frame);
  const content::SurfaceHit hit = SurfaceFor(frame, command.pixel);
  const Eigen::Vector3d viewer = frame.camera_from_map.OriginInSource();
  const auto asset = assets_.Load(command.file, content::AssetKind::kImage);
  const double scale = command.scale.value_or(options_.model_side * (hit.point - viewer).norm());
  content::Entity entity = NewImage(asset, hit, viewer, UpOf(*map.scene, *frame.map), scale, command.upright);
  entity.name = map.scene->FreeName(content::NameFromFile(command.file));
  Edit(&map, content::AddEdit(*map.scene, std::move(entity)));
}

void ContentCommands::Apply(const PlaceSound& command, const engine::TrackedFrame& frame) {
  SessionMap& map = MapToEdit(frame);
  const content::SurfaceHit hit = SurfaceFor(frame, command.pixel);
  content::Entity entity = NewSound(assets_.Load(command.file, content::AssetKind::kSound), hit.point,
                                    (frame.camera_from_map * hit.point).norm());
  entity.sound.caption = command.caption;
  if (command.range) entity.sound.range = *command.range;
  entity.name = map.scene->FreeName(content::NameFromFile(command.file));
  Edit(&map, content::AddEdit(*map.scene, std::move(entity)));
}

content::SurfaceHit ContentCommands::PlaceFor(const engine::TrackedFrame& frame,
                                              const MapPoint& point) const {
  if (point.pixel) return SurfaceFor(frame, *point.pixel);
  content::SurfaceHit hit;
  hit.point = point.in_map;
  hit.normal = engine::UpInMap(*frame.map);
  return hit;
}

void ContentCommands::Apply(const PlaceTrail& command, const engine::TrackedFrame& frame) {
  SessionMap& map = MapToEdit(frame);
  RequirePose(frame);  // The trail's width is chosen by the distance from the camera.
  std::vector<Eigen::Vector3d> points;
  Eigen::Vector3d normals = Eigen::Vector3d::Zero();
  for (const MapPoint& point : command.points) {
    const content::SurfaceHit hit = PlaceFor(frame, point);
    points.push_back(hit.point);
    // A normal that only opposes the ray says nothing about the surface.
    if (hit.on_plane) normals += hit.normal;
  }
  const double distance = (frame.camera_from_map * points.front()).norm();
  content::Entity entity = NewTrail(std::move(points), normals, UpOf(*map.scene, *frame.map), distance);
  if (command.width) entity.trail.width = *command.width;
  entity.name = map.scene->FreeNumberedName("trail");
  Edit(&map, content::AddEdit(*map.scene, std::move(entity)));
}

void ContentCommands::Apply(const ExtendTrail& command, const engine::TrackedFrame& frame) {
  SessionMap& map = MapToEdit(frame);
  const Eigen::Vector3d point =
      command.point.pixel ? SurfaceFor(frame, *command.point.pixel).point : command.point.in_map;
  Edit(&map, content::AddPointEdit(*map.scene, command.name, point));
}

void ContentCommands::Apply(const PlaceOccluder& command, const engine::TrackedFrame& frame) {
  SessionMap& map = MapToEdit(frame);
  RequirePose(frame);  // An occluder faces the camera.
  std::vector<content::SurfaceHit> places;
  for (const MapPoint& point : command.points) places.push_back(PlaceFor(frame, point));
  content::Entity entity =
      NewOccluder(command, places, frame.camera_from_map.OriginInSource(), UpOf(*map.scene, *frame.map));
  entity.name = map.scene->FreeNumberedName("occluder");
  Edit(&map, content::AddEdit(*map.scene, std::move(entity)));
}

void ContentCommands::Apply(const MoveEntity& command, const engine::TrackedFrame& frame) {
  SessionMap& map = MapToEdit(frame);
  if (!command.to_pixel) return Edit(&map, EditFor(*map.scene, command));
  const content::Entity& entity = FindEntity(*map.scene, command.name);
  const Eigen::Vector3d offset = SurfaceFor(frame, *command.to_pixel).point - content::BaseInMap(entity);
  Edit(&map, content::MoveEdit(*map.scene, command.name, content::PlaceOf(entity) + offset));
}

void ContentCommands::Apply(const SetSignpostTarget& command, const engine::TrackedFrame& frame) {
  SessionMap& map = MapToEdit(frame);
  const std::uint64_t key = TargetKey(map, command.to_map);
  Edit(&map, content::TargetEdit(*map.scene, command.name, command.to_map, key));
}

void ContentCommands::Apply(const SetSignpostDirection& command, const engine::TrackedFrame& frame) {
  SessionMap& map = MapToEdit(frame);
  std::optional<Eigen::Vector3d> direction = command.direction;
  if (command.ahead) {
    if (!engine::HasPose(frame.state))
      throw Error("the camera is lost, so that the direction in which it looks is not known");
    direction = frame.camera_from_map.rotation.inverse() * Eigen::Vector3d::UnitZ();
  }
  Edit(&map, content::DirectionEdit(*map.scene, command.name, direction));
}

void ContentCommands::Apply(const PasteEntities& command, const engine::TrackedFrame& frame) {
  SessionMap& map = MapToEdit(frame);
  const SessionMap& from = state_.InitializedMap(command.from_map);
  std::vector<content::Entity> copies;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const std::string& name : command.names) {
    content::Entity& copy = copies.emplace_back(FindEntity(*from.scene, name));
    middle += content::BaseInMap(copy) / static_cast<double>(command.names.size());
    if (&from != &map) copy.signpost.direction.reset();  // The way there is another one from here.
    if (copy.signpost.to_key == map.key)
      content::LeadNowhere(&copy.signpost);  // It would lead to its own map.
  }
  const engine::CameraModel& camera = *state_.cameras.at(CameraOf(frame)).model;
  const Eigen::Vector2d centre(0.5 * (camera.width_px() - 1), 0.5 * (camera.height_px() - 1));
  const content::SurfaceHit hit = SurfaceFor(frame, command.to_pixel.value_or(centre));
  engine::Sim3 motion;
  if (&from != &map) {
    motion.rotation = engine::Rotation3(Eigen::Quaterniond::FromTwoVectors(UpOf(*from.scene, *from.snapshot),
                                                                           UpOf(*map.scene, *map.snapshot)));
    motion.scale = FirstDistance(*map.snapshot) / FirstDistance(*from.snapshot);
  }
  motion.translation = hit.point - motion * middle;
  for (content::Entity& copy : copies) content::TransformBy(motion, &copy);
  Edit(&map, content::PasteEdit(*map.scene, std::move(copies)));
}

std::vector<content::Correspondence> ContentCommands::Correspondences(
    const engine::TrackedFrame& frame, const std::vector<PointPair>& pairs) const {
  std::vector<content::Correspondence> correspondences;
  for (const PointPair& pair : pairs) {
    correspondences.push_back(
        {pair.in_model, pair.pixel ? SurfaceFor(frame, *pair.pixel).point : pair.in_map});
  }
  return correspondences;
}

void ContentCommands::Apply(const AlignEntity& command, const engine::TrackedFrame& frame) {
  SessionMap& map = MapToEdit(frame);
  content::Alignment alignment;
  Edit(&map, content::AlignEdit(*map.scene, command.name, Correspondences(frame, command.pairs), &alignment));
  const std::string text = TextOf(command.name, alignment);
  state_.AddEvent(frame.frame.time, "align", text);
  state_.cameras.at(CameraOf(frame)).Advise(text);
}

void ContentCommands::Apply(const BendEntity& command, const engine::TrackedFrame& frame) {
  SessionMap& map = MapToEdit(frame);
  Edit(&map, content::BendEdit(*map.scene, command.name, Correspondences(frame, command.pairs)));
}

void ContentCommands::Apply(const SetMapUp& command, const engine::TrackedFrame& frame) {
  SessionMap& map = MapToEdit(frame);
  content::MapSettings settings = map.scene->settings;
  settings.up.reset();
  if (command.pixel) {
    content::SurfaceHit hit = PlaneAtPixel(frame, *state_.cameras.at(CameraOf(frame)).model, *command.pixel);
    hit.normal = MotionSince(frame, hit.point).rotation * hit.normal;
    if (!hit.on_plane) throw Error("there is no plane at this pixel; point at the floor or at a table");
    const double cosine = hit.normal.dot(engine::UpInMap(*frame.map));
    if (cosine < kMinLevelCosine)
      throw Error("the surface there is not level; point at the floor or at a table");
    settings.up = hit.normal.normalized();
  }
  Edit(&map, content::SettingsEdit(*map.scene, settings, "set the up direction"));
}

void ContentCommands::Apply(const SetMapScale& command, const engine::TrackedFrame& frame) {
  SessionMap& map = MapToEdit(frame);
  content::MapSettings settings = map.scene->settings;
  settings.metres_per_unit = 0;
  if (command.length_m > 0) {
    const double distance =
        (SurfaceFor(frame, command.from).point - SurfaceFor(frame, command.to).point).norm();
    if (!(distance > 0)) throw Error("the two points are the same place");
    settings.metres_per_unit = command.length_m / distance;
  }
  Edit(&map, content::SettingsEdit(*map.scene, settings, "set the scale"));
}

void ContentCommands::Apply(const SetMapEntrance& command, const engine::TrackedFrame& frame) {
  SessionMap& map = MapToEdit(frame);
  content::MapSettings settings = map.scene->settings;
  settings.entrance.reset();
  if (command.here) {
    if (!engine::HasPose(frame.state)) throw Error("the camera is not tracked in a map");
    settings.entrance = MostSimilarKeyFrame(*frame.map, frame.camera_from_map);
    if (!settings.entrance) throw Error("the map has no view yet");
  }
  Edit(&map, content::SettingsEdit(*map.scene, settings, "choose the entrance view"));
}

void ContentCommands::Apply(const Undo&, const engine::TrackedFrame& frame) {
  SessionMap& map = MapToEdit(frame);
  auto scene = std::make_shared<content::Scene>(*map.scene);
  if (!map.history.Undo(scene.get())) throw Error("there is nothing to undo in '" + map.name + "'");
  map.scene = std::move(scene);
  system_.SetPermissions(map.key, map.Permissions());
}

void ContentCommands::Apply(const Redo&, const engine::TrackedFrame& frame) {
  SessionMap& map = MapToEdit(frame);
  auto scene = std::make_shared<content::Scene>(*map.scene);
  if (!map.history.Redo(scene.get())) throw Error("there is nothing to redo in '" + map.name + "'");
  map.scene = std::move(scene);
  system_.SetPermissions(map.key, map.Permissions());
}

}  // namespace docent::app
