// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/command_line/interruption.h"
#include "app/command_line/maps_exchange_command.h"
#include "app/command_line/maps_hub_command.h"
#include "app/command_line/maps_tour_command.h"
#include "app/command_line/program.h"
#include "app/command_line/progress.h"
#include "app/command_line/text_table.h"
#include "app/session/library_scene.h"
#include "engine/base/error.h"
#include "maps/library/library.h"
#include "maps/library/session_lock.h"
#include "maps/maintenance/relocalization_check.h"

namespace docent::app {

namespace {

using Json = nlohmann::ordered_json;

// Arguments of all subcommands of `maps`.
struct MapsOptions {
  std::filesystem::path library;
  std::string name, new_name, policy;
  bool as_json = false, force = false;
  Verbosity verbosity = Verbosity::kNormal;
};
using MapsAction = void (*)(const MapsOptions& options);

std::string FormatWallTime(maps::WallTime time) {
  const std::time_t seconds = std::chrono::system_clock::to_time_t(
      std::chrono::time_point_cast<std::chrono::system_clock::duration>(time));
  std::tm utc{};
  char text[32] = "";
  if (gmtime_r(&seconds, &utc) != nullptr) std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text;
}

maps::Library OpenToRead(const MapsOptions& options) {
  return OpenLibrary(options.library, maps::Access::kReadOnly);
}
maps::Library OpenToWrite(const MapsOptions& options) {
  return OpenLibrary(options.library, maps::Access::kReadWrite);
}

Json ToJson(const maps::MapInfo& map) {
  return {{"name", map.name},
          {"policy", maps::ToString(map.policy)},
          {"keyframes", map.keyframes},
          {"points", map.points},
          {"observations", map.observations},
          {"revision", map.revision},
          {"created", FormatWallTime(map.created)},
          {"modified", FormatWallTime(map.modified)}};
}

void Print(const Json& json) {
  std::printf("%s\n", json.dump(2, ' ', false, Json::error_handler_t::replace).c_str());
}

void List(const MapsOptions& options) {
  const std::vector<maps::MapInfo> infos = OpenToRead(options).List();
  if (options.as_json) {
    Json json = {{"maps", Json::array()}};
    for (const maps::MapInfo& map : infos) json["maps"].push_back(ToJson(map));
    Print(json);
    return;
  }
  if (infos.empty()) std::puts("The library holds no map.");
  std::vector<std::vector<std::string>> rows;
  for (const maps::MapInfo& map : infos) {
    rows.push_back({map.name, maps::ToString(map.policy), std::to_string(map.keyframes) + " keyframes",
                    std::to_string(map.points) + " points", FormatWallTime(map.modified)});
  }
  const std::string table =
      FormatColumns({{24}, {12}, {16, Alignment::kRight}, {15, Alignment::kRight}, {}}, rows);
  std::fputs(table.c_str(), stdout);
}

// Estimates how often a lost camera is relocalized, by leaving each keyframe out in turn.
Json DescribeRelocalization(const engine::MapSnapshot& map, Verbosity verbosity) {
  using Result = maps::RelocalizationTrial::Result;
  const Interruption interruption;
  Progress progress("Relocalizing keyframes", map.keyframes.size(), verbosity);
  const auto trials = maps::LeaveEachKeyFrameOut(map, {}, [&](std::size_t done) {
    progress.Update(done);
    return !Interruption::requested();
  });
  if (Interruption::requested()) throw Error("Interrupted.");
  const auto count = [&](Result result) {
    return std::count_if(trials.begin(), trials.end(),
                         [&](const maps::RelocalizationTrial& trial) { return trial.result == result; });
  };
  Json json = {
      {"trials", trials.size()}, {"found", count(Result::kFound)}, {"wrong", count(Result::kWrongPose)}};
  json["missed_keyframes"] = Json::array();
  for (const maps::RelocalizationTrial& trial : trials) {
    if (trial.result != Result::kFound) json["missed_keyframes"].push_back(trial.keyframe);
  }
  if (trials.empty()) return json;
  const auto grid = maps::MakeRelocalizationGrid(map, trials);
  json["square_side"] = grid.side;
  json["grid"] = Json::array();
  for (const maps::RelocalizationCell& cell : grid.cells) {
    json["grid"].push_back({{"right", cell.square.x()},
                            {"ahead", cell.square.y()},
                            {"direction_deg", 45 * cell.direction},
                            {"trials", cell.trials},
                            {"found", cell.found}});
  }
  return json;
}

// Prints the result of DescribeRelocalization as text.
void PrintRelocalization(const Json& json) {
  std::printf("%-20s %s of %s left-out keyframes relocalized, %s at a wrong pose\n", "relocalization",
              json["found"].dump().c_str(), json["trials"].dump().c_str(), json["wrong"].dump().c_str());
  if (!json.contains("grid")) return;
  std::printf("%-20s %s\n", "missed_keyframes", json["missed_keyframes"].dump().c_str());
  std::printf("%-20s squares of %.3g map units; right, ahead and direction relative to the first keyframe\n",
              "", json["square_side"].get<double>());
  for (const Json& cell : json["grid"]) {
    std::printf("%-20s right %3d  ahead %3d  %4d deg  %d of %d\n", "", cell["right"].get<int>(),
                cell["ahead"].get<int>(), cell["direction_deg"].get<int>(), cell["found"].get<int>(),
                cell["trials"].get<int>());
  }
}

// Summary of a map. `camera_extent` is the size of the bounding box of the keyframe positions, in map
// units; `surface_triangles` is 0 for a map whose surfaces have not been computed.
Json Describe(const maps::StoredMap& map, Verbosity verbosity) {
  Json json = ToJson(map.info);
  int panorama = 0, infinite = 0;
  Eigen::AlignedBox3d cameras;
  for (const engine::KeyFrame& keyframe : map.snapshot->keyframes) {
    if (keyframe.kind == engine::KeyFrameKind::kPanorama) ++panorama;
    cameras.extend(keyframe.camera_from_map.OriginInSource());
  }
  for (const engine::MapPoint& point : map.snapshot->points) infinite += point.infinite() ? 1 : 0;
  json["panorama_keyframes"] = panorama;
  json["infinite_points"] = infinite;
  json["surface_triangles"] = map.mesh ? map.mesh->mesh.triangles.size() : 0;
  const Eigen::Vector3d size = cameras.isEmpty() ? Eigen::Vector3d::Zero() : Eigen::Vector3d(cameras.sizes());
  json["camera_extent"] = {size.x(), size.y(), size.z()};
  json["relocalization"] = DescribeRelocalization(*map.snapshot, verbosity);
  json["assets"] = Json::array();
  for (const maps::AssetRecord& asset : map.scene.assets) json["assets"].push_back(asset.name);
  return json;
}

void Show(const MapsOptions& options) {
  const maps::Library library = OpenToRead(options);
  const Json json = Describe(library.Load(library.FindByName(options.name).key), options.verbosity);
  if (options.as_json) {
    Print(json);
    return;
  }
  for (const auto& [field, value] : json.items()) {
    if (field == "relocalization") {
      PrintRelocalization(value);
      continue;
    }
    const std::string text = value.is_string() ? value.get<std::string>()
                                               : value.dump(-1, ' ', false, Json::error_handler_t::replace);
    std::printf("%-20s %s\n", field.c_str(), text.c_str());
  }
}

void Verify(const MapsOptions& options) {
  const maps::Library library = OpenToRead(options);
  const std::vector<std::string> problems = library.Verify(), lost = library.SignpostsToNoMap();
  for (const std::string& sentence : lost) std::printf("%s\n", sentence.c_str());
  if (problems.empty()) {
    std::printf("%s: no %s found\n", library.file().c_str(), lost.empty() ? "problems" : "damage");
    return;
  }
  for (const std::string& problem : problems) std::printf("%s\n", problem.c_str());
  throw Error("'" + library.file() + "' is damaged: " + std::to_string(problems.size()) +
              (problems.size() == 1 ? " problem" : " problems") +
              "; run docent maps recover to save the maps that are still readable.");
}

void Rename(const MapsOptions& options) {
  maps::Library library = OpenToWrite(options);
  const maps::SessionLock lock(options.library, maps::SessionLockKind::kReplace);
  library.Rename(library.FindByName(options.name).key, options.new_name);
}

std::vector<std::string> ToursThatStopAt(std::uint64_t key, const maps::Library& library) {
  std::vector<std::string> names, damaged;
  for (const maps::Tour& tour : library.Tours(&damaged)) {
    if (std::find(tour.stops.begin(), tour.stops.end(), key) != tour.stops.end()) names.push_back(tour.name);
  }
  return names;
}

// Throws if signposts lead to the map or tours stop at it.
void RefuseIfNeeded(const std::string& map, std::size_t signposts, std::size_t tours) {
  if (signposts == 0 && tours == 0) return;
  std::string uses, consequences;
  if (signposts > 0) {
    uses = std::to_string(signposts) + (signposts == 1 ? " signpost leads" : " signposts lead") + " to";
    consequences = signposts == 1 ? "the signpost leads nowhere" : "the signposts lead nowhere";
  }
  if (tours > 0) {
    uses += (uses.empty() ? "" : ", and ") + std::to_string(tours) +
            (tours == 1 ? " tour stops at" : " tours stop at");
    consequences += std::string(consequences.empty() ? "" : ", and ") +
                    (tours == 1 ? "the tour leaves it out" : "the tours leave it out");
  }
  throw Error(uses + " '" + map + "', which was not removed; with --force it is removed, and " +
              consequences + ".");
}

void Remove(const MapsOptions& options) {
  maps::Library library = OpenToWrite(options);
  const maps::SessionLock lock(options.library, maps::SessionLockKind::kReplace);
  const std::uint64_t key = library.FindByName(options.name).key;
  const std::vector<maps::Library::Signpost> signposts = library.SignpostsTo(key);
  for (const maps::Library::Signpost& signpost : signposts) {
    if (options.verbosity != Verbosity::kQuiet || !options.force)
      std::printf("map '%s': the signpost '%s' leads to '%s'\n", signpost.map.name.c_str(),
                  signpost.name.c_str(), options.name.c_str());
  }
  const std::vector<std::string> tours = ToursThatStopAt(key, library);
  for (const std::string& tour : tours) {
    if (options.verbosity != Verbosity::kQuiet || !options.force)
      std::printf("the tour '%s' stops at '%s'\n", tour.c_str(), options.name.c_str());
  }
  if (!options.force) RefuseIfNeeded(options.name, signposts.size(), tours.size());
  library.Remove(key);
}

void SetMapPolicy(const MapsOptions& options) {
  maps::Library library = OpenToWrite(options);
  const maps::SessionLock lock(options.library, maps::SessionLockKind::kReplace);
  library.SetPolicy(library.FindByName(options.name).key, *maps::ParsePolicy(options.policy));
}

}  // namespace

void AddMapsCommand(CLI::App* program, Invocation* invocation) {
  CLI::App* group = AddSubcommand(program, "maps", "Manage the maps of a library",
                                  "docent maps list --library museum.docent");
  group->require_subcommand(1);
  const auto options = std::make_shared<MapsOptions>();
  const auto add = [&](const char* name, LibraryUse use, const char* description, const char* example,
                       MapsAction action) {
    CLI::App* command = AddSubcommand(group, name, description, example);
    AddLibraryOption(command, use, &options->library, invocation);
    command->callback([=] {
      invocation->run = [=] {
        options->verbosity = invocation->verbosity;
        action(*options);
      };
    });
    return command;
  };
  const auto add_name = [&](CLI::App* command) {
    command->add_option("NAME", options->name, "Name of the map")->required();
    return command;
  };
  const auto add_json = [&](CLI::App* command) {
    command->add_flag("--json", options->as_json, "Print JSON");
  };

  add_json(add("list", LibraryUse::kRead, "List the maps", "docent maps list --library museum.docent --json",
               List));
  add_json(add_name(add("show", LibraryUse::kRead, "Show one map",
                        "docent maps show \"Desk 3\" --library museum.docent", Show)));
  add("verify", LibraryUse::kCopyOnly, "Read the whole library and report damage",
      "docent maps verify --library museum.docent", Verify);
  add_name(add("rename", LibraryUse::kChange, "Rename a map",
               "docent maps rename \"Desk 3\" Kiosk --library museum.docent", Rename))
      ->add_option("NEW_NAME", options->new_name, "New name of the map")
      ->required();
  add_name(add("remove", LibraryUse::kChange, "Remove a map and its content",
               "docent maps remove Kiosk --library museum.docent", Remove))
      ->add_flag("--force", options->force,
                 "Also if signposts lead to it, which then lead nowhere, or tours stop at it, "
                 "which then leave it out");
  add_name(add("policy", LibraryUse::kChange, "Set what may be changed in a map",
               "docent maps policy Kiosk read-only --library museum.docent", SetMapPolicy))
      ->add_option("POLICY", options->policy, "open, bounded, augment-only or read-only")
      ->required()
      ->check(CLI::IsMember({"open", "bounded", "augment-only", "read-only"}));
  AddMapsTourCommands(group, invocation);
  AddMapsExchangeCommands(group, invocation);
  AddMapsHubCommands(group, invocation);
}

}  // namespace docent::app
