// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "maps/hub/pull_order.h"
#include "maps/hub/sha256.h"
#include "maps/hub/sync_session.h"

namespace docent::maps {

namespace {

constexpr int kPullAttempts = 5;  // While others save the same map at the same time.

// Writes a revision of the hub into the library, where `mine` is the map as it is, and links both.
void WriteTheirs(SyncSession* session, const MapLink& link, const HubRevision& theirs, const LocalMap& mine,
                 const std::string& stamp) {
  // No session can have a new map in memory.
  const bool is_new = stamp.empty();
  if (!is_new) session->local().CheckNoSession();
  LocalMap map;
  map.facts = theirs.facts;
  map.manifest = theirs.manifest;
  map.items = session->Receive(theirs.manifest, mine);
  std::optional<SessionLock> lock;
  if (!is_new) lock.emplace(session->options().library, SessionLockKind::kReplace);
  map.facts.info.key = link.key;
  LocalMap local = map;
  local.facts.info.name = LocalName(*session, theirs.facts.info.name, link.key);
  map.state = session->local().Write(local, session->ToLocal(), stamp);
  session->report().changed_keys.push_back(link.key);
  session->PutLink(AgreedLink(*session, link.id, theirs.revision, map, local.facts.info.name));
  session->state().ForgetReceived();
}

// If an equal map is in the library without a link, it is the same one.
bool LinkEqualMap(SyncSession* session, const MapLink& link, const HubRevision& theirs) {
  for (const MapInfo& info : session->local().library().List()) {
    if (info.name != theirs.facts.info.name || session->LinkOf(info.key) != nullptr) continue;
    const LocalMap mine = session->ReadLocal(info);
    if (StructureDigest(mine.facts, mine.manifest) != StructureDigest(theirs.facts, theirs.manifest) ||
        mine.manifest.at("scene") != theirs.manifest.at("scene"))
      return false;
    session->RemoveLink(link.key);
    LinkEqual(session, link.id, theirs, mine, info.name);
    return true;
  }
  return false;
}

// Merges what both sides have changed into the library; the next push saves it on the hub.
void MergeHere(SyncSession* session, const MapInfo& info, const MapLink& link, const HubRevision& theirs,
               const LocalMap& mine) {
  session->local().CheckNoSession();
  const std::string their_scene = SceneOf(session->Receive({{"scene", theirs.manifest.at("scene")}}, mine));
  Resolution resolution = Resolve(link, mine, theirs, their_scene, session->options().merge);
  if (resolution.needs_two_maps) {
    MapLink fresh;
    {
      const SessionLock lock = session->local().LockForReplacing();
      SplitOff(session, link);
      fresh.key = session->local().library().NewKey();
      fresh.id = link.id;
      session->PutLink(fresh);
    }
    WriteTheirs(session, fresh, theirs, mine, "");
    return;
  }
  LocalMap sources = mine;
  sources.items["merged"] = resolution.map.items["scene"];
  sources.manifest["merged"] = HashOf(SceneOf(resolution.map.items));
  LocalMap map = resolution.map;
  map.items = session->Receive(map.manifest, sources);
  const SessionLock lock = session->local().LockForReplacing();
  LocalMap local = map;
  local.facts.info.name = LocalName(*session, map.facts.info.name, info.key);
  map.state = session->local().Write(local, session->ToLocal(), mine.state.stamp);
  session->report().changed_keys.push_back(info.key);
  // Both agree on what the hub has; what was changed here since is still to be pushed.
  MapLink agreed = AgreedLink(*session, link.id, theirs.revision, map, local.facts.info.name);
  agreed.stamp.clear();
  agreed.structure = StructureDigest(theirs.facts, theirs.manifest);
  agreed.scene = their_scene;
  agreed.scene_hash = HashOf("");
  agreed.name = theirs.facts.info.name;
  // A map that was renamed here is not named as on the hub until that is pushed.
  if (map.facts.info.name != agreed.name)
    agreed.local_name = link.local_name.empty() ? agreed.name : link.local_name;
  agreed.policy = ToString(theirs.facts.info.policy);
  session->PutLink(agreed);
  session->Say(QuotedName(info.name) +
               " was changed here and on the hub; the changes were merged here, and docent maps push "
               "saves them on the hub");
  for (const std::string& conflict : resolution.conflicts)
    session->Say(QuotedName(info.name) + ": " + conflict);
  session->state().ForgetReceived();
}

void PullRemoval(SyncSession* session, const MapLink& link, const std::string& stamp) {
  if (!stamp.empty() && stamp == link.stamp) {
    const SessionLock lock = session->local().LockForReplacing();
    session->local().Remove(link.key, stamp);
    session->report().changed_keys.push_back(link.key);
    session->Say(QuotedName(link.local_name) + " was removed on the hub, and so here");
    session->RemoveLink(link.key);
  } else if (!stamp.empty()) {
    session->Say(QuotedName(link.local_name) +
                 " was removed on the hub and changed here, where it stays; docent maps push adds it to the "
                 "hub again");
  } else {
    session->RemoveLink(link.key);
  }
}

void PullMap(SyncSession* session, const HubHead& head) {
  const MapLink link = *session->LinkTo(head.id);
  const std::string stamp = session->local().StampOf(link.key);
  if (head.removed) return PullRemoval(session, link, stamp);
  const bool is_known = link.revision == head.revision;
  // What was removed here stays so unless it was changed there.
  if (is_known && (!stamp.empty() || session->options().maps.empty())) return;
  const std::optional<HubRevision> theirs = session->hub().Revision(head.id, head.revision);
  if (!theirs) throw HubConflict("the map was changed on the hub meanwhile");
  if (stamp.empty()) {
    if (link.revision == 0 && LinkEqualMap(session, link, *theirs)) {
      if (session->LinkTo(head.id)->revision == 0) PullMap(session, head);
      return;
    }
    WriteTheirs(session, link, *theirs, {}, "");
    session->Say(QuotedName(head.name) + " was added");
    return;
  }
  const MapInfo info = session->local().library().Find(link.key);
  const LocalMap mine = session->ReadLocal(info);
  if (IsSame(mine, *theirs)) {
    session->PutLink(AgreedLink(*session, link.id, theirs->revision, mine, info.name));
  } else if (link.revision > 0 && (mine.state.stamp == link.stamp || !IsChanged(link, mine))) {
    WriteTheirs(session, link, *theirs, mine, mine.state.stamp);
    session->Say(QuotedName(head.name) + " was updated to revision " + std::to_string(head.revision));
  } else {
    MergeHere(session, info, link, *theirs, mine);
  }
}

// Somebody else may save the map, here or there, while it is compared.
void PullWithPatience(SyncSession* session, const std::string& id) {
  for (int attempt = 1;; ++attempt) {
    const HubHead* const found = session->HeadOf(id);
    if (found == nullptr) return;
    const HubHead head = *found;
    try {
      PullMap(session, head);
      return;
    } catch (const HubUnreachable&) {
      throw;
    } catch (const HubConflict& error) {
      if (attempt == kPullAttempts)
        session->SayProblem(QuotedName(head.name) + " was not updated: " + error.what());
    } catch (const LocalChange& error) {
      if (attempt == kPullAttempts)
        session->SayProblem(QuotedName(head.name) + " was not updated: " + error.what());
    } catch (const LibraryInSession& error) {
      session->SayProblem(QuotedName(head.name) + " was not updated: " + error.what());
      ++session->report().waiting;
      return;
    } catch (const Error& error) {
      session->CheckStopped();
      session->SayProblem(QuotedName(head.name) + " was not updated: " + error.what());
      return;
    }
    if (attempt == kPullAttempts) return;
    session->ReadHeads();
  }
}

// Gives each map of the hub a key here, so that signposts can lead to maps that come later.
void ReserveKeysForMaps(SyncSession* session) {
  std::vector<std::string> ids;
  bool has_new = false;
  for (const HubHead& head : session->heads()) {
    ids.push_back(head.id);
    has_new = has_new || session->LinkTo(head.id) == nullptr;
  }
  if (has_new) session->AddLinks(ids);
}

// The maps that the visitor is in, by their ids on the hub.
std::vector<std::string> MapsNearVisitor(const SyncSession& session) {
  const SyncOptions& options = session.options();
  if (const std::uint64_t key = options.near_key ? options.near_key() : 0; key != 0) {
    if (const MapLink* link = session.LinkOf(key)) return {link->id};
  }
  const HubHead* head = options.near.empty() ? nullptr : session.HeadNamed(options.near);
  return head == nullptr ? std::vector<std::string>() : std::vector<std::string>{head->id};
}

// The ways of the tours on the hub and of the signposts here.
WaysBetweenMaps WaysIn(SyncSession* session) {
  WaysBetweenMaps ways = WaysOfTours(session->hub().Tours());
  for (const Library::Signpost& signpost : session->local().library().Signposts()) {
    const MapLink *from = session->LinkOf(signpost.map.key), *to = session->LinkOf(signpost.to_key);
    if (from != nullptr && to != nullptr) ways.emplace_back(from->id, to->id);
  }
  return ways;
}

// Pulls the maps, always the nearest one next.
void PullNearestFirst(SyncSession* session, std::vector<HubHead> heads) {
  const SyncOptions& options = session->options();
  const auto changed = std::count_if(heads.begin(), heads.end(), [&](const HubHead& head) {
    return session->LinkTo(head.id)->revision != head.revision;
  });
  const bool has_place = changed > 1 && (!options.near.empty() || options.near_key);
  std::vector<std::string> from;
  for (std::size_t next = 0; next < heads.size(); ++next) {
    const std::vector<std::string> now = has_place ? MapsNearVisitor(*session) : std::vector<std::string>();
    if (now != from) {
      from = now;
      const auto rest = heads.begin() + static_cast<std::ptrdiff_t>(next);
      std::vector<HubHead> ordered = NearestFirst({rest, heads.end()}, from, WaysIn(session));
      std::copy(ordered.begin(), ordered.end(), rest);
    }
    PullWithPatience(session, heads[next].id);
  }
}

void PullAll(SyncSession* session) {
  const SyncOptions& options = session->options();
  for (const std::string& name : options.maps) {
    if (session->HeadNamed(name) == nullptr) throw Error("the hub has no map named '" + name + "'");
  }
  ReserveKeysForMaps(session);
  if (!options.near.empty() && session->HeadNamed(options.near) == nullptr)
    throw Error("the hub has no map named '" + options.near + "'");
  std::vector<HubHead> heads = session->heads();
  std::erase_if(heads, [&](const HubHead& head) {
    return !options.maps.empty() && (head.removed || std::find(options.maps.begin(), options.maps.end(),
                                                               head.name) == options.maps.end());
  });
  PullNearestFirst(session, std::move(heads));
  if (options.maps.empty()) PullTours(session);
}

}  // namespace

SyncReport Pull(const SyncOptions& options) {
  SyncReport report;
  Pull(options, &report);
  return report;
}

void Pull(const SyncOptions& options, SyncReport* report) {
  SyncSession session(options, CreateIfMissing::kYes);
  try {
    PullAll(&session);
  } catch (...) {
    *report = session.report();
    throw;
  }
  *report = session.report();
}

}  // namespace docent::maps
