// SPDX-License-Identifier: Apache-2.0
#include "content/history_codec.h"

#include <algorithm>
#include <deque>
#include <set>

#include "content/object_reader.h"
#include "engine/base/error.h"

namespace docent::content {
namespace {

constexpr std::string_view kHistoryPlace = "the history";

Json StateToJson(const std::optional<Entity>& state) {
  return state ? EntityToJson(*state) : Json();
}

// A change as text, with what it needs.
struct EncodedChange {
  std::string text;
  std::set<std::string> assets;
};

EncodedChange EncodeChange(const SceneChange& change) {
  EncodedChange encoded;
  Json entities = Json::array();
  for (const EntityChange& entity : change.entities) {
    for (const auto* state : {&entity.before, &entity.after}) {
      if (const auto asset = *state ? AssetOf(**state) : nullptr) encoded.assets.insert(asset->id);
    }
    entities.push_back({{"index", entity.index},
                        {"before", StateToJson(entity.before)},
                        {"after", StateToJson(entity.after)}});
  }
  Json json{{"label", change.label}, {"changes", std::move(entities)}};
  if (change.settings) {
    json["settings"] = {{"before", SettingsToJson(change.settings->before)},
                        {"after", SettingsToJson(change.settings->after)}};
  }
  encoded.text = json.dump();
  return encoded;
}

std::size_t BytesOf(const EncodedChange& change) {
  std::size_t bytes = change.text.size() + 1;  // With a comma. An asset may be counted more than once.
  for (const std::string& id : change.assets) bytes += Json(id).dump().size() + 1;
  return bytes;
}

// The newest changes, in their order, that fit into `budget` bytes, which they use up.
std::deque<EncodedChange> NewestThatFit(const std::vector<SceneChange>& changes, std::size_t* budget) {
  std::deque<EncodedChange> kept;
  for (auto change = changes.rbegin(); change != changes.rend(); ++change) {
    EncodedChange encoded = EncodeChange(*change);
    const std::size_t bytes = BytesOf(encoded);
    if (bytes > *budget) break;
    *budget -= bytes;
    kept.push_front(std::move(encoded));
  }
  return kept;
}

std::string Joined(const std::deque<EncodedChange>& changes) {
  std::string text = "[";
  for (const EncodedChange& change : changes) text += (text.size() > 1 ? "," : "") + change.text;
  return text + "]";
}

const Json& ListIn(const Json& json, const char* name, std::string_view where, std::string_view place) {
  const auto found = json.find(name);
  if (found == json.end() || !found->is_array())
    Refuse(where, place, "has no list '" + std::string(name) + "'.");
  return *found;
}

struct ParsedHistory {
  Json json;
  int version = 0;
};

ParsedHistory ParseHistory(std::string_view text, std::string_view where) {
  LoadLimits limits;
  limits.max_json_bytes = kMaxHistoryBytes;
  limits.max_json_values = kMaxHistoryBytes;  // A value has at least one byte.
  ParsedHistory parsed{ParseGltfJson(where, text, limits)};
  CheckMembers(where, kHistoryPlace, parsed.json, {"docent_history", "assets", "done", "undone"});
  const auto version = parsed.json.find("docent_history");
  if (version == parsed.json.end() || !version->is_number_unsigned() || *version < 2)
    Refuse(where, kHistoryPlace, "has no valid version.");
  if (*version > kSceneVersion) Refuse(where, kHistoryPlace, "was written by a newer version of Docent.");
  parsed.version = version->get<int>();
  for (const char* name : {"assets", "done", "undone"}) (void)ListIn(parsed.json, name, where, kHistoryPlace);
  return parsed;
}

// Reads changes; `incomplete` becomes true where an asset is missing.
class ChangeReader {
 public:
  ChangeReader(std::string_view where, int version, const AssetLookup& find_asset)
      : where_(where), version_(version), find_asset_(find_asset) {}

  // The changes after the last one that needs an asset which does not exist.
  std::vector<SceneChange> Read(const Json& list, const char* name) {
    std::vector<SceneChange> changes;
    for (std::size_t i = 0; i < list.size(); ++i) {
      bool complete = true;
      SceneChange change = ReadChange(list[i], Place(name, i), &complete);
      if (complete) {
        changes.push_back(std::move(change));
      } else {
        changes.clear();
      }
    }
    return changes;
  }

