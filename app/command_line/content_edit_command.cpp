// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/content_edit_command.h"

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "app/command_line/number_option.h"
#include "app/command_line/stored_scene.h"
#include "app/output/engine_text.h"
#include "app/script/format_command.h"
#include "app/script/scene_commands.h"
#include "app/script/script_file.h"
#include "app/session/library_scene.h"
#include "app/session/way_to_map.h"
#include "engine/base/error.h"
#include "engine/mapping/loops/map_joining.h"
#include "maps/library/session_lock.h"

namespace docent::app {

namespace {

struct EditOptions {
  std::filesystem::path library;
  std::string map;
  std::vector<std::string> names;
  bool lock = false, unlock = false, hide = false, show = false, ungroup = false, unbend = false;
  bool duplicate = false, nowhere = false;
  std::optional<Eigen::Vector3d> move;
  std::optional<double> rotate_deg, scale;
  std::optional<engine::Sim3> transform;
  std::string language, to_map, rename, group, align, bend, extend;
  std::optional<std::string> text;
  std::optional<Eigen::Vector3d> offset, direction, size;
  bool shorten = false, no_direction = false, find_direction = false;

  // With a value for one entity only.
  bool NamesOne() const {
    return transform || text || offset || size || direction || find_direction || !extend.empty() ||
           !rename.empty() || !align.empty() || !bend.empty();
  }
};

// The pairs of `--align` and `--bend`, which have the form of the script commands `align` and `bend`.
Command WithPairs(const std::string& verb, const std::string& name, const std::string& pairs) {
  const std::string option = "--" + verb;
  const std::string quoted = FormatCommand(UnbendEntity{name}).substr(std::string("unbend ").size());
  const auto parsed = ParseScript("0 " + verb + ' ' + quoted + ' ' + pairs, option);
  if (parsed.size() != 1) throw Error(option + ": expected one list of points.");
  return parsed.front().command;
}

// The point of `--extend`, which has the form of that of the script command `trail extend`.
Command Extension(const std::string& name, const std::string& point) {
  const std::string verb = FormatCommand(ShortenTrail{name});
  const std::string quoted = verb.substr(std::string("trail shorten ").size());
  const auto parsed = ParseScript("0 trail extend " + quoted + " to " + point, "--extend");
  if (parsed.size() != 1) throw Error("--extend: expected one point.");
  return parsed.front().command;
}

// The commands that the options stand for, in the order in which they are carried out: first what makes other
// changes possible, last what makes them impossible or changes names.
std::vector<Command> CommandsFor(const EditOptions& options) {
  using content::EntityFlag;
  std::vector<Command> commands;
  const auto& names = options.names;
  if (options.unlock) commands.emplace_back(SetEntityFlag{names, EntityFlag::kLocked, false});
  if (options.duplicate) commands.emplace_back(DuplicateEntities{names});
  for (const std::string& name : names) {
    if (options.unbend) commands.emplace_back(UnbendEntity{name});
    if (options.transform) commands.emplace_back(TransformEntities{{{name, *options.transform}}});
    if (!options.align.empty()) commands.push_back(WithPairs("align", name, options.align));
    if (!options.bend.empty()) commands.push_back(WithPairs("bend", name, options.bend));
    if (options.scale) commands.emplace_back(ScaleEntity{name, *options.scale});
    if (options.rotate_deg) commands.emplace_back(RotateEntity{name, *options.rotate_deg});
    if (options.move) commands.emplace_back(MoveEntity{name, *options.move, std::nullopt});
    if (options.text) commands.emplace_back(SetEntityText{name, *options.text, options.language});
    if (options.offset) commands.emplace_back(SetLabelOffset{name, *options.offset});
    if (options.size) commands.emplace_back(ResizeOccluder{name, *options.size});
    if (options.shorten) commands.emplace_back(ShortenTrail{name});
    if (!options.extend.empty()) commands.push_back(Extension(name, options.extend));
    if (options.nowhere || !options.to_map.empty())
      commands.emplace_back(SetSignpostTarget{name, options.to_map});
    if (options.no_direction || options.direction || options.find_direction)
      commands.emplace_back(SetSignpostDirection{name, options.direction});
  }
  if (options.ungroup) commands.emplace_back(GroupEntities{names, ""});
  if (!options.group.empty()) commands.emplace_back(GroupEntities{names, options.group});
  if (options.hide) commands.emplace_back(SetEntityFlag{names, EntityFlag::kHidden, true});
  if (options.show) commands.emplace_back(SetEntityFlag{names, EntityFlag::kHidden, false});
  if (options.lock) commands.emplace_back(SetEntityFlag{names, EntityFlag::kLocked, true});
  // Last: a locked entity keeps its name, so the two cannot be combined.
  if (!options.rename.empty()) commands.emplace_back(RenameEntity{names.front(), options.rename});
  return commands;
}

std::vector<content::Correspondence> WithoutPixels(const std::vector<PointPair>& pairs) {
  std::vector<content::Correspondence> correspondences;
  for (const PointPair& pair : pairs) {
    if (pair.pixel) throw Error("a saved map has no image with this pixel; give X Y Z in the map instead.");
    correspondences.push_back({pair.in_model, pair.in_map});
  }
  return correspondences;
}

// Lets a signpost point to where the map that it leads to begins, which is known if both show one place.
content::SceneChange PointToTarget(const maps::Library& library, const maps::MapInfo& map,
                                   const content::Scene& scene, const std::string& name) {
  const content::Entity* const entity = scene.Find(name);
  if (entity == nullptr) throw Error("There is no '" + name + "' in this map.");
  const content::Signpost& signpost = entity->signpost;
  if (entity->kind != content::Entity::Kind::kSignpost || signpost.to_key == 0)
    throw Error("'" + name + "' leads to no map, so that it cannot point there.");
  const maps::MapInfo target = library.Find(signpost.to_key);
  const auto here = library.Load(map.key).snapshot, there = library.Load(target.key).snapshot;
  const engine::MapOverlap overlap = engine::CompareMaps({}, *here, *there, nullptr);
  if (overlap.outcome != engine::MapOverlap::Outcome::kOverlap) {
    throw Error("where '" + target.name + "' begins is not known from here, because " +
                TextOf(engine::JoinRefusal::kNoOverlap, overlap) + "; give --direction instead");
  }
  const auto direction = DirectionToMap(signpost, overlap.a_from_b, *there);
  if (!direction) throw Error("'" + target.name + "' begins at '" + name + "'; give --direction instead");
  return content::DirectionEdit(scene, name, direction);
}

// Turns commands into edits of a stored scene.
class StoredEdits {
 public:
  // `find_directions`: directions that are not given are found out.
  StoredEdits(const maps::Library& library, const maps::MapInfo& map, bool find_directions)
      : library_(library), map_(map), find_directions_(find_directions) {}

