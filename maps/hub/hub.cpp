// SPDX-License-Identifier: Apache-2.0
#include "maps/hub/hub.h"

#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "maps/hub/sha256.h"
#include "maps/library/library.h"
#include "maps/storage/tour_rows.h"

namespace docent::maps {

namespace {

using FactsJson = nlohmann::json;

[[noreturn]] void RefuseRow(const std::string& what) {
  throw Error("the hub sent " + what + "; the database is damaged or is not a hub of Docent");
}

std::uint64_t Count(const HubRows& rows, int column, std::uint64_t most) {
  const std::int64_t value = rows.Integer(0, column);
  if (value < 0 || static_cast<std::uint64_t>(value) > most) RefuseRow("a number that is out of range");
  return static_cast<std::uint64_t>(value);
}

std::string CheckedMapId(const std::string& id) {
  if (!IsMapId(id)) RefuseRow("a map without a valid id");
  return id;
}

std::string CheckedMapName(const std::string& name) {
  if (!ValidateMapName(name).empty()) RefuseRow("a map without a valid name");
  return name;
}

std::optional<Bounds> ParseBounds(const std::string& text) {
  const FactsJson json = FactsJson::parse(text, nullptr, false);
  if (!json.is_array() || json.size() != 6) RefuseRow("bounds that are not valid");
  Bounds bounds;
  for (std::size_t i = 0; i < 6; ++i) {
    if (!json[i].is_number()) RefuseRow("bounds that are not valid");
    (i < 3 ? bounds.min : bounds.max)[static_cast<Eigen::Index>(i % 3)] = json[i].get<double>();
  }
  if (!bounds.min.allFinite() || !bounds.max.allFinite() || (bounds.min.array() > bounds.max.array()).any())
    RefuseRow("bounds that are not valid");
  return bounds;
}

MapFacts ParseFacts(const HubRows& rows) {
  constexpr std::uint64_t kMost32 = std::numeric_limits<std::uint32_t>::max();
  constexpr std::uint64_t kMost = std::numeric_limits<std::int64_t>::max();
  MapFacts facts;
  facts.info.name = CheckedMapName(rows.Text(0, 0));
  const std::optional<Policy> policy = ParsePolicy(rows.Text(0, 1));
  if (!policy) RefuseRow("a policy that this version of Docent does not know");
  facts.info.policy = *policy;
  if (!rows.IsNull(0, 2)) facts.info.bounds = ParseBounds(rows.Text(0, 2));
  facts.info.created = WallTime(std::chrono::nanoseconds(rows.Integer(0, 3)));
  facts.info.modified = WallTime(std::chrono::nanoseconds(rows.Integer(0, 4)));
  facts.info.revision = Count(rows, 5, kMost);
  facts.info.next_keyframe = static_cast<std::uint32_t>(Count(rows, 6, kMost32));
  facts.info.next_point = static_cast<std::uint32_t>(Count(rows, 7, kMost32));
  facts.info.keyframes = Count(rows, 8, kMost32);
  facts.info.points = Count(rows, 9, kMost32);
  facts.info.observations = Count(rows, 10, kMost);
  const FactsJson names = FactsJson::parse(rows.Text(0, 11), nullptr, false);
  if (!names.is_object()) RefuseRow("names of assets that are not valid");
  for (const auto& [id, name] : names.items()) {
    if (!IsContentItem("asset/" + id) || !name.is_string()) RefuseRow("names of assets that are not valid");
    facts.asset_names[id] = name.get<std::string>();
  }
  return facts;
}

Manifest ParseManifest(const HubRows& rows) {
  Manifest manifest;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::string item = rows.Text(i, 0), hash = rows.Text(i, 1);
    if (!IsItem(item) || !IsHash(hash))
      RefuseRow("a part of a map that is unknown to this version of Docent");
    manifest[item] = hash;
  }
  for (const char* item :
       {"cameras", "keyframes", "points", "observations", "panoramas", "thumbnails", "words", "scene"}) {
    if (!manifest.contains(item)) RefuseRow("a map without its part '" + std::string(item) + "'");
  }
  return manifest;
}

// The revisions of maps or tours in an entry about a restoration.
std::map<std::string, std::int64_t> ParseRevisions(const FactsJson& restoration, const char* member) {
  const auto list = restoration.find(member);
  if (list == restoration.end() || !list->is_object()) RefuseRow("a restoration that is not valid");
  std::map<std::string, std::int64_t> revisions;
  for (const auto& [name, revision] : list->items()) {
    const std::int64_t number = revision.is_number_integer() ? revision.get<std::int64_t>() : 0;
    if (number < 1) RefuseRow("a restoration that is not valid");
    revisions[name] = number;
  }
  return revisions;
}

FactsJson ToJson(const MapFacts& facts) {
  const MapInfo& info = facts.info;
  FactsJson json = {{"name", info.name},
                    {"policy", ToString(info.policy)},
                    {"created_ns", info.created.time_since_epoch().count()},
                    {"modified_ns", info.modified.time_since_epoch().count()},
                    {"map_revision", info.revision},
                    {"next_keyframe", info.next_keyframe},
                    {"next_point", info.next_point},
                    {"keyframes", info.keyframes},
                    {"points", info.points},
                    {"observations", info.observations},
                    {"asset_names", FactsJson::object()}};
  for (const auto& [id, name] : facts.asset_names) json["asset_names"][id] = name;
  if (info.bounds) {
    json["bounds"] = FactsJson::array();
    for (const Eigen::Vector3d& corner : {info.bounds->min, info.bounds->max}) {
      for (int axis = 0; axis < 3; ++axis) json["bounds"].push_back(corner[axis]);
    }
  }
  return json;
}

// A text that is not UTF-8 would be refused by the server in words that help nobody.
std::string Dump(const FactsJson& json) {
  try {
    return json.dump();
  } catch (const FactsJson::exception&) {
    throw Error("a name in the map is not valid UTF-8, which a hub needs; rename it first");
  }
}

std::int64_t SaveMapIn(HubTransaction* work, const std::string& map, std::int64_t base, const MapFacts& facts,
                       const Manifest& manifest) {
  FactsJson items = FactsJson::object();
  for (const auto& [item, hash] : manifest) items[item] = hash;
  return work
      ->Query("SELECT docent.save_map($1::uuid, $2::bigint, $3::jsonb, $4::jsonb)",
              {map, std::to_string(base), Dump(ToJson(facts)), Dump(items)})
      .Integer(0, 0);
}

std::int64_t RemoveMapIn(HubTransaction* work, const std::string& map, std::int64_t base) {
  return work->Query("SELECT docent.remove_map($1::uuid, $2::bigint)", {map, std::to_string(base)})
      .Integer(0, 0);
}

}  // namespace

