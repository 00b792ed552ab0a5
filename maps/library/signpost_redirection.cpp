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

void SignpostRedirection::Redirect(const MapInfo& from, const SignpostTarget& into,
                                   const std::vector<std::uint64_t>& except,
                                   const std::string& refusal) const {
  for (MapInfo info : ReadMapRows(database_)) {
    if (std::find(except.begin(), except.end(), info.key) != except.end()) continue;
    const auto text = RetargetIn(info, [&](const std::string&, const SignpostTarget& target) {
      return LeadsTo(target, from) && target != into ? std::optional(into) : std::nullopt;
    });
    if (!text) continue;
    WithMapContext(database_, info, [&] {
      if (!refusal.empty() && !MayChangeContent(info.policy)) Refuse(info.policy, refusal);
      WriteSceneText(database_, info.key, *text);
    });
    info.modified = clock_();
    WriteMapRow(database_, info);
  }
}

}  // namespace docent::maps