  content::SceneChange operator()(const content::Scene& scene, const SceneCommand auto& command) const {
    return EditFor(scene, command);
  }
  content::SceneChange operator()(const content::Scene& scene, const SetSignpostTarget& command) const {
    const std::uint64_t key = command.to_map.empty() ? 0 : library_.FindByName(command.to_map).key;
    if (key == map_.key) throw Error("a signpost cannot lead to its own map.");
    return content::TargetEdit(scene, command.name, command.to_map, key);
  }
  content::SceneChange operator()(const content::Scene& scene, const SetSignpostDirection& command) const {
    if (find_directions_) return PointToTarget(library_, map_, scene, command.name);
    return content::DirectionEdit(scene, command.name, command.direction);
  }
  content::SceneChange operator()(const content::Scene& scene, const AlignEntity& command) const {
    return content::AlignEdit(scene, command.name, WithoutPixels(command.pairs), nullptr);
  }
  content::SceneChange operator()(const content::Scene& scene, const BendEntity& command) const {
    return content::BendEdit(scene, command.name, WithoutPixels(command.pairs));
  }
  content::SceneChange operator()(const content::Scene& scene, const ExtendTrail& command) const {
    if (command.point.pixel) throw Error("a saved map has no image with this pixel; give X Y Z instead.");
    return content::AddPointEdit(scene, command.name, command.point.in_map);
  }
  content::SceneChange operator()(const content::Scene&, const auto&) const {
    throw Error("this command needs a camera.");
  }