Hub::Hub(const std::string& url) : connection_(url) {
  connection_.Transact(HubAccess::kRead, [&](HubTransaction& work) {
    // Only a restored hub has the column `restorations`.
    const HubRows rows = work.Query(
        "SELECT id, version, coalesce(to_jsonb(h) #>> '{restorations,-1,id}', ''), "
        "pg_has_role('docent_curator', 'USAGE') FROM docent.hub h");
    if (rows.size() != 1) throw Error("this database contains no hub; create one with docent hub init");
    id_ = CheckedMapId(rows.Text(0, 0));
    const std::int64_t version = rows.Integer(0, 1);
    if (version > kHubVersion)
      throw Error("the hub was made by a newer Docent (version " + std::to_string(version) +
                  "; this program knows versions up to " + std::to_string(kHubVersion) + "); update Docent");
    if (version < kHubVersion)
      throw Error("the hub was made by an older Docent; an admin upgrades it with docent hub init");
    restoration_ = rows.Text(0, 2);
    if (!restoration_.empty() && !IsMapId(restoration_)) RefuseRow("a restoration that is not valid");
    may_save_ = rows.Truth(0, 3);
  });
}

std::vector<HubRestoration> Hub::Restorations() {
  std::vector<HubRestoration> restorations;
  connection_.Transact(HubAccess::kRead, [&](HubTransaction& work) {
    const HubRows rows =
        work.Query("SELECT coalesce(to_jsonb(h) -> 'restorations', '[]'::jsonb) FROM docent.hub h");
    const FactsJson list = FactsJson::parse(rows.Text(0, 0), nullptr, false);
    if (!list.is_array()) RefuseRow("a restoration that is not valid");
    for (const FactsJson& entry : list) {
      const auto id = entry.find("id");
      if (!entry.is_object() || id == entry.end() || !id->is_string() || !IsMapId(id->get<std::string>()))
        RefuseRow("a restoration that is not valid");
      restorations.push_back(
          {id->get<std::string>(), ParseRevisions(entry, "maps"), ParseRevisions(entry, "tours")});
    }
  });
  return restorations;
}

