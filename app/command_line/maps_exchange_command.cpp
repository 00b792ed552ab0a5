// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/maps_exchange_command.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <cstdio>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <stop_token>
#include <thread>

#include "app/command_line/interruption.h"
#include "app/command_line/progress.h"
#include "app/files/checked_file.h"
#include "app/output/engine_text.h"
#include "app/session/content_follower.h"
#include "app/session/joined_scenes.h"
#include "app/session/library_scene.h"
#include "engine/base/error.h"
#include "engine/base/worker.h"
#include "maps/exchange/colmap_model.h"
#include "maps/exchange/exchange.h"
#include "maps/exchange/mesh_ply.h"
#include "maps/exchange/view_from_above.h"
#include "maps/library/map_copies.h"
#include "maps/library/session_lock.h"
#include "maps/maintenance/densify.h"
#include "maps/maintenance/joining.h"
#include "maps/maintenance/maintenance.h"
#include "maps/maintenance/recovery.h"

namespace docent::app {

namespace {

namespace fs = std::filesystem;

struct ExchangeOptions {
  fs::path library, output, from;
  std::string name, other_name;
  bool as_mesh = false;
};
using ExchangeAction = void (*)(const ExchangeOptions& options, Verbosity verbosity);

void WriteText(const fs::path& path, std::string_view text) {
  CheckedFile file(path);
  file.Write(text);
  file.Close();
}

void WritePng(const fs::path& path, const cv::Mat& image) {
  std::vector<std::uint8_t> bytes;
  if (!cv::imencode(".png", image, bytes)) throw Error("Cannot write '" + path.string() + "' as PNG.");
  WriteText(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

// Writes into a temporary folder and renames it at the end, so that an incomplete model never has the final
// name.
void WriteColmap(const fs::path& folder, const engine::MapSnapshot& map) {
  const maps::ColmapModel model = maps::MakeColmapModel(map);
  fs::path unfinished = folder.has_filename() ? folder : folder.parent_path();
  unfinished += ".part";
  MakeFolder(unfinished / "images");
  WriteText(unfinished / "cameras.txt", model.cameras);
  WriteText(unfinished / "images.txt", model.images);
  WriteText(unfinished / "points3D.txt", model.points3d);
  for (const auto& [name, keyframe] : model.image_of)
    WritePng(unfinished / "images" / name, map.FindKeyFrame(keyframe)->features->levels[0]);
  std::error_code error;
  fs::rename(unfinished, folder, error);
  if (error) throw Error("Cannot write '" + folder.string() + "': " + error.message() + ".");
}

// Mentions the infinite points, which formats for 3D positions cannot hold.
std::string OmittedPointsNote(const engine::MapSnapshot& map) {
  const auto infinite = std::count_if(map.points.begin(), map.points.end(),
                                      [](const engine::MapPoint& point) { return point.infinite(); });
  if (infinite == 0) return "";
  return "; " + std::to_string(infinite) +
         (infinite == 1 ? " infinite point was left out, because it has no position"
                        : " infinite points were left out, because they have no position");
}

// Mentions the tours that stop at a map, which are not exported with it.
std::string OmittedToursNote(const maps::Library& library, std::uint64_t key) {
  std::vector<std::string> damaged;
  const std::vector<maps::Tour> tours = library.Tours(&damaged);
  const auto count = std::count_if(tours.begin(), tours.end(), [&](const maps::Tour& tour) {
    return std::find(tour.stops.begin(), tour.stops.end(), key) != tour.stops.end();
  });
  if (count == 0) return "";
  return "; " + std::to_string(count) +
         (count == 1 ? " tour that stops there was left out" : " tours that stop there were left out");
}

std::string MeshFile(const maps::Library& library, std::uint64_t key, const std::string& name) {
  const std::optional<engine::MapMesh> mesh = library.LoadMesh(key);
  if (!mesh) throw Error("'" + name + "' has no mesh; run docent maps densify to compute it.");
  return maps::MakeMeshPly(mesh->mesh);
}

// Throws CLI::ValidationError for a file type that is not written.
void CheckExportType(const ExchangeOptions& options) {
  const std::string kind = options.output.extension().string();
  if (!kind.empty() && kind != ".docent" && kind != ".ply" && kind != ".png") {
    throw CLI::ValidationError(
        "--output",
        "'" + options.output.string() +
            "' has an unknown file type; use a .docent, .ply or .png file, or a folder for COLMAP's files");
  }
  if (options.as_mesh && kind != ".ply")
    throw CLI::ValidationError("--mesh", "a mesh is written to a .ply file");
}

void Export(const ExchangeOptions& options, Verbosity verbosity) {
  const maps::Library library = OpenLibrary(options.library, maps::Access::kReadOnly);
  const std::uint64_t key = library.FindByName(options.name).key;
  const std::string kind = options.output.extension().string();
  std::error_code error;
  if (fs::exists(options.output, error) && !(kind.empty() && fs::is_empty(options.output, error)))
    throw Error("'" + options.output.string() + "' already exists; choose a new name.");
  std::string left_out;
  if (kind == ".docent") {
    maps::ExportMap(library, key, options.output, LibrarySceneTools());
    left_out = OmittedToursNote(library, key);
  } else if (options.as_mesh) {
    WriteText(options.output, MeshFile(library, key, options.name));
  } else {
    const auto map = library.Load(key).snapshot;
    left_out = OmittedPointsNote(*map);
    if (kind == ".ply") WriteText(options.output, maps::MakePly(*map));
    if (kind == ".png") WritePng(options.output, maps::DrawFromAbove(*map));
    if (kind.empty()) WriteColmap(options.output, *map);
  }
  if (verbosity != Verbosity::kQuiet)
    std::printf("%s: written to %s%s\n", options.name.c_str(), options.output.c_str(), left_out.c_str());
}

void Import(const ExchangeOptions& options, Verbosity verbosity) {
  const maps::Library from = OpenLibrary(options.from, maps::Access::kReadOnly);
  const maps::Imported imported = maps::ImportMaps(from, options.library, LibrarySceneTools());
  if (verbosity == Verbosity::kQuiet) return;
  const auto print = [](const char* before, const char* kind, const maps::ImportedName& added) {
    std::printf("%s%s", before, added.name.c_str());
    if (added.name != added.name_before)
      std::printf(" (renamed, because there is already a %s named %s)", kind, added.name_before.c_str());
    std::printf("\n");
  };
  for (const maps::ImportedName& map : imported.maps) print("", "map", map);
  for (const maps::ImportedName& tour : imported.tours) print("tour ", "tour", tour);
  const maps::Library into = OpenLibrary(options.library, maps::Access::kReadOnly);
  for (const maps::MapCopy& copy : maps::FindCopies(into)) {
    const bool is_new = std::any_of(imported.maps.begin(), imported.maps.end(), [&](const auto& map) {
      return map.name == copy.older.name || map.name == copy.newer.name;
    });
    if (is_new) std::printf("%s.\n", maps::TextOf(copy).c_str());
  }
}

const char* ToText(maps::Optimization::Outcome outcome) {
  using Outcome = maps::Optimization::Outcome;
  switch (outcome) {
    case Outcome::kAdjusted:
      return "adjusted";
    case Outcome::kAlreadyOptimal:
      return "already optimal";
    case Outcome::kNotAllowed:
      return "not changed, because its policy forbids it";
    case Outcome::kTooSmall:
      return "too small to adjust";
    case Outcome::kInterrupted:
      return "interrupted; not changed";
    case Outcome::kChangedMeanwhile:
      return "changed by another program in the meantime; not optimized";
    case Outcome::kFailed:
      return "could not be adjusted; not changed";
  }
  return "";
}

// Moves content together with the map points that it is anchored to.
maps::MoveScene SceneMover(const std::string& library) {
  return [library](const maps::StoredContent& stored, const engine::MapSnapshot& before,
                   const engine::MapSnapshot& after) {
    AssetCache assets;
    maps::StoredContent moved;
    auto scene = std::make_shared<const content::Scene>(SceneFromRecord(*stored.scene, library, &assets));
    std::optional<content::EditHistory> history;
    try {
      if (stored.history) history = HistoryFromRecord(*stored.history, library, &assets);
    } catch (const Error&) {
      history.reset();  // A damaged history costs nothing else.
    }
    content::EditHistory changes = history.value_or(content::EditHistory());
    ContentFollower follower;
    if (!MoveContent(before, after, &follower, &scene, &changes)) return moved;
    moved.scene = std::make_shared<maps::SceneRecord>(RecordFromScene(*scene));
    if (history) moved.history = std::make_shared<maps::SceneRecord>(RecordFromHistory(changes, *scene));
    return moved;
  };
}

// An atomic flag that is set when the program is interrupted. Long operations in `maps` poll such a flag,
// because they do not know the program's signal handling.
class InterruptFlag {
 public:
  InterruptFlag()
      : watch_("interruption", [this](const std::stop_token& stop) {
          while (!stop.stop_requested() && !flag_) {
            flag_ = Interruption::requested();
            std::this_thread::sleep_for(std::chrono::milliseconds(50));
          }
        }) {}
  const std::atomic<bool>* get() const { return &flag_; }

 private:
  const Interruption interruption_;
  std::atomic<bool> flag_ = false;
  Worker watch_;  // Last member: its thread uses the others.
};

void Optimize(const ExchangeOptions& options, Verbosity verbosity) {
  maps::Library library = OpenLibrary(options.library, maps::Access::kReadWrite);
  const maps::SessionLock lock(options.library, maps::SessionLockKind::kReplace);
  std::vector<maps::MapInfo> infos = library.List();
  if (!options.name.empty()) infos = {library.FindByName(options.name)};
  const InterruptFlag interrupt;
  std::optional<Progress> progress;
  progress.emplace("Maps", infos.size(), verbosity);
  std::vector<std::string> lines;
  for (std::size_t i = 0; i < infos.size() && !Interruption::requested(); ++i) {
    const maps::Optimization result =
        maps::OptimizeMap(&library, infos[i].key, interrupt.get(), SceneMover(options.library));
    char numbers[240] = "";
    if (result.outcome == maps::Optimization::Outcome::kAdjusted) {
      std::snprintf(numbers, sizeof numbers,
                    ": RMS reprojection error %.3f px before, %.3f px after; %zu observations added and %zu "
                    "removed, %zu "
                    "points and %zu redundant keyframes removed",
                    result.rms_before_px, result.rms_after_px, result.observations_added,
                    result.observations_removed, result.points_removed, result.keyframes_removed);
    }
    lines.push_back(infos[i].name + " " + ToText(result.outcome) + numbers);
    progress->Update(i + 1);
  }
  progress.reset();  // Erases its line.
  if (verbosity != Verbosity::kQuiet) {
    for (const std::string& line : lines) std::printf("%s\n", line.c_str());
  }
  if (Interruption::requested()) throw Error("Interrupted; the maps adjusted so far are saved.");
}

void Densify(const ExchangeOptions& options, Verbosity verbosity) {
  maps::Library library = OpenLibrary(options.library, maps::Access::kReadWrite);
  std::vector<maps::MapInfo> infos = library.List();
  if (!options.name.empty()) infos = {library.FindByName(options.name)};
  const InterruptFlag interrupt;
  for (const maps::MapInfo& info : infos) {
    std::optional<Progress> progress;
    progress.emplace(info.name + ", keyframes", info.keyframes, verbosity);
    const maps::DensifyResult result = maps::DensifyStoredMap(
        &library, info.key, {}, [&](std::size_t done, std::size_t) { progress->Update(done); },
        interrupt.get());
    progress.reset();  // Erases its line.
    if (Interruption::requested())
      throw Error("Interrupted; the meshes computed so far are saved, and the same command continues.");
    if (verbosity == Verbosity::kQuiet) continue;
    std::printf("%s %s", info.name.c_str(), maps::ToText(result.outcome));
    if (result.triangles > 0) std::printf(": %zu triangles, %zu kB", result.triangles, result.bytes / 1000);
    std::printf("\n");
  }
}

void Join(const ExchangeOptions& options, Verbosity verbosity) {
  maps::Library library = OpenLibrary(options.library, maps::Access::kReadWrite);
  const maps::SessionLock lock(options.library, maps::SessionLockKind::kReplace);
  const std::uint64_t into = library.FindByName(options.name).key,
                      from = library.FindByName(options.other_name).key;
  const InterruptFlag interrupt;
  const maps::JoinResult result =
      maps::JoinMaps(&library, into, from, LibrarySceneJoiner(options.library), interrupt.get());
  if (Interruption::requested() && !result.Joined()) throw Error("Interrupted; nothing was changed.");
  if (verbosity == Verbosity::kVerbose) std::printf("%s\n", TextOf(result.overlap).c_str());
  if (!result.Joined()) {
    const std::string reason = result.changed_meanwhile
                                   ? "one of them was changed by another program in the meantime"
                                   : TextOf(result.refusal, result.overlap);
    throw Error("'" + options.name + "' and '" + options.other_name + "' cannot be joined, because " +
                reason);
  }
  if (verbosity != Verbosity::kQuiet) {
    const maps::MapInfo joined = library.Find(into);
    std::printf(
        "%s now contains %s: %llu keyframes and %llu points, %d duplicate points fused; policy %s\n",
        options.name.c_str(), options.other_name.c_str(), static_cast<unsigned long long>(joined.keyframes),
        static_cast<unsigned long long>(joined.points), result.points_merged, maps::ToString(joined.policy));
  }
}

void Recover(const ExchangeOptions& options, Verbosity verbosity) {
  const maps::Recovery recovery = maps::Recover(options.library, options.output, LibrarySceneTools());
  if (verbosity == Verbosity::kQuiet) return;
  for (const std::string& problem : recovery.problems) std::printf("lost: %s\n", problem.c_str());
  std::printf("%zu %s recovered completely and %zu partly, written to %s\n", recovery.maps_complete,
              recovery.maps_complete == 1 ? "map" : "maps", recovery.maps_partial, options.output.c_str());
}

}  // namespace

void AddMapsExchangeCommands(CLI::App* group, Invocation* invocation) {
  const auto options = std::make_shared<ExchangeOptions>();
  const auto add = [&](const char* name, LibraryUse use, const char* description, const char* example,
                       ExchangeAction action) {
    CLI::App* command = AddSubcommand(group, name, description, example);
    AddLibraryOption(command, use, &options->library, invocation);
    command->callback([=] { invocation->run = [=] { action(*options, invocation->verbosity); }; });
    return command;
  };
  CLI::App* command =
      add("export", LibraryUse::kRead,
          "Export one map as a library, a COLMAP model, a PLY point cloud or an image from above",
          "docent maps export \"Desk 3\" --library museum.docent --output desk.docent", Export);
  command->add_option("NAME", options->name, "Name of the map")->required();
  command->add_flag(
      "--mesh", options->as_mesh,
      "With a .ply file: the mesh of the surfaces, which densify computes, instead of the points");
  command
      ->add_option("--output", options->output,
                   "A .docent library, a .ply point cloud, a .png image from above, or a folder for COLMAP's "
                   "text model")
      ->required();
  command->callback([=] {
    CheckExportType(*options);
    invocation->run = [=] { Export(*options, invocation->verbosity); };
  });
  add("import", LibraryUse::kChange,
      "Add the maps and tours of another library; duplicate names get a number",
      "docent maps import desk.docent --library museum.docent", Import)
      ->add_option("FILE", options->from, "The other library")
      ->required();
  add("optimize", LibraryUse::kChange, "Improve maps and remove redundant data",
      "docent maps optimize --library museum.docent", Optimize)
      ->add_option("NAME", options->name, "Name of the map; without it, all maps");
  add("densify", LibraryUse::kChange,
      "Compute the surfaces of maps, behind which content is hidden; maps that have them already are left "
      "out",
      "docent maps densify --library museum.docent", Densify)
      ->add_option("NAME", options->name, "Name of the map; without it, all maps");
  CLI::App* join = add(
      "join", LibraryUse::kChange,
      "Join two overlapping maps; the first keeps its name and coordinates, the second is removed, and the "
      "stricter policy applies",
      "docent maps join \"East wing\" \"West wing\" --library museum.docent", Join);
  join->add_option("NAME", options->name, "Name of the map that the other is joined into")->required();
  join->add_option("OTHER", options->other_name, "Name of the map that is joined into it and removed")
      ->required();
  add("recover", LibraryUse::kCopyOnly, "Save the readable parts of a damaged library to a new one",
      "docent maps recover --library damaged.docent --output saved.docent", Recover)
      ->add_option("--output", options->output, "The new library")
      ->required();
}

}  // namespace docent::app
