// SPDX-License-Identifier: Apache-2.0
#include "maps/hub/sync_session.h"

#include <algorithm>
#include <map>
#include <thread>
#include <utility>

#include "maps/hub/restored_links.h"
#include "maps/hub/sha256.h"
#include "maps/library/map_names.h"

namespace docent::maps {

namespace {

constexpr std::chrono::milliseconds kLongestWait(100);  // Until somebody who wants to stop is noticed.

template <typename Items, typename Matches>
auto FindIn(Items& items, const Matches& matches) {
  const auto found = std::find_if(items.begin(), items.end(), matches);
  return found == items.end() ? nullptr : &*found;
}

}  // namespace

void RateLimit::Spend(std::size_t bytes, const std::function<bool()>& is_stopped) {
  if (bytes_per_second_ <= 0) return;
  const auto now = std::chrono::steady_clock::now();
  const std::chrono::duration<double> taken(static_cast<double>(bytes) /
                                            static_cast<double>(bytes_per_second_));
  next_ = std::max(now, next_.value_or(now)) +
          std::chrono::duration_cast<std::chrono::steady_clock::duration>(taken);
  while (std::chrono::steady_clock::now() < *next_ && !(is_stopped && is_stopped()))
    std::this_thread::sleep_for(
        std::min<std::chrono::nanoseconds>(kLongestWait, *next_ - std::chrono::steady_clock::now()));
}

SyncSession::SyncSession(const SyncOptions& options, CreateIfMissing create)
    : options_(options),
      hub_(options.hub),
      local_(options.library, create, options.scenes),
      state_(options.library, hub_.id()),
      limit_(options.bytes_per_second),
      heads_(hub_.Heads()),
      links_(state_.Links()) {
  CheckLinksAreOfThisLibrary();
  if (!hub_.restoration().empty()) restorations_ = hub_.Restorations();
  for (const std::uint64_t key : ForgetLostRevisions(restorations_, heads_, hub_.may_save(), &links_)) {
    if (!local_.StampOf(key).empty())
      Say(QuotedName(LinkOf(key)->local_name) +
          " is newer here than on the hub, which was restored from a backup");
  }
}

void SyncSession::CheckLinksAreOfThisLibrary() {
  const std::string library = state_.LibraryIdentity();
  const std::uint64_t next_key = local_.NextKey();
  const bool has_unknown_key =
      std::any_of(links_.begin(), links_.end(), [&](const MapLink& link) { return link.key >= next_key; });
  const LibraryIdentity& identity = local_.identity();
  const bool is_of_this_library = library.empty()
                                      ? AreMapsAsOldAsLinksSay()
                                      : library == identity.current || library == identity.previous;
  if (!has_unknown_key && is_of_this_library) {
    if (library.empty()) state_.SetLibraryIdentity(identity.current);
    return;
  }
  state_.StartAnew(identity.current);
  if (links_.empty()) return;
  links_.clear();
  Say(QuotedName(SyncStatePath(options_.library).string()) +
      " was written for another library of this name, or for a newer state of it, so that library and hub "
      "are "
      "compared anew");
}

bool SyncSession::AreMapsAsOldAsLinksSay() const {
  const std::vector<MapInfo> maps = local_.library().List();
  return std::all_of(maps.begin(), maps.end(), [&](const MapInfo& info) {
    const MapLink* link = LinkOf(info.key);
    return link == nullptr || link->created == 0 || link->created == info.created.time_since_epoch().count();
  });
}

void SyncSession::ReadHeads() {
  heads_ = hub_.Heads();
  ForgetLostRevisions(restorations_, heads_, hub_.may_save(), &links_);
}

const HubHead* SyncSession::HeadOf(const std::string& id) const {
  return FindIn(heads_, [&](const HubHead& head) { return head.id == id; });
}

const HubHead* SyncSession::HeadNamed(const std::string& name) const {
  return FindIn(heads_, [&](const HubHead& head) { return head.name == name && !head.removed; });
}

const MapLink* SyncSession::LinkOf(std::uint64_t key) const {
  return FindIn(links_, [&](const MapLink& link) { return link.key == key; });
}

const MapLink* SyncSession::LinkTo(const std::string& id) const {
  return FindIn(links_, [&](const MapLink& link) { return link.id == id; });
}

void SyncSession::RenewIdentity() {
  if (std::exchange(has_new_identity_, true)) return;
  state_.RenewLibraryIdentity([this] { return local_.RenewIdentity(); });
}

void SyncSession::PutLink(const MapLink& link) {
  RenewIdentity();
  state_.Put(link);
  std::erase_if(links_, [&](const MapLink& old) { return old.key == link.key || old.id == link.id; });
  links_.push_back(link);
}

void SyncSession::AddLinks(const std::vector<std::string>& ids) {
  RenewIdentity();
  links_ = state_.AddLinks(ids, [this](std::size_t count) { return local_.library().ReserveKeys(count); });
  ForgetLostRevisions(restorations_, heads_, hub_.may_save(), &links_);
}

void SyncSession::RemoveLink(std::uint64_t key) {
  RenewIdentity();
  state_.RemoveLink(key);
  std::erase_if(links_, [&](const MapLink& old) { return old.key == key; });
}

void SyncSession::PutTour(const TourLink& tour) {
  RenewIdentity();
  state_.Put(tour);
}

void SyncSession::RemoveTour(const std::string& name) {
  RenewIdentity();
  state_.RemoveTour(name);
}

Retarget SyncSession::ToHub() const {
  std::map<std::uint64_t, std::uint64_t> numbers;
  for (const MapLink& link : links_) numbers[link.key] = NumberOf(link.id);
  return [numbers](const std::string&, const SignpostTarget& target) -> std::optional<SignpostTarget> {
    if (target.key == 0) return std::nullopt;
    const auto found = numbers.find(target.key);
    // What leads to a map that does not exist any more keeps its name.
    return SignpostTarget{found == numbers.end() ? 0 : found->second, target.map};
  };
}

Retarget SyncSession::ToLocal() const {
  std::map<std::uint64_t, std::uint64_t> keys;
  for (const MapLink& link : links_) keys[NumberOf(link.id)] = link.key;
  return [keys](const std::string&, const SignpostTarget& target) -> std::optional<SignpostTarget> {
    if (target.key == 0) return std::nullopt;
    const auto found = keys.find(target.key);
    return SignpostTarget{found == keys.end() ? 0 : found->second, target.map};
  };
}

LocalMap SyncSession::ReadLocal(const MapInfo& info) const {
  LocalMap map = local_.Read(info.key, ToHub());
  const MapLink* link = LinkOf(info.key);
  if (link != nullptr && link->revision > 0 && map.facts.info.name == link->local_name)
    map.facts.info.name = link->name;
  return map;
}

void SyncSession::CheckStopped() const {
  if (options_.is_stopped && options_.is_stopped())
    throw Error("Interrupted; what was transferred stays, and the same command continues.");
}

void SyncSession::SendItems(const LocalMap& map) {
  const std::vector<std::string> list = hub_.Missing(map.manifest);
  std::set<std::string> missing(list.begin(), list.end());
  for (const auto& [item, bytes] : map.items) {
    const auto hash = map.manifest.find(item);
    if (hash == map.manifest.end() || missing.erase(hash->second) == 0) continue;
    CheckStopped();
    hub_.PutBlob(bytes);
    report_.bytes_sent += bytes.size();
    limit_.Spend(bytes.size(), options_.is_stopped);
  }
}

std::int64_t SyncSession::Send(const LocalMap& map, const std::string& id, std::int64_t base) {
  SendItems(map);
  CheckStopped();
  return hub_.SaveMap(id, base, map.facts, map.manifest);
}

ItemBytes SyncSession::Receive(const Manifest& manifest, const LocalMap& at_hand) {
  std::map<std::string, const Bytes*> known;
  for (const auto& [item, hash] : at_hand.manifest) {
    if (const auto found = at_hand.items.find(item); found != at_hand.items.end())
      known[hash] = &found->second;
  }
  ItemBytes items;
  for (const auto& [item, hash] : manifest) {
    if (const auto found = known.find(hash); found != known.end()) {
      items[item] = *found->second;
      continue;
    }
    std::optional<Bytes> bytes = state_.Received(hash);
    if (!bytes) {
      CheckStopped();
      bytes = hub_.Blob(hash);
      state_.KeepReceived(hash, *bytes);
      report_.bytes_received += bytes->size();
      limit_.Spend(bytes->size(), options_.is_stopped);
    }
    items[item] = std::move(*bytes);
  }
  return items;
}

void SyncSession::SayProblem(const std::string& sentence) {
  ++report_.problems;
  Say(sentence);
}

std::set<std::string> SyncSession::NamesInUse() const {
  std::set<std::string> names;
  for (const HubHead& head : heads_) {
    if (!head.removed) names.insert(head.name);
  }
  for (const MapInfo& info : local_.library().List()) names.insert(info.name);
  return names;
}

MapLink AgreedLink(const SyncSession& session, const std::string& id, std::int64_t revision,
                   const LocalMap& map, const std::string& local_name) {
  const std::uint64_t key = map.facts.info.key;
  return {key,
          id,
          revision,
          map.state.stamp,
          StructureDigest(map.facts, map.manifest),
          map.state.scene_hash,
          SceneOf(map.items),
          map.facts.info.name,
          local_name,
          ToString(map.facts.info.policy),
          map.facts.info.created.time_since_epoch().count(),
          session.hub().restoration()};
}

bool IsChanged(const MapLink& link, const LocalMap& map) {
  return link.structure != StructureDigest(map.facts, map.manifest) || link.name != map.facts.info.name ||
         link.policy != ToString(map.facts.info.policy) ||
         (link.scene_hash != map.state.scene_hash && link.scene != SceneOf(map.items));
}

void TakeEqualParts(const HubRevision& theirs, LocalMap* mine) {
  for (const auto& [id, name] : theirs.facts.asset_names) {
    if (mine->facts.asset_names.contains(id)) mine->facts.asset_names[id] = name;
  }
  if (StructureDigest(theirs.facts, theirs.manifest) != StructureDigest(mine->facts, mine->manifest)) return;
  mine->facts.info.revision = theirs.facts.info.revision;
  for (const char* item : {"thumbnails", "words"}) mine->manifest[item] = theirs.manifest.at(item);
  const auto mesh = theirs.manifest.find("mesh");
  if (mesh != theirs.manifest.end() &&
      (!mine->manifest.contains("mesh") || theirs.facts.info.policy == Policy::kReadOnly))
    mine->manifest["mesh"] = mesh->second;
  if (mesh == theirs.manifest.end() && theirs.facts.info.policy == Policy::kReadOnly)
    mine->manifest.erase("mesh");
}

bool IsSame(const LocalMap& mine, const HubRevision& theirs) {
  const MapInfo& a = mine.facts.info;
  const MapInfo& b = theirs.facts.info;
  return mine.manifest == theirs.manifest && a.name == b.name && a.policy == b.policy && a.bounds == b.bounds;
}

std::string LocalName(const SyncSession& session, const std::string& name, std::uint64_t key) {
  std::set<std::string> taken;
  for (const MapInfo& info : session.local().library().List()) {
    if (info.key != key) taken.insert(info.name);
  }
  return FreeName(name, taken);
}

void LinkEqual(SyncSession* session, const std::string& id, const HubRevision& theirs, const LocalMap& mine,
               const std::string& local_name) {
  MapLink link;
  link.key = mine.facts.info.key;
  link.id = id;
  link.local_name = local_name;
  if (mine.facts.info.policy == theirs.facts.info.policy &&
      mine.facts.info.bounds == theirs.facts.info.bounds)
    link = AgreedLink(*session, id, theirs.revision, mine, local_name);
  session->PutLink(link);
}

MapLink SplitOff(SyncSession* session, const MapLink& link) {
  const std::string name = session->local().library().Find(link.key).name;
  const std::string other = FreeName(link.local_name.empty() ? name : link.name, session->NamesInUse());
  MapLink split;
  split.key = link.key;
  split.id = NewMapId();
  split.local_name = other;
  session->RemoveLink(link.key);
  session->PutLink(split);
  try {
    session->local().library().Rename(link.key, other);
  } catch (const Error&) {
    split.local_name =
        name;  // Its policy forbids another name here; the hub still has it under the other one.
    session->PutLink(split);
  }
  session->Say(
      "'" + name +
      "': its keyframes and points were changed both here and on the hub, so both versions are kept; "
      "'" +
      name + "' is the hub's, and '" + other + "' the one from here.");
  return split;
}

}  // namespace docent::maps
