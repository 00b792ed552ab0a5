// SPDX-License-Identifier: Apache-2.0
#include "maps/exchange/exchange.h"

#include <algorithm>
#include <set>
#include <system_error>
#include <utility>

#include "engine/base/error.h"
#include "maps/library/map_names.h"
#include "maps/library/signposts.h"

namespace docent::maps {

namespace {

// The undo history stays where the map comes from.
MapRecord RecordOf(StoredMap map, std::uint64_t key, std::string name) {
  MapRecord record;
  record.key = key;
  record.name = std::move(name);
  record.policy = map.info.policy;
  record.bounds = map.info.bounds;
  record.snapshot = std::move(map.snapshot);
  record.scene = std::make_shared<const SceneRecord>(std::move(map.scene));
  return record;
}

// Makes the signposts of a map lead to where they lead in another library.
void Redirect(const SceneTools& scenes, const Retarget& retarget, StoredMap* map) {
  if (!scenes.retarget || map->scene.text.empty()) return;
  if (const auto text = scenes.retarget(map->scene.text, retarget)) map->scene.text = *text;
}

// Adds tours through these maps to a library, where the maps have other keys.
std::vector<ImportedName> AddTours(std::vector<Tour> tours, const std::vector<MapInfo>& maps,
                                   const std::vector<SignpostTarget>& targets, Library* to) {
  std::vector<ImportedName> names;
  if (tours.empty()) return names;
  to->ChangeTours([&](std::vector<Tour>* all) {
    std::set<std::string> taken;
    for (const Tour& tour : *all) taken.insert(tour.name);
    for (Tour& tour : tours) {
      for (std::uint64_t& stop : tour.stops) {
        const auto map =
            std::find_if(maps.begin(), maps.end(), [&](const MapInfo& info) { return info.key == stop; });
        stop = map == maps.end() ? 0 : targets[static_cast<std::size_t>(map - maps.begin())].key;
      }
      std::erase(tour.stops, 0u);  // Of a damaged library.
      names.push_back({FreeName(tour.name, taken), tour.name});
      tour.name = names.back().name;
      taken.insert(tour.name);
      all->push_back(tour);
    }
  });
  return names;
}

LibraryOptions OptionsWith(const SceneTools& scenes) {
  LibraryOptions options;
  options.scenes = scenes;
  return options;
}

}  // namespace

void ExportMap(const Library& library, std::uint64_t key, const std::filesystem::path& path,
               const SceneTools& scenes) {
  std::error_code error;
  if (std::filesystem::exists(path, error))
    throw Error(path.string() + " exists already; choose a new file name for the map");
  StoredMap map = library.Load(key);
  // The new library has other keys, and no other map; where a signpost led remains known by its name.
  Redirect(
      scenes,
      [](const std::string&, const SignpostTarget& target) {
        return SignpostTarget{0, target.map};
      },
      &map);
  try {
    Library target = Library::Open(path, Access::kReadWrite, CreateIfMissing::kYes, OptionsWith(scenes));
    const std::string name = map.info.name;
    target.Save(RecordOf(std::move(map), target.NewKey(), name));
  } catch (const Error&) {
    for (const char* suffix : {"", "-wal", "-shm", "-journal"})
      std::filesystem::remove(path.string() + suffix, error);
    throw;
  }
}

Imported ImportMaps(const Library& from, const std::filesystem::path& path, const SceneTools& scenes) {
  const std::vector<MapInfo> infos = from.List();
  if (infos.empty()) throw Error(from.file() + " contains no map to import");
  for (const MapInfo& info : infos) from.Load(info.key);
  std::vector<Tour> tours = from.Tours();
  Library to = Library::Open(path, Access::kReadWrite, CreateIfMissing::kYes, OptionsWith(scenes));
  const std::vector<MapInfo> there = to.List();
  std::set<std::string> taken;
  for (const MapInfo& info : there) taken.insert(info.name);
  std::uint64_t key = to.ReserveKeys(infos.size());
  std::vector<SignpostTarget> targets;  // What the maps are here, in their order.
  for (const MapInfo& info : infos) {
    targets.push_back({key++, FreeName(info.name, taken)});
    taken.insert(targets.back().map);
  }
  // A signpost to a map that does not come along leads to the one that has its name here, if there is one.
  const auto retarget = [&](const std::string&, const SignpostTarget& target) {
    for (std::size_t i = 0; i < infos.size(); ++i) {
      if (LeadsTo(target, infos[i])) return targets[i];
    }
    const SignpostTarget by_name{0, target.map};
    return KeyOfTarget(by_name, there).value_or(by_name);
  };
  Imported imported;
  for (std::size_t i = 0; i < infos.size(); ++i) {
    StoredMap map = from.Load(infos[i].key);
    Redirect(scenes, retarget, &map);
    to.Save(RecordOf(std::move(map), targets[i].key, targets[i].map));
    imported.maps.push_back({targets[i].map, infos[i].name});
  }
  imported.tours = AddTours(std::move(tours), infos, targets, &to);
  return imported;
}

}  // namespace docent::maps
