// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/session/route_state.h"
#include "maps/library/library.h"
#include "maps/storage/tour_rows.h"

namespace docent::app {

// The way along a tour of a library. Of maps that are copies of each other, the newest one counts, as for the
// session; a map whose copies are stops of their own is one stop. Throws Error if a stop is not in the
// library, or the library cannot be read.
Route RouteOf(const maps::Library& library, const maps::Tour& tour);

}  // namespace docent::app
