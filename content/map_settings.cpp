// SPDX-License-Identifier: Apache-2.0
#include "content/map_settings.h"

#include <cmath>
#include <limits>

#include "content/entity_codec.h"
#include "content/object_reader.h"

namespace docent::content {

std::string Validate(const MapSettings& settings) {
  if (settings.up && !(std::abs(settings.up->norm() - 1) <= 1e-6))
    return "The up direction of the map would not be a unit vector.";
  const double metres = settings.metres_per_unit;
  if (metres != 0 && !(metres >= kMinMetresPerUnit && metres <= kMaxMetresPerUnit))
    return "The length of a map unit would be out of range.";
  return "";
}

MapSettings Transformed(const engine::Sim3& after_from_before, const MapSettings& settings) {
  MapSettings after = settings;
  if (settings.up) after.up = (after_from_before.rotation * *settings.up).normalized();
  // A unit that became too small or large to be stored is not known any more.
  after.metres_per_unit = settings.metres_per_unit / after_from_before.scale;
  if (!Validate(after).empty()) after.metres_per_unit = 0;
  return after;
}

Json SettingsToJson(const MapSettings& settings) {
  Json json{{"up", nullptr}, {"metres_per_unit", settings.metres_per_unit}};
  if (settings.up) json["up"] = {settings.up->x(), settings.up->y(), settings.up->z()};
  if (settings.entrance) json["entrance"] = *settings.entrance;
  return json;
}

MapSettings SettingsFromJson(std::string_view where, const std::string& place, const Json& json) {
  CheckMembers(where, place, json, {"up", "metres_per_unit", "entrance"});
  const ObjectReader reader(where, place, json);
  MapSettings settings;
  if (!reader.Member("up").is_null()) settings.up = reader.UnitVector<3>("up");
  settings.metres_per_unit = reader.Number("metres_per_unit", 0, kMaxMetresPerUnit);
  if (json.contains("entrance")) {
    const Json& entrance = json["entrance"];
    if (!entrance.is_number_unsigned() || entrance > std::numeric_limits<std::uint32_t>::max())
      Refuse(where, place + ".entrance", "is no number of a keyframe.");
    settings.entrance = entrance.get<std::uint32_t>();
  }
  if (const std::string problem = Validate(settings); !problem.empty()) Refuse(where, place, problem);
  return settings;
}

}  // namespace docent::content
