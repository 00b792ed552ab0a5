// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "content/edit_history.h"
#include "content/entity_codec.h"

// Encodes the changes of a scene that can be undone and redone as JSON text, so that a library can keep them
// beside the scene. Entities are written as in a scene (scene_codec.h):
//
//   {"docent_history": 4, "assets": [ID…],
//    "done": [{"label": TEXT, "changes": [{"index": I, "before": ENTITY or null, "after": …}]}],
//    "undone": […]}
//
// Pure functions; thread-safe.
namespace docent::content {

// No encoded history is larger, whatever is asked for; the reader takes nothing larger either.
inline constexpr std::size_t kMaxHistoryBytes = 16u << 20;

// The text has at most max_bytes: the oldest done changes are left out as long as it would be larger, then
// those undone changes that would be redone last. Empty when there is nothing to write.
std::string EncodeHistory(const EditHistory& history, std::size_t max_bytes);

// The ids in "assets", so that a library can fetch them first. Throws Error like DecodeHistory.
std::vector<std::string> HistoryAssetIds(std::string_view text);

// Parses strictly like DecodeScene and throws Error, with one exception: where find_asset does not know an
// asset, the changes that need it are left out, with those that could be reached only through them. An empty
// text is an empty history. `where` names the text in messages.
EditHistory DecodeHistory(std::string_view text, std::string_view where, const AssetLookup& find_asset);

}  // namespace docent::content
