// SPDX-License-Identifier: Apache-2.0
#pragma once

// Maps in files: the Library, the Saver that writes to it in the background, and the MapPager that keeps the
// maps of a large library in memory as they are needed. Target: Docent::maps.

#include "docent/system.h"
#include "maps/library/library.h"
#include "maps/library/map_pager.h"
#include "maps/library/saver.h"
#include "maps/storage/map_record.h"
#include "maps/storage/policy.h"