std::int64_t Hub::LastChange() {
  std::int64_t change = 0;
  connection_.Transact(HubAccess::kRead, [&](HubTransaction& work) {
    const HubRows rows = work.Query("SELECT last_change FROM docent.hub");
    change = static_cast<std::int64_t>(Count(rows, 0, std::numeric_limits<std::int64_t>::max()));
  });
  return change;
}

std::vector<HubHead> Hub::Heads(std::int64_t since) {
  std::vector<HubHead> heads;
  connection_.Transact(HubAccess::kRead, [&](HubTransaction& work) {
    const HubRows rows = work.Query(
        "SELECT id, revision, change, name, removed FROM docent.maps WHERE change > $1::bigint ORDER BY "
        "change",
        {std::to_string(since)});
    std::set<std::string> ids;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      HubHead head{CheckedMapId(rows.Text(i, 0)), rows.Integer(i, 1), rows.Integer(i, 2),
                   CheckedMapName(rows.Text(i, 3)), rows.Truth(i, 4)};
      if (head.revision < 1 || head.change < 1 || !ids.insert(head.id).second)
        RefuseRow("a list that is not valid");
      heads.push_back(std::move(head));
    }
  });
  return heads;
}

std::optional<HubRevision> Hub::Revision(const std::string& map, std::int64_t revision) {
  std::optional<HubRevision> found;
  connection_.Transact(HubAccess::kRead, [&](HubTransaction& work) {
    const HubRows rows = work.Query(
        "SELECT name, policy, to_jsonb(bounds), created_ns, modified_ns, map_revision, next_keyframe, "
        "next_point, "
        "keyframes, points, observations, asset_names, removed FROM docent.revisions "
        "WHERE map = $1::uuid AND revision = $2::bigint",
        {map, std::to_string(revision)});
    if (rows.size() == 0) return;
    found.emplace();
    found->revision = revision;
    found->removed = rows.Truth(0, 12);
    found->facts = ParseFacts(rows);
    found->manifest = ParseManifest(work.Query(
        "SELECT item, blob FROM docent.items WHERE map = $1::uuid AND revision = $2::bigint ORDER BY item",
        {map, std::to_string(revision)}));
  });
  return found;
}

Bytes Hub::Blob(const std::string& hash) {
  Bytes bytes;
  connection_.Transact(HubAccess::kRead, [&](HubTransaction& work) {
    const HubRows rows = work.Query("SELECT data FROM docent.blobs WHERE hash = $1", {hash});
    if (rows.size() != 1) throw HubConflict("the map was changed on the hub meanwhile");
    bytes = rows.Blob(0, 0);
  });
  if (HashOf(bytes) != hash) RefuseRow("bytes with another checksum than they should have");
  return bytes;
}

std::vector<std::string> Hub::Missing(const Manifest& manifest) {
  FactsJson hashes = FactsJson::array();
  for (const auto& [item, hash] : manifest) hashes.push_back(hash);
  std::vector<std::string> missing;
  connection_.Transact(HubAccess::kWrite, [&](HubTransaction& work) {
    const HubRows rows = work.Query("SELECT docent.missing_blobs($1::jsonb)", {hashes.dump()});
    for (std::size_t i = 0; i < rows.size(); ++i) missing.push_back(rows.Text(i, 0));
  });
  return missing;
}

void Hub::PutBlob(std::span<const std::uint8_t> bytes) {
  connection_.Transact(HubAccess::kWrite, [&](HubTransaction& work) {
    work.QueryWithBytes("SELECT docent.put_blob($1::bytea)", bytes);
  });
}

