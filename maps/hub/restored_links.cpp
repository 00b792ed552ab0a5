// SPDX-License-Identifier: Apache-2.0
#include "maps/hub/restored_links.h"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "maps/hub/sha256.h"

namespace docent::maps {

namespace {

using RevisionsOf = std::map<std::string, std::int64_t> HubRestoration::*;

// The newest revision of a map or tour, of those that the hub had after the restoration `since`, that it
// still has.
std::int64_t NewestKept(const std::vector<HubRestoration>& restorations, const std::string& since,
                        RevisionsOf revisions, const std::string& name) {
  auto later = restorations.begin();
  if (!since.empty()) {
    later = std::find_if(restorations.begin(), restorations.end(),
                         [&](const HubRestoration& restoration) { return restoration.id == since; });
    if (later == restorations.end()) return 0;  // The backup was made before that restoration.
    ++later;
  }
  std::int64_t newest = std::numeric_limits<std::int64_t>::max();
  for (; later != restorations.end(); ++later) {
    const auto& kept = (*later).*revisions;
    const auto found = kept.find(name);
    newest = std::min(newest, found == kept.end() ? 0 : found->second);
  }
  return newest;
}

// The revision that the hub had after the last restoration; 0 if it had none.
std::int64_t NotedLast(const std::vector<HubRestoration>& restorations, RevisionsOf revisions,
                       const std::string& name) {
  if (restorations.empty()) return 0;
  const auto& noted = restorations.back().*revisions;
  const auto found = noted.find(name);
  return found == noted.end() ? 0 : found->second;
}

// What of a link still holds.
enum class Holds { kAll, kOlderRevision, kRevisionOnly, kNothing };

// noted: see NotedLast.
Holds WhatHolds(std::int64_t revision, std::int64_t kept, std::int64_t on_hub, std::int64_t noted,
                bool may_save) {
  if (revision <= std::min(kept, on_hub)) return Holds::kAll;
  if (on_hub <= kept) return Holds::kOlderRevision;
  if (may_save) return Holds::kNothing;
  // A backup that was made before the restoration of the link says nothing of it. If nobody has saved since,
  // the hub's state is an older one.
  return on_hub > noted ? Holds::kRevisionOnly : Holds::kOlderRevision;
}

// No map has this state, so that it counts as changed.
void ForgetState(MapLink* link) {
  link->stamp.clear();
  link->scene.clear();
  link->structure = link->scene_hash = HashOf("");
}

}  // namespace

std::vector<std::uint64_t> ForgetLostRevisions(const std::vector<HubRestoration>& restorations,
                                               const std::vector<HubHead>& heads, bool may_save,
                                               std::vector<MapLink>* links) {
  std::vector<std::uint64_t> newer_here;
  for (MapLink& link : *links) {
    const auto head =
        std::find_if(heads.begin(), heads.end(), [&](const HubHead& other) { return other.id == link.id; });
    if (link.revision == 0 || head == heads.end()) continue;
    const std::int64_t kept = NewestKept(restorations, link.restoration, &HubRestoration::maps, link.id);
    const std::int64_t noted = NotedLast(restorations, &HubRestoration::maps, link.id);
    switch (WhatHolds(link.revision, kept, head->revision, noted, may_save)) {
      case Holds::kAll:
        break;
      case Holds::kOlderRevision:
        link.revision = head->revision;
        ForgetState(&link);
        newer_here.push_back(link.key);
        break;
      case Holds::kRevisionOnly:
        // If the backup lacked the map, any number that the hub's revision has not makes it newer than here.
        link.revision = kept > 0 ? kept : head->revision + 1;
        break;
      case Holds::kNothing:
        link.revision = 0;
        ForgetState(&link);
        break;
    }
  }
  return newer_here;
}

void ForgetLostRevisions(const std::vector<HubRestoration>& restorations, const std::vector<HubTour>& tours,
                         bool may_save, std::vector<TourLink>* links) {
  std::vector<TourLink> holding;
  for (TourLink& link : *links) {
    const auto tour = std::find_if(tours.begin(), tours.end(),
                                   [&](const HubTour& other) { return other.name == link.name; });
    if (tour == tours.end()) continue;
    const std::int64_t kept = NewestKept(restorations, link.restoration, &HubRestoration::tours, link.name);
    const std::int64_t noted = NotedLast(restorations, &HubRestoration::tours, link.name);
    const Holds holds = WhatHolds(link.revision, kept, tour->revision, noted, may_save);
    if (holds == Holds::kOlderRevision) {
      link.revision = tour->revision;
      link.content = "lost";  // No tour has this content, so that it counts as changed.
    } else if (holds == Holds::kRevisionOnly) {
      link.revision = kept;
    }
    if (holds != Holds::kNothing) holding.push_back(std::move(link));
  }
  *links = std::move(holding);
}

}  // namespace docent::maps
