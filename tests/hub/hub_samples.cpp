// SPDX-License-Identifier: Apache-2.0
#include "tests/hub/hub_samples.h"

#include <set>

#include "app/session/library_scene.h"

namespace docent::maps {

SyncOptions SampleSync(const std::string& hub, const std::filesystem::path& library) {
  return app::SyncOptionsOf(hub, library);
}

Library OpenSampleLibrary(const std::filesystem::path& file) {
  LibraryOptions options = QuickOptions();
  options.scenes = app::LibrarySceneTools();
  return Library::Open(file, Access::kReadWrite, CreateIfMissing::kYes, options);
}

content::Entity SampleSignpost(const std::string& name, const std::string& text) {
  content::Entity entity;
  entity.name = name;
  entity.kind = content::Entity::Kind::kSignpost;
  entity.signpost.text = text;
  return entity;
}

std::uint64_t AddSampleMap(Library* library, const std::string& name, std::uint64_t seed, Policy policy) {
  MapRecord record;
  record.key = library->NewKey();
  record.name = name;
  record.policy = policy;
  record.snapshot = MakeSampleMap(seed);
  content::Scene scene;
  scene.entities.push_back(SampleSignpost("sign-1", "Hello"));
  record.scene = std::make_shared<const SceneRecord>(app::RecordFromScene(scene));
  library->Save(record);
  return record.key;
}

content::Scene SceneIn(const Library& library, std::uint64_t key) {
  app::AssetCache assets;
  return app::SceneFromRecord(library.LoadScene(key), "the scene", &assets);
}

void EditScene(Library* library, std::uint64_t key, const std::function<void(content::Scene*)>& edit) {
  content::Scene scene = SceneIn(*library, key);
  edit(&scene);
  MapRecord record;
  record.key = key;
  record.scene = std::make_shared<const SceneRecord>(app::RecordFromScene(scene));
  library->Save(record);
}

void AddSampleSignpost(const std::filesystem::path& library, const std::string& map, const std::string& name,
                       const std::string& text) {
  Library opened = OpenSampleLibrary(library);
  EditScene(&opened, opened.FindByName(map).key,
            [&](content::Scene* scene) { scene->entities.push_back(SampleSignpost(name, text)); });
}

void ExtendMap(Library* library, std::uint64_t key, const Eigen::Vector3d& place, std::uint64_t seed) {
  auto map = std::make_shared<engine::MapSnapshot>(*library->Load(key).snapshot);
  AddSampleKeyFrame(seed, place, map.get());
  ++map->revision;
  MapRecord record;
  record.key = key;
  record.snapshot = map;
  library->Save(record);
}

std::string TextsIn(const Library& library, std::uint64_t key) {
  std::string texts;
  for (const content::Entity& entity : SceneIn(library, key).entities)
    texts += (texts.empty() ? "" : " ") + entity.name + "=" + entity.signpost.text;
  return texts;
}

std::string NamesIn(const Library& library) {
  std::set<std::string> names;
  for (const MapInfo& info : library.List()) names.insert(info.name);
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ",") + name;
  return text;
}

std::string DifferenceOf(const std::string& name, const std::filesystem::path& a,
                         const std::filesystem::path& b) {
  const Library one = OpenSampleLibrary(a), other = OpenSampleLibrary(b);
  const StoredMap map = one.Load(one.FindByName(name).key), copy = other.Load(other.FindByName(name).key);
  if (map.info.policy != copy.info.policy || map.info.bounds != copy.info.bounds) return "policy or bounds";
  const std::string structure = FirstDifference(*map.snapshot, *copy.snapshot);
  return structure.empty() ? FirstDifference(map.scene, copy.scene) : structure;
}

std::string LinesOf(const SyncReport& report) {
  std::string text;
  for (const std::string& line : report.lines) text += line + "\n";
  return text;
}

}  // namespace docent::maps
