// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "maps/hub/hub.h"
#include "maps/hub/local_library.h"
#include "maps/hub/sync.h"
#include "maps/hub/sync_merge.h"
#include "maps/hub/sync_state.h"

namespace docent::maps {

// Delays a transfer so that it stays below a rate on average.
class RateLimit {
 public:
  // 0 bytes per second: no limit.
  explicit RateLimit(std::int64_t bytes_per_second) : bytes_per_second_(bytes_per_second) {}
  // Counts bytes that were transferred, and waits as long as they should have taken, or until `is_stopped`.
  void Spend(std::size_t bytes, const std::function<bool()>& is_stopped);

 private:
  std::int64_t bytes_per_second_;
  std::optional<std::chrono::steady_clock::time_point> next_;
};

// What pushing and pulling have in common: both sides, what they last agreed on, and the transfer. One
// thread.
class SyncSession {
 public:
  SyncSession(const SyncOptions& options, CreateIfMissing create);

  Hub& hub() { return hub_; }
  const Hub& hub() const { return hub_; }
  // Those of the hub, the first one first.
  const std::vector<HubRestoration>& restorations() const { return restorations_; }
  LocalLibrary& local() { return local_; }
  const LocalLibrary& local() const { return local_; }
  SyncState& state() { return state_; }
  const SyncOptions& options() const { return options_; }
  SyncReport& report() { return report_; }

  // Asks the hub for its list of maps again.
  void ReadHeads();
  const std::vector<HubHead>& heads() const { return heads_; }
  const HubHead* HeadOf(const std::string& id) const;       // Null if there is none.
  const HubHead* HeadNamed(const std::string& name) const;  // Of those that were not removed.
  // The link of a map in the library, or of one on the hub; null if there is none.
  const MapLink* LinkOf(std::uint64_t key) const;
  const MapLink* LinkTo(const std::string& id) const;
  void PutLink(const MapLink& link);
  // Gives those of these maps of the hub that have no link a key here. Other programs may have changed links
  // meanwhile, which this reads again.
  void AddLinks(const std::vector<std::string>& ids);
  void RemoveLink(std::uint64_t key);
  const std::vector<MapLink>& links() const { return links_; }
  void PutTour(const TourLink& tour);
  void RemoveTour(const std::string& name);

  // Where the signposts of a map lead, from here to the hub and back.
  Retarget ToHub() const;
  Retarget ToLocal() const;
  // The map as it is in the library, under its name on the hub.
  LocalMap ReadLocal(const MapInfo& info) const;

  // Sends the items that the hub lacks.
  void SendItems(const LocalMap& map);
  // The same, and saves the map after the revision `base`.
  std::int64_t Send(const LocalMap& map, const std::string& id, std::int64_t base);
  // All items of a manifest: those that are at hand are taken from there, the others are received.
  ItemBytes Receive(const Manifest& manifest, const LocalMap& at_hand);

  void Say(const std::string& sentence) { report_.lines.push_back(sentence); }
  // The same for something that could not be done.
  void SayProblem(const std::string& sentence);
  // Throws if the transfer is to end.
  void CheckStopped() const;
  // The names of maps that are used here or on the hub.
  std::set<std::string> NamesInUse() const;

 private:
  // Before the first change of a link, so that an older copy of the library is recognized later.
  void RenewIdentity();
  // Removes the links if they were made for another library that had this name, or for a newer state of this
  // one.
  void CheckLinksAreOfThisLibrary();
  // Whether the maps here were created when the links say, as far as these say it. Only where the links do
  // not name their library: a map that is taken from the hub takes the time of the device that created it
  // there, and its link follows later.
  bool AreMapsAsOldAsLinksSay() const;

  SyncOptions options_;
  Hub hub_;
  LocalLibrary local_;
  SyncState state_;
  RateLimit limit_;
  SyncReport report_;
  std::vector<HubRestoration> restorations_;
  std::vector<HubHead> heads_;
  std::vector<MapLink> links_;  // As stored, but for what the hub has lost (restored_links.h).
  bool has_new_identity_ = false;
};

// The name as sentences have it.
inline std::string QuotedName(const std::string& name) {
  return "'" + name + "'";
}
// The link of a map that is now equal on both sides. `map` has the name on the hub, and its state is that of
// what was sent or written, and not of what somebody else may have made of it since.
MapLink AgreedLink(const SyncSession& session, const std::string& id, std::int64_t revision,
                   const LocalMap& map, const std::string& local_name);
// Whether a map, as it was read, differs from what both sides last agreed on.
bool IsChanged(const MapLink& link, const LocalMap& map);
// Takes from a revision of the hub what need not differ from it: what is computed from an equal structure,
// and the names of files.
void TakeEqualParts(const HubRevision& theirs, LocalMap* mine);
// Whether a map is this revision.
bool IsSame(const LocalMap& mine, const HubRevision& theirs);
// A name for the map with this key that no other map of the library has.
std::string LocalName(const SyncSession& session, const std::string& name, std::uint64_t key);
// Links a map of the library with an equal one of the hub. Policy and bounds may differ; then the link has
// the revision 0, as if both sides had nothing in common, and the hub's are still to be taken.
void LinkEqual(SyncSession* session, const std::string& id, const HubRevision& theirs, const LocalMap& mine,
               const std::string& local_name);
// Gives the map in the library another id and name, because its structure was changed on both sides. Returns
// its link.
MapLink SplitOff(SyncSession* session, const MapLink& link);

// The tours of both sides, after the maps. If not `may_remove`, because a map could not be saved on the hub,
// nothing is removed there, and no tour loses a stop at a map that therefore stays.
void PushTours(SyncSession* session, bool may_remove);
void PullTours(SyncSession* session);

}  // namespace docent::maps