std::int64_t Hub::SaveMap(const std::string& map, std::int64_t base, const MapFacts& facts,
                          const Manifest& manifest) {
  std::int64_t revision = 0;
  connection_.Transact(HubAccess::kWrite, [&](HubTransaction& work) {
    revision = SaveMapIn(&work, map, base, facts, manifest);
  });
  return revision;
}

std::int64_t Hub::RemoveMap(const std::string& map, std::int64_t base) {
  std::int64_t revision = 0;
  connection_.Transact(HubAccess::kWrite,
                       [&](HubTransaction& work) { revision = RemoveMapIn(&work, map, base); });
  return revision;
}

std::int64_t Hub::ReplaceMap(const HubHead& old, const std::string& map, std::int64_t base,
                             const MapFacts& facts, const Manifest& manifest) {
  std::int64_t revision = 0;
  connection_.Transact(HubAccess::kWrite, [&](HubTransaction& work) {
    try {
      RemoveMapIn(&work, old.id, old.revision);
    } catch (const HubUnreachable&) {
      throw;
    } catch (const HubConflict&) {
      throw;
    } catch (const Error& error) {
      throw HubRemovalRefused(error.what());
    }
    revision = SaveMapIn(&work, map, base, facts, manifest);
  });
  return revision;
}

std::int64_t Hub::RevertMap(const std::string& map, std::int64_t base, std::int64_t to) {
  std::int64_t revision = 0;
  connection_.Transact(HubAccess::kWrite, [&](HubTransaction& work) {
    revision = work.Query("SELECT docent.revert_map($1::uuid, $2::bigint, $3::bigint)",
                          {map, std::to_string(base), std::to_string(to)})
                   .Integer(0, 0);
  });
  return revision;
}

std::vector<HubTour> Hub::Tours() {
  std::vector<HubTour> tours;
  connection_.Transact(HubAccess::kRead, [&](HubTransaction& work) {
    const HubRows rows = work.Query(
        "SELECT name, revision, language, minutes, to_jsonb(stops), removed FROM docent.tours ORDER BY name");
    for (std::size_t i = 0; i < rows.size(); ++i) {
      HubTour tour;
      tour.name = rows.Text(i, 0);
      tour.revision = rows.Integer(i, 1);
      tour.language = rows.Text(i, 2);
      // Tags mean the same in upper case, which a hub takes and a library does not.
      for (char& c : tour.language) {
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
      }
      const std::int64_t minutes = rows.Integer(i, 3);
      const FactsJson stops = FactsJson::parse(rows.Text(i, 4), nullptr, false);
      if (!stops.is_array() || stops.size() > kMaxTourStops || minutes < 0 || minutes > kMaxTourMinutes)
        RefuseRow("a tour that is not valid");
      tour.minutes = static_cast<int>(minutes);
      for (const FactsJson& stop : stops) {
        if (!stop.is_string()) RefuseRow("a tour that is not valid");
        tour.stops.push_back(CheckedMapId(stop.get<std::string>()));
      }
      tour.removed = rows.Truth(i, 5);
      // A hub takes longer languages than a library. PullTour refuses such a tour, and not all others too.
      if (!ProblemOf(Tour{tour.name, {}, tour.language.substr(0, kMaxTourLanguageBytes), tour.minutes})
               .empty())
        RefuseRow("a tour that is not valid");
      tours.push_back(std::move(tour));
    }
  });
  return tours;
}

void Hub::SaveTour(const HubTour& tour, std::int64_t base) {
  const FactsJson stops = tour.stops.empty() ? FactsJson::array() : FactsJson(tour.stops);
  connection_.Transact(HubAccess::kWrite, [&](HubTransaction& work) {
    work.Query("SELECT docent.save_tour($1, $2::bigint, $3, $4::integer, NULLIF($5, '')::jsonb)",
               {tour.name, std::to_string(base), tour.language, std::to_string(tour.minutes),
                tour.removed ? "" : stops.dump()});
  });
}

}  // namespace docent::maps
