// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>

#include "app/command_line/content_edit_command.h"
#include "app/command_line/number_option.h"
#include "app/command_line/program.h"
#include "app/command_line/stored_scene.h"
#include "app/files/text_file.h"
#include "app/session/library_scene.h"
#include "app/session/session.h"
#include "content/asset.h"
#include "content/edits.h"
#include "content/placement.h"
#include "engine/base/error.h"
#include "engine/map/upright_axes.h"
#include "maps/library/library.h"

namespace docent::app {

namespace {

using Json = nlohmann::ordered_json;

struct ContentOptions {
  std::filesystem::path library, file;
  std::string map, name;
  std::vector<std::string> names;
  bool as_json = false;
  // Of `add`; see its help for units and frames.
  std::string text, to_map;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  double scale = 1, yaw_deg = 0;
  std::optional<Eigen::Quaterniond> rotation;
  double height = 0;  // 0: chosen by the size of what the map shows
};

Json ToJson(const maps::MapInfo& map, const content::Entity& entity) {
  Json json = {{"map", map.name}, {"name", entity.name}};
  if (entity.kind == content::Entity::Kind::kModel) {
    const Eigen::Vector3d& t = entity.model.map_from_model.translation;
    json["kind"] = "model";
    json["file"] = entity.model.asset ? entity.model.asset->name : std::string();
    json["position_m"] = {t.x(), t.y(), t.z()};
    json["scale"] = entity.model.map_from_model.scale;
    json["bent"] = entity.model.warp != nullptr;
  } else {
    const Eigen::Vector3d& anchor = entity.signpost.anchor;
    json["kind"] = "signpost";
    json["text"] = entity.signpost.text;
    json["position_m"] = {anchor.x(), anchor.y(), anchor.z()};
    json["to_map"] = entity.signpost.to_map;
  }
  json["locked"] = entity.locked;
  json["hidden"] = entity.hidden;
  json["group"] = entity.group;
  return json;
}

void List(const ContentOptions& options) {
  const maps::Library library = OpenLibrary(options.library, maps::Access::kReadOnly);
  std::vector<maps::MapInfo> infos;
  if (options.map.empty()) {
    infos = library.List();
  } else {
    infos.push_back(library.FindByName(options.map));
  }
  Json entries = Json::array();
  for (const maps::MapInfo& map : infos) {
    const content::Scene scene = StoredNames(library, map);
    for (const content::Entity& entity : scene.entities) entries.push_back(ToJson(map, entity));
  }
  if (options.as_json) {
    std::printf("%s\n",
                Json{{"content", entries}}.dump(2, ' ', false, Json::error_handler_t::replace).c_str());
    return;
  }
  if (entries.empty()) std::puts("The maps hold no models or signposts.");
  for (const Json& entry : entries) {
    const bool model = entry["kind"] == "model";
    const char* const state = entry["locked"] == true
                                  ? (entry["hidden"] == true ? "  (locked, hidden)" : "  (locked)")
                              : entry["hidden"] == true ? "  (hidden)"
                                                        : "";
    std::printf("%-24s %-24s %-9s %s%s\n", entry["map"].get<std::string>().c_str(),
                entry["name"].get<std::string>().c_str(), entry["kind"].get<std::string>().c_str(),
                entry[model ? "file" : "text"].get<std::string>().c_str(), state);
  }
}

// A pose that stands upright and faces the place of the first keyframe's camera, unless a rotation is given.
content::Entity NewModel(const ContentOptions& options, const engine::UprightAxes& axes,
                         const content::Scene& scene) {
  content::Entity entity;
  entity.kind = content::Entity::Kind::kModel;
  entity.model.asset = std::make_shared<content::Asset>(content::ImportAsset(options.file));
  for (const std::string& warning : entity.model.asset->model->warnings)
    std::fprintf(stderr, "Warning: %s\n", warning.c_str());
  entity.name = options.name.empty() ? scene.FreeName(content::NameFromFile(options.file)) : options.name;
  engine::Sim3& pose = entity.model.map_from_model;
  pose = content::UprightPose(options.position, -axes.ahead, axes.up,
                              options.yaw_deg * std::numbers::pi / 180, options.scale);
  if (options.rotation) pose.rotation = engine::Rotation3(*options.rotation);
  pose.translation += options.position - content::BaseInMap(entity);
  return entity;
}

// Without a height, the signpost is as high as one that is placed by a click at the median distance of what
// the first keyframe shows.
content::Entity NewSignpost(const ContentOptions& options, const engine::MapSnapshot& map,
                            const content::Scene& scene) {
  content::Entity entity;
  entity.name = options.name.empty() ? scene.FreeSignpostName() : options.name;
  entity.signpost.text = options.text;
  entity.signpost.anchor = options.position;
  entity.signpost.up = engine::UpInMap(map);
  entity.signpost.to_map = options.to_map;
  const double distance = map.keyframes.empty() ? 1 : map.keyframes.front().mean_depth;
  entity.signpost.height_m =
      options.height > 0 ? options.height : SessionOptions().signpost_height * distance;
  return entity;
}

void Add(const ContentOptions& options, Verbosity verbosity) {
  maps::Library library = OpenLibrary(options.library, maps::Access::kReadWrite);
  const maps::MapInfo map = library.FindByName(options.map);
  std::uint64_t to_key = 0;
  if (!options.to_map.empty()) to_key = library.FindByName(options.to_map).key;  // Throws if there is none.
  if (to_key == map.key) throw Error(WhereStored(library, map) + ": a signpost cannot lead to its own map.");
  const auto snapshot = library.Load(map.key).snapshot;
  const content::Scene scene = StoredNames(library, map);
  content::Entity entity = options.file.empty() ? NewSignpost(options, *snapshot, scene)
                                                : NewModel(options, engine::UprightAxesOf(*snapshot), scene);
  entity.signpost.to_key = to_key;
  const MakeEdit edits[] = {[&](const content::Scene& stored) { return content::AddEdit(stored, entity); }};
  EditStoredScene(&library, map, edits);
  if (verbosity != Verbosity::kQuiet) std::printf("%s\n", entity.name.c_str());
}

void Remove(const ContentOptions& options) {
  maps::Library library = OpenLibrary(options.library, maps::Access::kReadWrite);
  const MakeEdit edits[] = {
      [&](const content::Scene& stored) { return content::RemoveEdit(stored, options.names); }};
  EditStoredScene(&library, library.FindByName(options.map), edits);
}

void AddAddCommand(CLI::App* group, Invocation* invocation, const std::shared_ptr<ContentOptions>& options) {
  CLI::App* add = AddSubcommand(
      group, "add", "Add a model or a signpost to a saved map",
      "docent content add fox.glb --map \"Desk 3\" --at 0.2 0.1 1.5 --scale 0.1 --library museum.docent\n"
      "  docent content add --signpost \"To the foxes\" --to \"Desk 4\" --map \"Desk 3\" --at 0 0 2 "
      "--library museum.docent");
  add->alias("import");
  CLI::Option* file =
      add->add_option("FILE", options->file, "Model file: glTF, GLB, or a format that is converted");
  CLI::Option* text = add->add_option("--signpost", options->text, "Add a signpost with this text instead")
                          ->type_name("TEXT")
                          ->excludes(file);
  add->add_option("--map", options->map, "The map that it is added to")->required();
  add->add_option("--library", options->library, "The library's file, NAME.docent")->required();
  AddNumbers(
      add, "--at", 3, -content::kMaxCoordinate, content::kMaxCoordinate,
      [=](const auto& n) {
        options->position = {n[0], n[1], n[2]};
      },
      "Position of its foot along the map's axes, in map units")
      ->type_name("X Y Z")
      ->required();
  add->add_option("--name", options->name, "Its name; by default made from the file, or sign-1, sign-2, ...");
  AddNumbers(
      add, "--scale", 1, content::kMinModelScale, content::kMaxModelScale,
      [=](const auto& n) { options->scale = n[0]; }, "Map units per metre of the model (default 1)")
      ->type_name("S")
      ->excludes(text);
  CLI::Option* yaw = AddNumbers(
                         add, "--yaw", 1, -content::kMaxAngle_deg, content::kMaxAngle_deg,
                         [=](const auto& n) { options->yaw_deg = n[0]; },
                         "Angle about the map's up direction, counter-clockwise seen from above; at 0 the "
                         "model faces against the view of the map's first keyframe (default 0)")
                         ->type_name("DEG")
                         ->excludes(text);
  AddNumbers(
      add, "--rotation", 4, -1.001, 1.001,
      [=](const auto& n) {
        const Eigen::Quaterniond rotation(n[3], n[0], n[1], n[2]);
        if (std::abs(rotation.norm() - 1) > 1e-3)
          throw CLI::ValidationError("--rotation", "the quaternion does not have length 1");
        options->rotation = rotation;
      },
      "Rotation from the model's axes to the map's as a quaternion, instead of upright")
      ->type_name("X Y Z W")
      ->excludes(text)
      ->excludes(yaw);
  AddNumbers(
      add, "--height", 1, content::kMinBoardHeight, content::kMaxBoardHeight,
      [=](const auto& n) { options->height = n[0]; }, "Height of the signpost's board in map units")
      ->type_name("H")
      ->excludes(file);
  add->add_option("--to", options->to_map, "The map that the signpost leads to")
      ->type_name("MAP")
      ->excludes(file);
  add->callback([=] {
    if (options->file.empty() && options->text.empty()) throw CLI::RequiredError("FILE or --signpost TEXT");
    invocation->run = [=] { Add(*options, invocation->verbosity); };
  });
}

}  // namespace

void AddContentCommand(CLI::App* program, Invocation* invocation) {
  CLI::App* group =
      AddSubcommand(program, "content", "List, add, change or remove the models and signposts in the maps",
                    "docent content list --library museum.docent");
  group->require_subcommand(1);
  const auto options = std::make_shared<ContentOptions>();

  CLI::App* list = AddSubcommand(group, "list", "List models and signposts",
                                 "docent content list --library museum.docent --map \"Desk 3\"");
  list->add_option("--library", options->library, "The library's file, NAME.docent")->required();
  list->add_option("--map", options->map, "Only the content of this map");
  list->add_flag("--json", options->as_json, "Print JSON");
  list->callback([=] { invocation->run = [=] { List(*options); }; });

  AddAddCommand(group, invocation, options);
  AddContentEditCommand(group, invocation);

  CLI::App* remove = AddSubcommand(group, "remove", "Remove models and signposts",
                                   "docent content remove helmet --map \"Desk 3\" --library museum.docent");
  remove->add_option("NAME", options->names, "Names of the models and signposts")->required();
  remove->add_option("--map", options->map, "The map that contains it")->required();
  remove->add_option("--library", options->library, "The library's file, NAME.docent")->required();
  remove->callback([=] { invocation->run = [=] { Remove(*options); }; });
}

}  // namespace docent::app
