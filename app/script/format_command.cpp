// SPDX-License-Identifier: Apache-2.0
#include "app/script/format_command.h"

#include <variant>
#include <vector>

#include "app/files/text_file.h"
#include "content/occluder.h"

namespace docent::app {

namespace {

// Quotes the text if it would not be read back as one word otherwise.
std::string Quoted(const std::string& text) {
  const bool plain = !text.empty() && text.find_first_of(" \t\r\n\f\v#\"\\") == std::string::npos;
  if (plain) return text;
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    if (c == '\n') {
      quoted += "\\n";
    } else {
      quoted += c;
    }
  }
  return quoted + '"';
}

// Names are always quoted, so that a name is never mistaken for an optional keyword.
std::string AlwaysQuoted(const std::string& text) {
  const std::string quoted = Quoted(text);
  return quoted.starts_with('"') ? quoted : '"' + quoted + '"';
}

std::string Pixel(const Eigen::Vector2d& pixel) {
  return "pixel " + FormatExactly(pixel.x()) + ' ' + FormatExactly(pixel.y());
}

std::string Names(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += ' ' + AlwaysQuoted(name);
  return text;
}

std::string Point(const Eigen::Vector3d& point) {
  return FormatExactly(point.x()) + ' ' + FormatExactly(point.y()) + ' ' + FormatExactly(point.z());
}

std::string Pairs(const std::vector<PointPair>& pairs) {
  std::string text;
  for (const PointPair& pair : pairs) {
    text += (text.empty() ? " " : ", ") + Point(pair.in_model) + " to " +
            (pair.pixel ? Pixel(*pair.pixel) : Point(pair.in_map));
  }
  return text;
}

std::string Place(const MapPoint& point) {
  return point.pixel ? Pixel(*point.pixel) : Point(point.in_map);
}

struct CommandFormatter {
  std::string operator()(const NewMap& c) const { return "map new " + AlwaysQuoted(c.name); }
  std::string operator()(const StopMap&) const { return "map stop"; }
  std::string operator()(const UseMap& c) const { return "map use " + AlwaysQuoted(c.name); }
  std::string operator()(const SetPolicy& c) const {
    return "map policy " + AlwaysQuoted(c.name) + ' ' + maps::ToString(c.policy);
  }
  std::string operator()(const RenameMap& c) const {
    return "map rename " + AlwaysQuoted(c.name) + ' ' + AlwaysQuoted(c.new_name);
  }
  std::string operator()(const RemoveMap& c) const { return "map remove " + AlwaysQuoted(c.name); }
  std::string operator()(const JoinMap& c) const { return "map join " + AlwaysQuoted(c.name); }
  std::string operator()(const SetMapUp& c) const {
    return "map up " + (c.pixel ? Pixel(*c.pixel) : std::string("automatic"));
  }
  std::string operator()(const SetMapScale& c) const {
    if (c.length_m == 0) return "map scale unknown";
    return "map scale " + Pixel(c.from) + " to " + Pixel(c.to) + " is " + FormatExactly(c.length_m);
  }
  std::string operator()(const SetMapEntrance& c) const {
    return c.here ? "map entrance" : "map entrance automatic";
  }
  std::string operator()(const PlaceModel& c) const {
    return "place " + Quoted(c.file) + " at " + Pixel(c.pixel) +
           (c.scale ? " scale " + FormatExactly(*c.scale) : "") +
           (c.yaw_deg != 0 ? " yaw " + FormatExactly(c.yaw_deg) : "");
  }
  std::string operator()(const PlaceSignpost& c) const {
    return "signpost " + AlwaysQuoted(c.text) + " at " + Pixel(c.pixel) +
           (c.to_map.empty() ? "" : " to " + AlwaysQuoted(c.to_map));
  }
  std::string operator()(const PlaceLabel& c) const {
    return "label " + AlwaysQuoted(c.text) + " at " + Pixel(c.pixel) +
           (c.offset ? " offset " + Point(*c.offset) : "");
  }
  std::string operator()(const PlaceImage& c) const {
    return "image " + Quoted(c.file) + " at " + Pixel(c.pixel) +
           (c.scale ? " scale " + FormatExactly(*c.scale) : "") + (c.upright ? " upright" : "");
  }
  std::string operator()(const PlaceSound& c) const {
    return "sound " + Quoted(c.file) + ' ' + AlwaysQuoted(c.caption) + " at " + Pixel(c.pixel) +
           (c.range ? " range " + FormatExactly(*c.range) : "");
  }
  std::string operator()(const PlaceTrail& c) const {
    std::string points;
    for (const MapPoint& point : c.points) points += (points.empty() ? " " : ", ") + Place(point);
    return "trail" + (c.width ? " width " + FormatExactly(*c.width) : std::string()) + " at" + points;
  }
  std::string operator()(const ExtendTrail& c) const {
    return "trail extend " + AlwaysQuoted(c.name) + " to " + Place(c.point);
  }
  std::string operator()(const ShortenTrail& c) const { return "trail shorten " + AlwaysQuoted(c.name); }
  std::string operator()(const PlaceOccluder& c) const {
    std::string text = std::string("occluder ") + content::NameOf(c.shape);
    if (c.size) {
      text += " size";
      const int sides = c.shape == content::Occluder::Shape::kBox ? 3 : 2;
      for (int i = 0; i < sides; ++i) text += ' ' + FormatExactly((*c.size)[i]);
    }
    text += " at";
    for (std::size_t i = 0; i < c.points.size(); ++i) text += (i == 0 ? " " : ", ") + Place(c.points[i]);
    if (c.yaw_deg != 0) text += " yaw " + FormatExactly(c.yaw_deg);
    return text + (c.upright ? " upright" : "");
  }
  std::string operator()(const ResizeOccluder& c) const {
    return "size " + AlwaysQuoted(c.name) + ' ' + Point(c.size);
  }
  std::string operator()(const SetLabelOffset& c) const {
    return "offset " + AlwaysQuoted(c.name) + ' ' + Point(c.offset);
  }
  std::string operator()(const MoveEntity& c) const {
    const std::string begin = "move " + Quoted(c.name) + ' ';
    if (c.to_pixel) return begin + "to " + Pixel(*c.to_pixel);
    return begin + FormatExactly(c.by_in_map.x()) + ' ' + FormatExactly(c.by_in_map.y()) + ' ' +
           FormatExactly(c.by_in_map.z());
  }
  std::string operator()(const RotateEntity& c) const {
    return "rotate " + Quoted(c.name) + ' ' + FormatExactly(c.angle_deg);
  }
  std::string operator()(const ScaleEntity& c) const {
    return "scale " + Quoted(c.name) + ' ' + FormatExactly(c.factor);
  }
  std::string operator()(const TransformEntities& c) const {
    std::string text = "transform";
    for (const auto& [name, pose] : c.poses) {
      text += (&name == &c.poses.front().name ? " " : ", ") + Quoted(name);
      for (const double value : pose.translation) text += ' ' + FormatExactly(value);
      const Eigen::Vector4d quaternion = Settled(pose.rotation).quaternion().coeffs();
      for (const double value : quaternion) text += ' ' + FormatExactly(value);
      text += ' ' + FormatExactly(pose.scale);
    }
    return text;
  }
  std::string operator()(const AlignEntity& c) const { return "align " + Quoted(c.name) + Pairs(c.pairs); }
  std::string operator()(const BendEntity& c) const { return "bend " + Quoted(c.name) + Pairs(c.pairs); }
  std::string operator()(const UnbendEntity& c) const { return "unbend " + Quoted(c.name); }
  std::string operator()(const RemoveEntities& c) const { return "remove" + Names(c.names); }
  std::string operator()(const DuplicateEntities& c) const { return "duplicate" + Names(c.names); }
  std::string operator()(const RenameEntity& c) const {
    return "rename " + AlwaysQuoted(c.name) + ' ' + AlwaysQuoted(c.new_name);
  }
  std::string operator()(const SetEntityText& c) const {
    return "text " + AlwaysQuoted(c.name) + ' ' + AlwaysQuoted(c.text) +
           (c.language.empty() ? "" : " in " + AlwaysQuoted(c.language));
  }
  std::string operator()(const SetSignpostTarget& c) const {
    return "target " + AlwaysQuoted(c.name) + (c.to_map.empty() ? "" : ' ' + AlwaysQuoted(c.to_map));
  }
  std::string operator()(const SetSignpostDirection& c) const {
    return "direction " + AlwaysQuoted(c.name) + ' ' +
           (c.ahead       ? "ahead"
            : c.direction ? Point(*c.direction)
                          : std::string("unknown"));
  }
  std::string operator()(const SetEntityFlag& c) const {
    const bool is_lock = c.flag == content::EntityFlag::kLocked;
    const char* const verb = is_lock ? (c.value ? "lock" : "unlock") : (c.value ? "hide" : "show");
    return verb + Names(c.names);
  }
  std::string operator()(const GroupEntities& c) const {
    return (c.group.empty() ? "ungroup" : "group " + AlwaysQuoted(c.group)) + Names(c.names);
  }
  std::string operator()(const PasteEntities& c) const {
    return "paste" + Names(c.names) + " from " + AlwaysQuoted(c.from_map) +
           (c.to_pixel ? " at " + Pixel(*c.to_pixel) : "");
  }
  std::string operator()(const GuideVisitor& c) const {
    switch (c.step) {
      case GuideVisitor::Step::kSkip:
        return "tour skip";
      case GuideVisitor::Step::kBack:
        return "tour back";
      case GuideVisitor::Step::kOpen:
        return "tour open " + AlwaysQuoted(c.name);
      case GuideVisitor::Step::kPress:
        return "tour press";
      case GuideVisitor::Step::kMark:
        return "tour mark";
      case GuideVisitor::Step::kClose:
        return "tour close";
      case GuideVisitor::Step::kRestart:
        return "tour restart";
      case GuideVisitor::Step::kContinue:
        return "tour continue";
    }
    return "";
  }
  std::string operator()(const Undo&) const { return "undo"; }
  std::string operator()(const Redo&) const { return "redo"; }
  std::string operator()(const Save&) const { return "save"; }
};

}  // namespace

std::string FormatCommand(const Command& command) {
  return std::visit(CommandFormatter{}, command);
}

std::string FormatScriptLine(const TimedCommand& command) {
  std::string seconds = FormatSeconds(command.time);
  seconds.erase(seconds.find_last_not_of('0') + 1);  // "12.5" is easier to read than "12.500000000"
  if (seconds.ends_with('.')) seconds.pop_back();
  return seconds + ' ' + FormatCommand(command.command);
}

}  // namespace docent::app
