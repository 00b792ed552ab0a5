// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "maps/hub/sha256.h"
#include "maps/hub/sync_session.h"
#include "maps/library/map_names.h"

namespace docent::maps {

namespace {

constexpr int kPushAttempts = 5;  // While others save the same map at the same time.

// Sends a map as the revision after `base` and remembers that both sides agree.
void SendAndLink(SyncSession* session, const LocalMap& map, const std::string& id, std::int64_t base,
                 const std::string& local_name) {
  const std::int64_t revision = session->Send(map, id, base);
  session->PutLink(AgreedLink(*session, id, revision, map, local_name));
}

// Whether a map of the hub was removed here and is to be removed there, where nobody has changed it since.
bool IsToBeRemoved(const SyncSession& session, const HubHead& head) {
  const MapLink* link = session.LinkTo(head.id);
  return session.options().remove && link != nullptr && link->revision > 0 &&
         link->revision == head.revision && session.local().StampOf(link->key).empty();
}

// Says that a map was removed from the hub, and forgets what both sides agreed on about it.
void ForgetRemoved(SyncSession* session, const HubHead& head) {
  session->RemoveLink(session->LinkTo(head.id)->key);
  session->Say(QuotedName(head.name) + " was removed from the hub");
}

void SayNotRemoved(SyncSession* session, const HubHead& head, const Error& error) {
  session->SayProblem(QuotedName(head.name) + " was not removed from the hub: " + error.what());
}

// Sends a map, as SendAndLink does, which gets the name of one that was removed here. The hub removes that in
// the same change, so that it stays if the hub refuses the new one. This comes last, when everything that may
// contain what was removed is on the hub. Returns false, and says why, if the hub keeps the other map.
bool SendInPlaceOf(SyncSession* session, const HubHead& taken, const LocalMap& map, const std::string& id,
                   std::int64_t base, const std::string& local_name) {
  if (session->report().problems > 0)
    throw Error(
        "the hub has a map of this name, which was removed here and stays there until every other "
        "change is saved");
  const HubHead old = taken;  // `taken` is one of the heads, which are read again below.
  session->SendItems(map);
  session->CheckStopped();
  std::int64_t revision = 0;
  try {
    revision = session->hub().ReplaceMap(old, id, base, map.facts, map.manifest);
  } catch (const HubRemovalRefused& error) {
    SayNotRemoved(session, old, error);
    return false;
  }
  session->PutLink(AgreedLink(*session, id, revision, map, local_name));
  ForgetRemoved(session, old);
  session->ReadHeads();
  return true;
}

// If the hub has an equal map under this name that is not in the library yet, it is the same one.
bool AdoptEqualMap(SyncSession* session, const LocalMap& mine, const HubHead& head,
                   const std::string& local_name) {
  const MapLink* link = session->LinkTo(head.id);
  if (link != nullptr && !session->local().StampOf(link->key).empty()) return false;
  const std::optional<HubRevision> theirs = session->hub().Revision(head.id, head.revision);
  if (!theirs ||
      StructureDigest(theirs->facts, theirs->manifest) != StructureDigest(mine.facts, mine.manifest) ||
      theirs->manifest.at("scene") != mine.manifest.at("scene"))
    return false;
  LinkEqual(session, head.id, *theirs, mine, local_name);
  session->Say(QuotedName(head.name) + " is the same map as on the hub");
  return true;
}

void AddToHub(SyncSession* session, const MapInfo& info, MapLink link, std::int64_t base) {
  LocalMap map = session->ReadLocal(info);
  const HubHead* taken = session->HeadNamed(map.facts.info.name);
  if (taken != nullptr && taken->id != link.id && IsToBeRemoved(*session, *taken)) {
    if (AdoptEqualMap(session, map, *taken, info.name)) return;
    // A crash after the hub has saved the map must not make a second one of it.
    link.local_name = info.name;
    session->PutLink(link);
    if (SendInPlaceOf(session, *taken, map, link.id, base, info.name)) {
      session->Say(QuotedName(map.facts.info.name) + " was added to the hub");
      return;
    }
  }
  if (taken != nullptr && taken->id != link.id) {
    if (AdoptEqualMap(session, map, *taken, info.name)) return;
    const std::string name = FreeName(info.name, session->NamesInUse());
    session->Say("The hub has another map named " + QuotedName(info.name) + ", so this one is now " +
                 QuotedName(name));
    map.facts.info.name = name;
    try {
      session->local().library().Rename(info.key, name);
      link.local_name = name;
    } catch (const Error&) {
      link.local_name = info.name;  // Its policy forbids another name here.
    }
    // The new name has changed its entry, and its signposts to itself.
    if (link.local_name == name) map = session->local().Read(info.key, session->ToHub());
  } else {
    link.local_name = info.name;
  }
  session->PutLink(link);  // Before the map is sent, as above.
  SendAndLink(session, map, link.id, base, link.local_name);
  session->Say(QuotedName(map.facts.info.name) + " was added to the hub");
}

// Saves the map, which only this side has changed.
void SaveChanges(SyncSession* session, const MapInfo& info, const MapLink& link, const HubHead& head) {
  LocalMap mine = session->ReadLocal(info);
  const std::optional<HubRevision> theirs = session->hub().Revision(link.id, head.revision);
  if (!theirs) throw HubConflict("the map was changed on the hub meanwhile");
  TakeEqualParts(*theirs, &mine);
  if (IsSame(mine, *theirs)) {
    session->PutLink(AgreedLink(*session, link.id, head.revision, mine, info.name));
    return;
  }
  std::int64_t base = head.revision;
  const HubHead* taken = session->HeadNamed(mine.facts.info.name);
  if (taken != nullptr && taken->id != link.id && IsToBeRemoved(*session, *taken)) {
    // What the other map was joined into is saved before that is removed, and gets its name afterwards.
    LocalMap unnamed = mine;
    unnamed.facts.info.name = theirs->facts.info.name;
    if (!IsSame(unnamed, *theirs)) {
      base = session->Send(unnamed, link.id, base);
      MapLink agreed = AgreedLink(*session, link.id, base, unnamed, link.local_name);
      agreed.stamp.clear();
      session->PutLink(agreed);
    }
    if (!SendInPlaceOf(session, *taken, mine, link.id, base, info.name)) return;
  } else {
    SendAndLink(session, mine, link.id, base, info.name);
  }
  session->Say(QuotedName(mine.facts.info.name) + " was saved on the hub as revision " +
               std::to_string(base + 1));
}

// Merges the map, which both sides have changed, and saves the result on both.
void MergeAndSave(SyncSession* session, const MapInfo& info, const MapLink& link, const HubHead& head) {
  const LocalMap mine = session->ReadLocal(info);
  const std::optional<HubRevision> theirs = session->hub().Revision(link.id, head.revision);
  if (!theirs) throw HubConflict("the map was changed on the hub meanwhile");
  if (IsSame(mine, *theirs)) {
    session->PutLink(AgreedLink(*session, link.id, head.revision, mine, info.name));
    return;
  }
  session->local().CheckNoSession();
  const ItemBytes scene = session->Receive({{"scene", theirs->manifest.at("scene")}}, mine);
  Resolution resolution = Resolve(link, mine, *theirs, SceneOf(scene), session->options().merge);
  if (resolution.needs_two_maps) {
    session->SendItems(mine);  // Almost all that AddToHub needs, while a session can still begin.
    const SessionLock lock = session->local().LockForReplacing();
    const MapLink split = SplitOff(session, link);
    AddToHub(session, session->local().library().Find(info.key), split, 0);
    return;
  }
  LocalMap& map = resolution.map;
  TakeEqualParts(*theirs, &map);
  const bool is_theirs = IsSame(map, *theirs);
  LocalMap complete = map;
  LocalMap sources = mine;
  sources.items["merged"] = map.items["scene"];
  sources.manifest["merged"] = HashOf(SceneOf(map.items));
  complete.items = session->Receive(map.manifest, sources);
  if (!is_theirs) session->SendItems(complete);
  // Before the hub saves what a session here would then undo, or what was merged before another change here.
  const SessionLock lock = session->local().LockForReplacing();
  session->local().CheckStamp(info.key, mine.state.stamp);
  const std::int64_t revision = is_theirs ? head.revision : session->Send(complete, link.id, head.revision);
  LocalMap local = complete;
  local.facts.info.name = info.name == link.local_name && map.facts.info.name == link.name
                              ? info.name
                              : LocalName(*session, map.facts.info.name, info.key);
  complete.state = session->local().Write(local, session->ToLocal(), mine.state.stamp);
  session->report().changed_keys.push_back(info.key);
  session->PutLink(AgreedLink(*session, link.id, revision, complete, local.facts.info.name));
  session->Say(QuotedName(map.facts.info.name) + " was changed here and on the hub; the changes were merged" +
               (is_theirs ? "" : " as revision " + std::to_string(revision)));
  for (const std::string& conflict : resolution.conflicts)
    session->Say(QuotedName(map.facts.info.name) + ": " + conflict);
  session->state().ForgetReceived();
}

void PushMap(SyncSession* session, const MapInfo& info) {
  const MapLink link = *session->LinkOf(info.key);
  const HubHead* head = session->HeadOf(link.id);
  if (head == nullptr || head->removed) {
    if (head != nullptr && link.stamp == session->local().StampOf(info.key)) {
      session->Say(QuotedName(info.name) + " was removed on the hub; docent maps pull removes it here");
    } else {
      AddToHub(session, info, link, head == nullptr ? 0 : head->revision);
      // The hub has an equal map whose policy is still to be taken.
      if (const MapLink linked = *session->LinkOf(info.key); linked.revision == 0) {
        if (const HubHead* equal = session->HeadOf(linked.id))
          MergeAndSave(session, session->local().library().Find(info.key), linked, *equal);
      }
    }
    return;
  }
  const bool is_changed_there = head->revision != link.revision;
  if (link.revision > 0 && (session->local().StampOf(info.key) == link.stamp ||
                            (is_changed_there && !IsChanged(link, session->ReadLocal(info))))) {
    if (is_changed_there)
      session->Say(QuotedName(info.name) + " is newer on the hub; docent maps pull brings it");
    return;
  }
  if (is_changed_there) {
    MergeAndSave(session, info, link, *head);
  } else {
    SaveChanges(session, info, link, *head);
  }
}

// Somebody else may save the map, here or there, while it is compared.
void PushWithPatience(SyncSession* session, std::uint64_t key) {
  std::string name;
  for (int attempt = 1;; ++attempt) {
    // A session may have removed it since the push began.
    if (session->local().StampOf(key).empty()) return;
    try {
      const MapInfo info = session->local().library().Find(key);
      name = info.name;
      PushMap(session, info);
      return;
    } catch (const HubUnreachable&) {
      throw;
    } catch (const HubConflict&) {
      if (attempt == kPushAttempts)
        throw Error(QuotedName(name) + " was changed on the hub during every attempt; try again later");
    } catch (const LocalChange&) {
      if (attempt == kPushAttempts) throw;
    } catch (const Error& error) {
      session->CheckStopped();
      session->SayProblem(QuotedName(name) + " was not saved on the hub: " + error.what());
      return;
    }
    session->ReadHeads();
  }
}

// before: the maps that the library had when the push began. One of them that is gone since may have been
// joined into one that was sent as it was before. may_remove: see PushTours.
void PushRemovals(SyncSession* session, const std::vector<MapInfo>& before, bool may_remove) {
  const std::vector<MapLink> links = session->links();
  for (const MapLink& link : links) {
    const HubHead* head = session->HeadOf(link.id);
    if (link.revision == 0 || head == nullptr || head->removed || !session->local().StampOf(link.key).empty())
      continue;
    if (std::any_of(before.begin(), before.end(), [&](const MapInfo& info) { return info.key == link.key; }))
      continue;
    const std::vector<std::string>& wanted = session->options().maps;
    if (!wanted.empty() && std::find(wanted.begin(), wanted.end(), head->name) == wanted.end()) continue;
    if (!session->options().remove) {
      session->Say(QuotedName(head->name) +
                   " was removed here and is still on the hub; with --removed it is removed there too");
    } else if (!may_remove) {
      session->SayProblem(QuotedName(head->name) +
                          " was removed here and stays on the hub until every change is saved there");
    } else if (head->revision != link.revision) {
      session->SayProblem(QuotedName(head->name) +
                          " was removed here and changed on the hub, where it stays");
    } else {
      try {
        session->hub().RemoveMap(head->id, head->revision);
        ForgetRemoved(session, *head);
      } catch (const HubUnreachable&) {
        throw;
      } catch (const Error& error) {
        SayNotRemoved(session, *head, error);
      }
    }
  }
}

}  // namespace

SyncReport Push(const SyncOptions& options) {
  SyncSession session(options, CreateIfMissing::kNo);
  const std::vector<MapInfo> infos = session.local().library().List();
  std::vector<std::uint64_t> keys;
  // Signposts lead to maps by their ids, so that each map has one before the first is sent.
  for (const MapInfo& info : infos) {
    if (session.LinkOf(info.key) == nullptr) {
      MapLink link;
      link.key = info.key;
      link.id = NewMapId();
      link.local_name = info.name;
      session.PutLink(link);
    }
    if (options.maps.empty() ||
        std::find(options.maps.begin(), options.maps.end(), info.name) != options.maps.end())
      keys.push_back(info.key);
  }
  if (!options.remove) {
    for (const std::string& name : options.maps) session.local().library().FindByName(name);
  }
  std::stable_partition(keys.begin(), keys.end(), [&](std::uint64_t key) {
    const auto info = std::find_if(infos.begin(), infos.end(),
                                   [&](const MapInfo& candidate) { return candidate.key == key; });
    const HubHead* head = session.HeadNamed(info->name);
    return head == nullptr || !IsToBeRemoved(session, *head);
  });
  for (const std::uint64_t key : keys) PushWithPatience(&session, key);
  // A map that was not saved may hold what was joined into it from one that was removed here.
  const bool all_saved = session.report().problems == 0;
  PushRemovals(&session, infos, all_saved);
  if (options.maps.empty()) PushTours(&session, all_saved);
  return session.report();
}

}  // namespace docent::maps
