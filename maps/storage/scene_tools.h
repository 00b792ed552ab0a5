// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "maps/storage/map_record.h"

namespace docent::maps {

// The map that a signpost leads to: its key, 0 if it was written without one, and the name that it had. Both
// are empty for a signpost that leads nowhere.
struct SignpostTarget {
  std::uint64_t key = 0;  // Of the map.
  std::string map;        // Its name.

  // Whether both fields are equal.
  bool operator==(const SignpostTarget& other) const = default;
};

// Given the name of a signpost and the map it leads to, returns the map that it shall lead to; empty if that
// stays the same.
using Retarget =
    std::function<std::optional<SignpostTarget>(const std::string& signpost, const SignpostTarget& target)>;

// What only the content library can do with a scene, whose text the library of maps does not interpret. The
// functions are pure, thread-safe and may be empty; then what needs them is left out.
struct SceneTools {
  // Reads a scene as far as possible: what is damaged, or needs an asset that is not among `scene.assets` or
  // is damaged, is left out, and `problems` gets a sentence for each. Returns what is left; the same text if
  // nothing is wrong. Throws nothing that is not out of memory.
  std::function<SceneRecord(const SceneRecord& scene, std::vector<std::string>* problems)> read;
  // Applies `retarget` to all signposts of a scene; returns the new text, empty if it stays the same. Throws
  // docent::Error when the text cannot be read.
  std::function<std::optional<std::string>(const std::string& text, const Retarget& retarget)> retarget;
  // The same for the signposts in a history of changes (MapRecord::history); `retarget` is not told their
  // names. The new text has at most kMaxHistoryTextBytes: the oldest changes are left out if it would have
  // more, and nothing may be left.
  std::function<std::optional<std::string>(const std::string& text, const Retarget& retarget)>
      retarget_history;
};

}  // namespace docent::maps
