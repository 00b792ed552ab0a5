// SPDX-License-Identifier: Apache-2.0
#include "app/script/commands.h"

#include <cmath>
#include <set>

#include "app/files/text_file.h"
#include "content/occluder.h"
#include "content/scene.h"
#include "content/warp.h"
#include "engine/base/utf8.h"
#include "maps/library/library.h"

namespace docent::app {

namespace {

constexpr double kMaxPixel = 1e6;            // far outside any image
constexpr double kMaxModelCoordinate = 1e9;  // metres
constexpr const char* kNoMapName = "expected a map's name that is not empty";

bool IsAtMost(double value, double most) {
  return std::abs(value) <= most;  // false for NaN
}

std::string NameProblem(const std::string& name, const char* what) {
  if (name.empty()) return std::string("expected ") + what + " that is not empty";
  if (name.size() > content::kMaxTextBytes || !IsUtf8(name)) {
    return std::string("expected ") + what + " in UTF-8 with at most " +
           std::to_string(content::kMaxTextBytes) + " bytes";
  }
  return "";
}

std::string PixelProblem(const Eigen::Vector2d& pixel) {
  const bool near = IsAtMost(pixel.x(), kMaxPixel) && IsAtMost(pixel.y(), kMaxPixel);
  if (near) return "";
  return "the pixel must have coordinates between " + FormatNumber(-kMaxPixel) + " and " +
         FormatNumber(kMaxPixel);
}

// Of `what`, a vector in the map.
std::string CoordinatesProblem(const char* what, double most = content::kMaxCoordinate) {
  return std::string(what) + " must have coordinates between " + FormatNumber(-most) + " and " +
         FormatNumber(most) + " map units";
}

std::string AngleProblem(double angle_deg) {
  if (IsAtMost(angle_deg, content::kMaxAngle_deg)) return "";
  return "the angle must be at most " + FormatNumber(content::kMaxAngle_deg) + " degrees";
}

// Within the limits, the factor that makes the smallest model the largest one.
std::string FactorProblem(double factor) {
  constexpr double kLimit = content::kMaxModelScale / content::kMinModelScale;
  if (factor >= 1 / kLimit && factor <= kLimit) return "";
  return "the factor must be between " + FormatNumber(1 / kLimit) + " and " + FormatNumber(kLimit);
}

std::string ScaleProblem(double scale) {
  if (scale >= content::kMinModelScale && scale <= content::kMaxModelScale) return "";
  return "the scale must be between " + FormatNumber(content::kMinModelScale) + " and " +
         FormatNumber(content::kMaxModelScale);
}

std::string NamesProblem(const std::vector<std::string>& names) {
  if (names.empty()) return "expected the name of an entity";
  if (names.size() > content::kMaxEntities) return "there are more names than a map can hold";
  std::set<std::string_view> seen;
  for (const std::string& name : names) {
    if (const std::string problem = NameProblem(name, "a name"); !problem.empty()) return problem;
    if (!seen.insert(name).second) return "'" + name + "' is named twice";
  }
  return "";
}

// Of a similarity that takes an entity to the map. The height of a signpost has narrower limits, which are
// checked where it is known that the entity is one.
std::string PoseProblem(const engine::Sim3& pose) {
  if (!IsAtMost(pose.translation.cwiseAbs().maxCoeff<Eigen::PropagateNaN>(), content::kMaxCoordinate))
    return CoordinatesProblem("the place");
  if (!IsAtMost(pose.rotation.quaternion().norm() - 1, 1e-4)) return "the rotation is not valid";
  return ScaleProblem(pose.scale);
}

std::string PairsProblem(const std::vector<PointPair>& pairs) {
  if (pairs.size() > content::kMaxWarpPoints)
    return "expected at most " + std::to_string(content::kMaxWarpPoints) + " points";
  for (const PointPair& pair : pairs) {
    if (!IsAtMost(pair.in_model.cwiseAbs().maxCoeff<Eigen::PropagateNaN>(), kMaxModelCoordinate))
      return "a point of the model must lie within " + FormatNumber(kMaxModelCoordinate) +
             " metres of its origin";
    if (pair.pixel) {
      if (const std::string problem = PixelProblem(*pair.pixel); !problem.empty()) return problem;
    } else if (!IsAtMost(pair.in_map.cwiseAbs().maxCoeff<Eigen::PropagateNaN>(), content::kMaxCoordinate)) {
      return CoordinatesProblem("a place");
    }
  }
  return "";
}

std::string OffsetProblem(const Eigen::Vector3d& offset) {
  const bool near = IsAtMost(offset.cwiseAbs().maxCoeff<Eigen::PropagateNaN>(), content::kMaxCoordinate);
  return near ? "" : CoordinatesProblem("the offset");
}

std::string DirectionProblem(const Eigen::Vector3d& direction) {
  // Of a shorter one, little more than rounding may be left.
  constexpr double kMinLength = 1e-6;
  if (!IsAtMost(direction.cwiseAbs().maxCoeff<Eigen::PropagateNaN>(), content::kMaxCoordinate))
    return CoordinatesProblem("the direction");
  return direction.norm() >= kMinLength ? "" : "the direction is too short; give X Y Z that are not all 0";
}

std::string LengthProblem(const char* what, double length, double least, double most) {
  if (length >= least && length <= most) return "";
  return std::string("the ") + what + " must be between " + FormatNumber(least) + " and " +
         FormatNumber(most);
}

std::string PointProblem(const MapPoint& point) {
  if (point.pixel) return PixelProblem(*point.pixel);
  const bool near =
      IsAtMost(point.in_map.cwiseAbs().maxCoeff<Eigen::PropagateNaN>(), content::kMaxCoordinate);
  return near ? "" : CoordinatesProblem("a place");
}

std::string First(std::initializer_list<std::string> problems) {
  for (const std::string& problem : problems) {
    if (!problem.empty()) return problem;
  }
  return "";
}

// Lengths that a person measures in a building.
constexpr double kMinLength_m = 1e-3, kMaxLength_m = 1e3;

struct Validator {
  std::string operator()(const NewMap& c) const { return maps::ValidateMapName(c.name); }
  std::string operator()(const StopMap&) const { return ""; }
  // A map that was made by an earlier version may have a name that is not accepted for a new one.
  std::string operator()(const UseMap& c) const { return c.name.empty() ? kNoMapName : ""; }
  std::string operator()(const SetPolicy& c) const { return c.name.empty() ? kNoMapName : ""; }
  std::string operator()(const RenameMap& c) const {
    return First({c.name.empty() ? kNoMapName : "", maps::ValidateMapName(c.new_name)});
  }
  std::string operator()(const RemoveMap& c) const { return c.name.empty() ? kNoMapName : ""; }
  std::string operator()(const JoinMap& c) const { return c.name.empty() ? kNoMapName : ""; }
  std::string operator()(const SetMapUp& c) const { return c.pixel ? PixelProblem(*c.pixel) : ""; }
  std::string operator()(const SetMapEntrance&) const { return ""; }
  std::string operator()(const SetMapScale& c) const {
    if (c.length_m == 0) return "";
    const bool in_range = c.length_m >= kMinLength_m && c.length_m <= kMaxLength_m;
    return First({PixelProblem(c.from), PixelProblem(c.to),
                  in_range ? "" : "the length must be between 1 mm and 1 km, in metres"});
  }
  std::string operator()(const PlaceModel& c) const {
    if (c.file.empty()) return "expected a model's file";
    return First(
        {PixelProblem(c.pixel), c.scale ? ScaleProblem(*c.scale) : std::string(), AngleProblem(c.yaw_deg)});
  }
  std::string operator()(const PlaceSignpost& c) const {
    return First({NameProblem(c.text, "a signpost's text"), PixelProblem(c.pixel),
                  c.to_map.empty() ? "" : maps::ValidateMapName(c.to_map)});
  }
  std::string operator()(const PlaceLabel& c) const {
    return First({NameProblem(c.text, "a label's text"), PixelProblem(c.pixel),
                  c.offset ? OffsetProblem(*c.offset) : std::string()});
  }
  std::string operator()(const PlaceImage& c) const {
    return First({c.file.empty() ? "expected an image's file" : "", PixelProblem(c.pixel),
                  c.scale ? ScaleProblem(*c.scale) : std::string()});
  }
  std::string operator()(const PlaceSound& c) const {
    return First({c.file.empty() ? "expected a sound's file" : "", NameProblem(c.caption, "a caption"),
                  PixelProblem(c.pixel),
                  c.range ? LengthProblem("range", *c.range, content::kMinSoundRange, content::kMaxSoundRange)
                          : std::string()});
  }
  std::string operator()(const PlaceTrail& c) const {
    if (c.points.size() < content::kMinTrailPoints || c.points.size() > content::kMaxTrailPoints) {
      return "expected " + std::to_string(content::kMinTrailPoints) + " to " +
             std::to_string(content::kMaxTrailPoints) + " points";
    }
    for (const MapPoint& point : c.points) {
      if (std::string problem = PointProblem(point); !problem.empty()) return problem;
    }
    return c.width ? LengthProblem("width", *c.width, content::kMinTrailWidth, content::kMaxTrailWidth) : "";
  }
  std::string operator()(const ExtendTrail& c) const {
    return First({NameProblem(c.name, "a name"), PointProblem(c.point)});
  }
  std::string operator()(const ShortenTrail& c) const { return NameProblem(c.name, "a name"); }
  std::string operator()(const PlaceOccluder& c) const {
    const bool is_polygon = c.shape == content::Occluder::Shape::kPolygon;
    const std::size_t least = is_polygon ? content::kMinOutlinePoints : 1;
    const std::size_t most = is_polygon ? content::kMaxOutlinePoints : 1;
    if (c.points.size() < least || c.points.size() > most) {
      return is_polygon ? "expected " + std::to_string(least) + " to " + std::to_string(most) + " points"
                        : "expected one place";
    }
    for (const MapPoint& point : c.points) {
      if (std::string problem = PointProblem(point); !problem.empty()) return problem;
    }
    if (is_polygon && c.size) return "a polygon has the size of its corners";
    content::Occluder occluder;
    occluder.shape = c.shape;
    if (c.size) occluder.size = *c.size;
    if (c.size && !content::ShapeProblem(occluder).empty()) {
      return "the sides must be between " + FormatNumber(content::kMinOccluderSide) + " and " +
             FormatNumber(content::kMaxOccluderSide);
    }
    return AngleProblem(c.yaw_deg);
  }
  std::string operator()(const ResizeOccluder& c) const {
    const bool is_valid = c.size.minCoeff<Eigen::PropagateNaN>() >= 0 &&
                          c.size.maxCoeff<Eigen::PropagateNaN>() <= content::kMaxOccluderSide;
    return First(
        {NameProblem(c.name, "a name"),
         is_valid ? "" : "the sides must be between 0 and " + FormatNumber(content::kMaxOccluderSide)});
  }
  std::string operator()(const SetLabelOffset& c) const {
    return First({NameProblem(c.name, "a name"), OffsetProblem(c.offset)});
  }
  std::string operator()(const MoveEntity& c) const {
    if (c.to_pixel) return First({NameProblem(c.name, "a name"), PixelProblem(*c.to_pixel)});
    const bool near =
        IsAtMost(c.by_in_map.cwiseAbs().maxCoeff<Eigen::PropagateNaN>(), 2 * content::kMaxCoordinate);
    return First({NameProblem(c.name, "a name"),
                  near ? "" : CoordinatesProblem("the offset", 2 * content::kMaxCoordinate)});
  }
  std::string operator()(const RotateEntity& c) const {
    return First({NameProblem(c.name, "a name"), AngleProblem(c.angle_deg)});
  }
  std::string operator()(const ScaleEntity& c) const {
    return First({NameProblem(c.name, "a name"), FactorProblem(c.factor)});
  }
  std::string operator()(const TransformEntities& c) const {
    if (c.poses.empty()) return "expected a name";
    for (const EntityPose& pose : c.poses) {
      std::string problem = First({NameProblem(pose.name, "a name"), PoseProblem(pose.map_from_entity)});
      if (!problem.empty()) return problem;
    }
    return "";
  }
  std::string operator()(const AlignEntity& c) const {
    return First({NameProblem(c.name, "a name"), c.pairs.size() < 3 ? "expected at least 3 points" : "",
                  PairsProblem(c.pairs)});
  }
  std::string operator()(const BendEntity& c) const {
    return First({NameProblem(c.name, "a name"),
                  c.pairs.size() < content::kMinWarpPoints
                      ? "expected at least " + std::to_string(content::kMinWarpPoints) + " points"
                      : "",
                  PairsProblem(c.pairs)});
  }
  std::string operator()(const UnbendEntity& c) const { return NameProblem(c.name, "a name"); }
  std::string operator()(const RemoveEntities& c) const { return NamesProblem(c.names); }
  std::string operator()(const DuplicateEntities& c) const { return NamesProblem(c.names); }
  std::string operator()(const RenameEntity& c) const {
    return First({NameProblem(c.name, "a name"), NameProblem(c.new_name, "a new name")});
  }
  std::string operator()(const SetEntityText& c) const {
    if (!c.language.empty() && content::LanguageTag(c.language).empty())
      return "'" + Shortened(c.language, content::kMaxLanguageBytes) + "' is not a language tag";
    const bool removes = c.text.empty() && !c.language.empty();
    return First({NameProblem(c.name, "a name"), removes ? "" : NameProblem(c.text, "a text")});
  }
  std::string operator()(const SetSignpostTarget& c) const {
    return First({NameProblem(c.name, "a name"), c.to_map.empty() ? "" : maps::ValidateMapName(c.to_map)});
  }
  std::string operator()(const SetSignpostDirection& c) const {
    return First({NameProblem(c.name, "a name"),
                  c.direction && !c.ahead ? DirectionProblem(*c.direction) : std::string()});
  }
  std::string operator()(const SetEntityFlag& c) const { return NamesProblem(c.names); }
  std::string operator()(const GroupEntities& c) const {
    return First({NamesProblem(c.names), c.group.empty() ? "" : NameProblem(c.group, "a group's name")});
  }
  std::string operator()(const PasteEntities& c) const {
    return First({NamesProblem(c.names), c.from_map.empty() ? kNoMapName : "",
                  c.to_pixel ? PixelProblem(*c.to_pixel) : std::string()});
  }
  std::string operator()(const GuideVisitor& c) const {
    return c.step == GuideVisitor::Step::kOpen ? NameProblem(c.name, "a name") : "";
  }
  std::string operator()(const Undo&) const { return ""; }
  std::string operator()(const Redo&) const { return ""; }
  std::string operator()(const Save&) const { return ""; }
};

}  // namespace

// Normalizing a quaternion again may change its last bits for ever. Where the computed norm is 1 it does not,
// and a quaternion with such a norm is a few steps of the largest component away.
engine::Rotation3 Settled(const engine::Rotation3& rotation) {
  constexpr int kMostSteps = 8;
  const Eigen::Vector4d start = rotation.quaternion().coeffs();
  Eigen::Index largest = 0;
  start.cwiseAbs().maxCoeff(&largest);
  Eigen::Vector4d up = start, down = start;
  for (int step = 0; step <= kMostSteps; ++step) {
    for (const Eigen::Vector4d& tried : {up, down}) {
      const engine::Rotation3 normalized{Eigen::Quaterniond(tried)};
      if (normalized.quaternion().coeffs() == tried) return normalized;
    }
    up[largest] = std::nextafter(up[largest], 2.0);
    down[largest] = std::nextafter(down[largest], -2.0);
  }
  return rotation;
}

bool EntityPose::operator==(const EntityPose& other) const {
  return name == other.name &&
         Settled(map_from_entity.rotation).quaternion().coeffs() ==
             Settled(other.map_from_entity.rotation).quaternion().coeffs() &&
         map_from_entity.translation == other.map_from_entity.translation &&
         map_from_entity.scale == other.map_from_entity.scale;
}

std::string Validate(const Command& command) {
  return std::visit(Validator{}, command);
}

}  // namespace docent::app