 private:
  SceneChange ReadChange(const Json& json, const std::string& place, bool* complete) {
    CheckMembers(where_, place, json, {"label", "changes", "settings"});
    const auto label = json.find("label");
    if (label == json.end() || !label->is_string() ||
        label->get_ref<const std::string&>().size() > kMaxTextBytes)
      Refuse(where_, place, "has no valid label.");
    SceneChange change{label->get<std::string>(), {}};
    if (json.contains("settings")) change.settings = ReadSettings(json["settings"], place + ".settings");
    const Json& entities = ListIn(json, "changes", where_, place);
    for (std::size_t i = 0; i < entities.size(); ++i) {
      const std::string entity_place = place + "." + Place("changes", i);
      const Json& entity = entities[i];
      CheckMembers(where_, entity_place, entity, {"index", "before", "after"});
      const auto index = entity.find("index");
      if (index == entity.end() || !index->is_number_unsigned() || *index > kMaxEntities)
        Refuse(where_, entity_place, "has no valid index.");
      EntityChange read{index->get<std::size_t>(), ReadState(entity, "before", entity_place, complete),
                        ReadState(entity, "after", entity_place, complete)};
      if (!read.before && !read.after) Refuse(where_, entity_place, "changes nothing.");
      change.entities.push_back(std::move(read));
    }
    return change;
  }

  SettingsChange ReadSettings(const Json& json, const std::string& place) {
    if (version_ < 3) Refuse(where_, place, "is not known to the version of this history.");
    CheckMembers(where_, place, json, {"before", "after"});
    const ObjectReader reader(where_, place, json);
    return {SettingsFromJson(where_, place + ".before", reader.Member("before")),
            SettingsFromJson(where_, place + ".after", reader.Member("after"))};
  }

  std::optional<Entity> ReadState(const Json& entity, const char* name, const std::string& place,
                                  bool* complete) {
    const auto state = entity.find(name);
    if (state == entity.end()) Refuse(where_, place, "has no " + std::string(name) + ".");
    if (state->is_null()) return std::nullopt;
    const auto find_or_note = [&](const std::string& id) {
      auto asset = find_asset_(id);
      if (asset) return asset;
      *complete = false;
      auto missing = std::make_shared<Asset>();
      missing->id = id;
      return std::shared_ptr<const Asset>(std::move(missing));
    };
    return EntityFromJson(where_, place + "." + name, *state, version_, find_or_note);
  }

  std::string_view where_;
  int version_;
  const AssetLookup& find_asset_;
};

}  // namespace

std::string EncodeHistory(const EditHistory& history, std::size_t max_bytes) {
  const std::string begin = "{\"docent_history\":" + std::to_string(kSceneVersion) + ",\"assets\":";
  const std::string frame = "[],\"done\":[],\"undone\":[]}";
  std::size_t budget = std::min(max_bytes, kMaxHistoryBytes);
  if (budget < begin.size() + frame.size()) return "";
  budget -= begin.size() + frame.size();
  // What can be redone is kept before the oldest that can be undone.
  const std::deque<EncodedChange> undone = NewestThatFit(history.undone(), &budget);
  if (undone.size() < history.undone().size()) budget = 0;
  const std::deque<EncodedChange> done = NewestThatFit(history.done(), &budget);
  if (done.empty() && undone.empty()) return "";
  std::set<std::string> assets;
  for (const auto* changes : {&done, &undone}) {
    for (const EncodedChange& change : *changes) assets.insert(change.assets.begin(), change.assets.end());
  }
  return begin + Json(assets).dump() + ",\"done\":" + Joined(done) + ",\"undone\":" + Joined(undone) + "}";
}

std::vector<std::string> HistoryAssetIds(std::string_view text) {
  if (text.empty()) return {};
  const ParsedHistory parsed = ParseHistory(text, "history");
  std::vector<std::string> ids;
  for (const Json& id : parsed.json["assets"]) {
    if (!id.is_string()) Refuse("history", "assets", "is not a list of strings.");
    ids.push_back(id.get<std::string>());
  }
  return ids;
}

EditHistory DecodeHistory(std::string_view text, std::string_view where, const AssetLookup& find_asset) {
  if (text.empty()) return {};
  const ParsedHistory parsed = ParseHistory(text, where);
  ChangeReader reader(where, parsed.version, find_asset);
  std::vector<SceneChange> done = reader.Read(parsed.json["done"], "done");
  return {std::move(done), reader.Read(parsed.json["undone"], "undone")};
}

}  // namespace docent::content
