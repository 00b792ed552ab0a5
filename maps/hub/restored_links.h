// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "maps/hub/hub.h"
#include "maps/hub/sync_state.h"

// What a device and its hub still have in common after the hub was restored from a backup. A link may then
// name a revision that the hub has lost: the hub has an older one, or another one under its number. Pure
// functions; any thread.
namespace docent::maps {

// Changes the links whose revision the hub has lost, so that nothing here is replaced by an older state:
//
// - If nobody has saved the map since the restoration, what is here was made from what the hub has. The link
//   then says that the map was changed here since the hub's revision. The keys of these maps are returned.
// - If others have saved it since, the link says that both sides have nothing in common, so that everything
// on
//   both is kept. For a user who may not save maps the hub's state counts instead, because this device could
//   never settle the difference.
//
// Also without an entry in `restorations`, a revision of the hub below that of a link counts as lost.
std::vector<std::uint64_t> ForgetLostRevisions(const std::vector<HubRestoration>& restorations,
                                               const std::vector<HubHead>& heads, bool may_save,
                                               std::vector<MapLink>* links);
// The same for tours. A link without anything in common is removed.
void ForgetLostRevisions(const std::vector<HubRestoration>& restorations, const std::vector<HubTour>& tours,
                         bool may_save, std::vector<TourLink>* links);

}  // namespace docent::maps
