// SPDX-License-Identifier: Apache-2.0
#include "maps/library/signpost_redirection.h"

#include <algorithm>

#include "engine/base/error.h"
#include "maps/library/policy_refusal.h"
#include "maps/library/scene_storage.h"
#include "maps/library/signposts.h"
#include "maps/storage/rows.h"

namespace docent::maps {

std::optional<std::string> SignpostRedirection::RetargetIn(const MapInfo& info,
                                                           const Retarget& retarget) const {
  if (!scenes_.retarget) return std::nullopt;
  try {
    const std::string text = ReadScenePart(database_, info.key).text;
    return text.empty() ? std::nullopt : scenes_.retarget(text, retarget);
  } catch (const Error&) {
    return std::nullopt;
  }
}

std::optional<std::string> SignpostRedirection::RetargetInHistory(const MapInfo& info,
                                                                  const Retarget& retarget) const {
  if (!scenes_.retarget_history) return std::nullopt;
  try {
    const std::optional<std::string> text = FindHistoryText(database_, info.key);
    return text ? scenes_.retarget_history(*text, retarget) : std::nullopt;
  } catch (const Error&) {
    return std::nullopt;
  }
}

void SignpostRedirection::Redirect(const MapInfo& from, const SignpostTarget& into,
                                   const std::vector<std::uint64_t>& except,
                                   const std::string& refusal) const {
  for (MapInfo info : ReadMapRows(database_)) {
    if (std::find(except.begin(), except.end(), info.key) != except.end()) continue;
    const auto retarget = [&](const std::string&, const SignpostTarget& target) {
      return LeadsTo(target, from) && target != into ? std::optional(into) : std::nullopt;
    };
    // Before the scene is written, to which the history belongs.
    const std::optional<std::string> history = RetargetInHistory(info, retarget);
    const std::optional<std::string> text = RetargetIn(info, retarget);
    if (!text && !history) continue;
    WithMapContext(database_, info, [&] {
      if (text && !refusal.empty() && !MayChangeContent(info.policy)) Refuse(info.policy, refusal);
      if (text) WriteSceneText(database_, info.key, *text);
      if (history) WriteHistoryText(database_, info.key, *history);
    });
    info.modified = clock_();
    WriteMapRow(database_, info);
  }
}

}  // namespace docent::maps