 private:
  const maps::Library& library_;
  const maps::MapInfo& map_;
  const bool find_directions_;
};

// The commands that the options stand for. Throws Error if the options are wrong, whatever the library holds.
std::vector<Command> CheckedCommandsFor(const EditOptions& options) {
  if (options.NamesOne() && options.names.size() > 1)
    throw Error(
        "--transform, --align, --bend, --text, --offset, --size, --direction, --find-direction, --extend and "
        "--rename change one object, not several");
  std::vector<Command> commands = CommandsFor(options);
  if (commands.empty()) throw Error("No change is given");
  for (const Command& command : commands) {
    if (const std::string problem = Validate(command); !problem.empty())
      throw Error(FormatCommand(command) + ": " + problem);
  }
  return commands;
}

void RunEdit(const EditOptions& options, const std::vector<Command>& commands) {
  maps::Library library = OpenLibrary(options.library, maps::Access::kReadWrite);
  const maps::SessionLock lock(options.library, maps::SessionLockKind::kReplace);
  const maps::MapInfo map = library.FindByName(options.map);
  const StoredEdits edit_for(library, map, options.find_direction);
  std::vector<MakeEdit> edits;
  for (const Command& command : commands) {
    edits.emplace_back([&](const content::Scene& scene) {
      return std::visit([&](const auto& chosen) { return edit_for(scene, chosen); }, command);
    });
  }
  EditStoredScene(&library, map, edits);
}

void AddPoseOptions(CLI::App* edit, EditOptions* options) {
  constexpr double kMost = content::kMaxCoordinate;
  AddNumbers(
      edit, "--move", 3, -2 * kMost, 2 * kMost,
      [=](const auto& n) { options->move = Eigen::Vector3d(n[0], n[1], n[2]); },
      "Move by this offset along the map's axes, in map units")
      ->type_name("X Y Z");
  AddNumbers(
      edit, "--rotate", 1, -content::kMaxAngle_deg, content::kMaxAngle_deg,
      [=](const auto& n) { options->rotate_deg = n[0]; },
      "Rotate about the up axis through the base, counter-clockwise seen from above")
      ->type_name("DEG");
  AddNumbers(
      edit, "--scale", 1, 1e-18, 1e18, [=](const auto& n) { options->scale = n[0]; },
      "Multiply the size; the base stays where it is")
      ->type_name("FACTOR");
  AddNumbers(
      edit, "--transform", 8, -1e9, 1e9,
      [=](const auto& n) {
        const Eigen::Quaterniond rotation(n[6], n[3], n[4], n[5]);
        if (std::abs(rotation.norm() - 1) > 1e-3)
          throw CLI::ValidationError("--transform", "the quaternion does not have length 1");
        options->transform = engine::Sim3{engine::Rotation3(rotation), {n[0], n[1], n[2]}, n[7]};
      },
      "Give a model this place, rotation (a quaternion) and scale; a signpost gets the place, and the scale "
      "as its height")
      ->type_name("X Y Z QX QY QZ QW S");
  edit->add_option("--align", options->align,
                   "Give a model the pose that fits three or more points of it with their places in the map")
      ->type_name("\"X Y Z to X Y Z, ...\"");
  edit->add_option("--bend", options->bend,
                   "Bend a model so that four or more points of it are at their places in the map")
      ->type_name("\"X Y Z to X Y Z, ...\"");
  edit->add_flag("--unbend", options->unbend, "Give a model its original shape again");
}

void AddPropertyOptions(CLI::App* edit, EditOptions* options) {
  // Not as an optional, which an empty text would leave without a value.
  CLI::Option* text = edit->add_option_function<std::string>(
      "--text", [=](const std::string& value) { options->text = value; },
      "Change the text of a signpost or label, or a sound's caption");
  text->type_name("TEXT");
  edit->add_option("--language", options->language,
                   "Change the text for readers of this language only (a tag as de or es-419); an empty text "
                   "removes it")
      ->type_name("TAG")
      ->needs(text);
  AddNumbers(
      edit, "--offset", 3, -content::kMaxCoordinate, content::kMaxCoordinate,
      [=](const auto& n) { options->offset = Eigen::Vector3d(n[0], n[1], n[2]); },
      "Put the board of a label here, from what it is about along the map's axes, in map units")
      ->type_name("X Y Z");
  AddNumbers(
      edit, "--size", 3, 0, content::kMaxOccluderSide,
      [=](const auto& n) { options->size = Eigen::Vector3d(n[0], n[1], n[2]); },
      "Give an occluder this width, height and depth; the depth is used only for a box")
      ->type_name("W H D");
  edit->add_option("--extend", options->extend, "Add a point at the end of a trail, in map units")
      ->type_name("\"X Y Z\"");
  edit->add_flag("--shorten", options->shorten, "Remove the last point of a trail; done before --extend");
  CLI::Option* to = edit->add_option("--to", options->to_map, "Let a signpost lead to this map");
  to->type_name("MAP");
  edit->add_flag("--to-nowhere", options->nowhere, "Let a signpost lead to no map")->excludes(to);
  CLI::Option* direction = AddNumbers(
      edit, "--direction", 3, -content::kMaxCoordinate, content::kMaxCoordinate,
      [=](const auto& n) { options->direction = Eigen::Vector3d(n[0], n[1], n[2]); },
      "Make the arrow of a signpost point in this direction along the map's axes, in which visitors leave "
      "for "
      "the map that it leads to");
  direction->type_name("X Y Z");
  CLI::Option* find = edit->add_flag("--find-direction", options->find_direction,
                                     "Let the arrow of a signpost point to where the map begins that it "
                                     "leads to; both maps have to show one place");
  CLI::Option* no_direction =
      edit->add_flag("--no-direction", options->no_direction, "Take the arrow from a signpost");
  direction->excludes(find)->excludes(no_direction);
  find->excludes(no_direction);
  edit->add_option("--rename", options->rename, "Change the name")->type_name("NEW");
  CLI::Option* group = edit->add_option("--group", options->group, "Put them in this group");
  group->type_name("GROUP");
  edit->add_flag("--ungroup", options->ungroup, "Take them out of their groups")->excludes(group);
  CLI::Option* hide = edit->add_flag("--hide", options->hide, "Do not draw them");
  edit->add_flag("--show", options->show, "Draw them again")->excludes(hide);
  edit->add_flag("--lock", options->lock, "Refuse every change but --unlock");
  edit->add_flag("--unlock", options->unlock, "Allow changes again; done before the other changes");
  edit->add_flag("--duplicate", options->duplicate,
                 "Add a copy of each beside it; done before the other changes");
}

}  // namespace

void AddContentEditCommand(CLI::App* group, Invocation* invocation) {
  const auto options = std::make_shared<EditOptions>();
  CLI::App* edit = AddSubcommand(
      group, "edit", "Change what is placed",
      "docent content edit fox --map \"Desk 3\" --move 0 0 0.1 --scale 2 --library museum.docent\n"
      "  docent content edit sign-1 --map \"Desk 3\" --text \"Lions\" --to \"Desk 5\" "
      "--library museum.docent");
  edit->add_option("NAME", options->names, "Names of what is changed")->required();
  edit->add_option("--map", options->map, "The map that contains them")->required();
  AddLibraryOption(edit, LibraryUse::kChange, &options->library, invocation);
  AddPoseOptions(edit, options.get());
  AddPropertyOptions(edit, options.get());
  edit->callback([=] {
    try {
      invocation->run = [=, commands = CheckedCommandsFor(*options)] { RunEdit(*options, commands); };
    } catch (const Error& error) {
      throw CLI::ValidationError(error.what());
    }
  });
}

}  // namespace docent::app
