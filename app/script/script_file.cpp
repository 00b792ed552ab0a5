// SPDX-License-Identifier: Apache-2.0
#include "app/script/script_file.h"

#include <cmath>
#include <optional>
#include <utility>

#include "app/files/text_file.h"
#include "app/script/line_reader.h"
#include "content/occluder.h"
#include "engine/base/error.h"

namespace docent::app {

namespace {

Command ParseMapScale(LineReader* line) {
  SetMapScale command;
  if (line->TakeIf("unknown")) return command;
  command.from = line->TakePixel();
  line->Expect("to");
  command.to = line->TakePixel();
  line->Expect("is");
  command.length_m = line->TakeNumber("a length in metres");
  if (!(command.length_m > 0)) line->Fail("the length must be between 1 mm and 1 km, in metres");
  return command;
}

Command ParseMap(LineReader* line) {
  if (line->TakeIf("new")) return NewMap{line->TakeName("a map's name")};
  if (line->TakeIf("stop")) return StopMap{};
  if (line->TakeIf("use")) return UseMap{line->TakeName("a map's name")};
  if (line->TakeIf("rename")) {
    const std::string name = line->TakeName("a map's name");
    return RenameMap{name, line->TakeName("a new name")};
  }
  if (line->TakeIf("remove")) return RemoveMap{line->TakeName("a map's name")};
  if (line->TakeIf("join")) return JoinMap{line->TakeName("a map's name")};
  if (line->TakeIf("policy")) {
    SetPolicy command;
    command.name = line->TakeName("a map's name");
    const std::string& word = line->Take("a policy");
    const std::optional<maps::Policy> policy = maps::ParsePolicy(word);
    if (!policy) line->Fail("unknown policy '" + word + "'; use open, bounded, augment-only or read-only");
    command.policy = *policy;
    return command;
  }
  if (line->TakeIf("up")) {
    SetMapUp command;
    if (!line->TakeIf("automatic")) command.pixel = line->TakePixel();
    return command;
  }
  if (line->TakeIf("scale")) return ParseMapScale(line);
  if (line->TakeIf("entrance")) return SetMapEntrance{!line->TakeIf("automatic")};
  const std::string known = "new, stop, use, policy, rename, remove, join, up, scale or entrance";
  const std::string word = line->Take(known.c_str());
  line->Fail("unknown command 'map " + word + "'; use " + known + " after map");
}

Eigen::Vector3d TakePoint(LineReader* line) {
  Eigen::Vector3d point;
  for (double& coordinate : point) coordinate = line->TakeNumber("X Y Z in map units");
  return point;
}

Command ParsePlace(LineReader* line) {
  PlaceModel command;
  command.file = line->TakeName("a model's file");
  line->Expect("at");
  command.pixel = line->TakePixel();
  while (!line->AtEnd()) {
    if (line->TakeIf("scale")) {
      command.scale = line->TakeNumber("a scale");
    } else if (line->TakeIf("yaw")) {
      command.yaw_deg = line->TakeNumber("an angle in degrees");
    } else {
      break;
    }
  }
  return command;
}

Command ParseSignpost(LineReader* line) {
  PlaceSignpost command;
  command.text = line->TakeName("a signpost's text");
  line->Expect("at");
  command.pixel = line->TakePixel();
  if (line->TakeIf("to")) command.to_map = line->TakeName("a map's name");
  return command;
}

Command ParseLabel(LineReader* line) {
  PlaceLabel command;
  command.text = line->TakeName("a label's text");
  line->Expect("at");
  command.pixel = line->TakePixel();
  if (line->TakeIf("offset")) command.offset = TakePoint(line);
  return command;
}

Command ParseImage(LineReader* line) {
  PlaceImage command;
  command.file = line->TakeName("an image's file");
  line->Expect("at");
  command.pixel = line->TakePixel();
  while (!line->AtEnd()) {
    if (line->TakeIf("scale")) {
      command.scale = line->TakeNumber("a length in map units");
    } else if (line->TakeIf("upright")) {
      command.upright = true;
    } else {
      break;
    }
  }
  return command;
}

Command ParseSound(LineReader* line) {
  PlaceSound command;
  command.file = line->TakeName("a sound's file");
  command.caption = line->TakeName("a caption");
  line->Expect("at");
  command.pixel = line->TakePixel();
  if (line->TakeIf("range")) command.range = line->TakeNumber("a range in map units");
  return command;
}

MapPoint ParsePoint(LineReader* line, bool* last) {
  MapPoint point;
  if (line->TakeIf("pixel")) {
    const double u = line->TakeNumber("a pixel's column");
    point.pixel = {u, line->TakeItemNumber("a pixel's row", last)};
  } else {
    for (const int axis : {0, 1}) point.in_map[axis] = line->TakeNumber("X Y Z in map units");
    point.in_map[2] = line->TakeItemNumber("X Y Z in map units", last);
  }
  return point;
}

Command ParseTrail(LineReader* line) {
  bool last = false;
  if (line->TakeIf("extend")) {
    const std::string name = line->TakeName("a name");
    line->Expect("to");
    const MapPoint point = ParsePoint(line, &last);
    if (!last) line->Fail("expected one point");
    return ExtendTrail{name, point};
  }
  if (line->TakeIf("shorten")) return ShortenTrail{line->TakeName("a name")};
  PlaceTrail command;
  if (line->TakeIf("width")) command.width = line->TakeNumber("a width in map units");
  line->Expect("at");
  while (!last) command.points.push_back(ParsePoint(line, &last));
  return command;
}

content::Occluder::Shape ParseShape(LineReader* line) {
  using Shape = content::Occluder::Shape;
  for (const Shape shape : {Shape::kPlane, Shape::kBox, Shape::kCylinder, Shape::kPolygon}) {
    if (line->TakeIf(content::NameOf(shape))) return shape;
  }
  line->Fail("expected plane, box, cylinder or polygon");
}

Command ParseOccluder(LineReader* line) {
  using Shape = content::Occluder::Shape;
  PlaceOccluder command;
  command.shape = ParseShape(line);
  if (command.shape != Shape::kPolygon && line->TakeIf("size")) {
    Eigen::Vector3d size = Eigen::Vector3d::Zero();
    const int sides = command.shape == Shape::kBox ? 3 : 2;
    for (int i = 0; i < sides; ++i) size[i] = line->TakeNumber("a side in map units");
    if (command.shape == Shape::kCylinder) size.z() = size.x();
    command.size = size;
  }
  line->Expect("at");
  if (command.shape == Shape::kPolygon) {
    for (bool last = false; !last;) command.points.push_back(ParsePoint(line, &last));
    return command;
  }
  bool last = false;
  command.points.push_back(ParsePoint(line, &last));
  if (!last) line->Fail("expected one place");
  if (command.shape == Shape::kBox && line->TakeIf("yaw")) command.yaw_deg = line->TakeNumber("degrees");
  if (command.shape == Shape::kPlane && line->TakeIf("upright")) command.upright = true;
  return command;
}

Command ParseText(LineReader* line) {
  SetEntityText command;
  command.name = line->TakeName("a name");
  command.text = line->Take("a text");
  if (line->TakeIf("in")) command.language = line->TakeName("a language tag");
  return command;
}

Command ParseMove(LineReader* line) {
  MoveEntity command;
  command.name = line->TakeName("a name");
  if (line->TakeIf("to")) {
    command.to_pixel = line->TakePixel();
    return command;
  }
  for (int axis = 0; axis < 3; ++axis) command.by_in_map[axis] = line->TakeNumber("X Y Z in map units");
  return command;
}

Command ParseRotate(LineReader* line) {
  const std::string name = line->TakeName("a name");
  return RotateEntity{name, line->TakeNumber("an angle in degrees")};
}

Command ParseScale(LineReader* line) {
  const std::string name = line->TakeName("a name");
  return ScaleEntity{name, line->TakeNumber("a factor")};
}

Command ParseTransform(LineReader* line) {
  TransformEntities command;
  for (bool last = false; !last;) {
    const std::string name = line->TakeName("a name");
    engine::Sim3 pose;
    for (double& coordinate : pose.translation) coordinate = line->TakeNumber("X Y Z in map units");
    Eigen::Vector4d quaternion;
    for (double& value : quaternion) value = line->TakeNumber("a quaternion QX QY QZ QW");
    if (!(std::abs(quaternion.norm() - 1) < 1e-3)) line->Fail("the quaternion does not have length 1");
    pose.rotation = Settled(engine::Rotation3(Eigen::Quaterniond(quaternion)));
    pose.scale = line->TakeItemNumber("a scale", &last);
    command.poses.push_back({name, pose});
  }
  return command;
}

std::vector<PointPair> ParsePairs(LineReader* line) {
  std::vector<PointPair> pairs;
  for (bool last = false; !last;) {
    PointPair& pair = pairs.emplace_back();
    for (double& coordinate : pair.in_model) coordinate = line->TakeNumber("a point X Y Z of the model");
    line->Expect("to");
    const MapPoint place = ParsePoint(line, &last);
    pair.in_map = place.in_map;
    pair.pixel = place.pixel;
  }
  return pairs;
}

// Names up to the end of the line, or up to a keyword.
std::vector<std::string> ParseNames(LineReader* line, std::string_view keyword = {}) {
  std::vector<std::string> names;
  while (!line->AtEnd() && (keyword.empty() || !line->TakeIf(keyword)))
    names.push_back(line->TakeName("a name"));
  return names;
}

Command ParseFlag(LineReader* line, content::EntityFlag flag, bool value) {
  return SetEntityFlag{ParseNames(line), flag, value};
}

Command ParseGroup(LineReader* line) {
  const std::string group = line->TakeName("a group's name");
  return GroupEntities{ParseNames(line), group};
}

Command ParseTarget(LineReader* line) {
  SetSignpostTarget command{line->TakeName("a name"), ""};
  if (!line->AtEnd()) command.to_map = line->TakeName("a map's name");
  return command;
}

Command ParseDirection(LineReader* line) {
  SetSignpostDirection command{line->TakeName("a name")};
  if (line->TakeIf("ahead")) {
    command.ahead = true;
  } else if (!line->TakeIf("unknown")) {
    command.direction = TakePoint(line);
  }
  return command;
}

Command ParsePaste(LineReader* line) {
  PasteEntities command;
  command.names = ParseNames(line, "from");
  command.from_map = line->TakeName("'from' and a map's name");
  if (line->TakeIf("at")) command.to_pixel = line->TakePixel();
  return command;
}

// The commands that name what is placed; empty for another command.
std::optional<Command> ParseEdit(LineReader* line) {
  using content::EntityFlag;
  if (line->TakeIf("move")) return ParseMove(line);
  if (line->TakeIf("rotate")) return ParseRotate(line);
  if (line->TakeIf("scale")) return ParseScale(line);
  if (line->TakeIf("transform")) return ParseTransform(line);
  if (line->TakeIf("align")) {
    const std::string name = line->TakeName("a name");
    return AlignEntity{name, ParsePairs(line)};
  }
  if (line->TakeIf("bend")) {
    const std::string name = line->TakeName("a name");
    return BendEntity{name, ParsePairs(line)};
  }
  if (line->TakeIf("unbend")) return UnbendEntity{line->TakeName("a name")};
  if (line->TakeIf("remove")) return RemoveEntities{ParseNames(line)};
  if (line->TakeIf("duplicate")) return DuplicateEntities{ParseNames(line)};
  if (line->TakeIf("rename")) {
    const std::string name = line->TakeName("a name");
    return RenameEntity{name, line->TakeName("a new name")};
  }
  if (line->TakeIf("text")) return ParseText(line);
  if (line->TakeIf("offset")) {
    const std::string name = line->TakeName("a name");
    return SetLabelOffset{name, TakePoint(line)};
  }
  if (line->TakeIf("size")) {
    const std::string name = line->TakeName("a name");
    return ResizeOccluder{name, TakePoint(line)};
  }
  if (line->TakeIf("target")) return ParseTarget(line);
  if (line->TakeIf("direction")) return ParseDirection(line);
  if (line->TakeIf("lock")) return ParseFlag(line, EntityFlag::kLocked, true);
  if (line->TakeIf("unlock")) return ParseFlag(line, EntityFlag::kLocked, false);
  if (line->TakeIf("hide")) return ParseFlag(line, EntityFlag::kHidden, true);
  if (line->TakeIf("show")) return ParseFlag(line, EntityFlag::kHidden, false);
  if (line->TakeIf("group")) return ParseGroup(line);
  if (line->TakeIf("ungroup")) return GroupEntities{ParseNames(line), ""};
  if (line->TakeIf("paste")) return ParsePaste(line);
  return std::nullopt;
}

Command ParseTour(LineReader* line) {
  if (line->TakeIf("skip")) return GuideVisitor{GuideVisitor::Step::kSkip};
  if (line->TakeIf("back")) return GuideVisitor{GuideVisitor::Step::kBack};
  if (line->TakeIf("open")) return GuideVisitor{GuideVisitor::Step::kOpen, line->TakeName("a name")};
  if (line->TakeIf("press")) return GuideVisitor{GuideVisitor::Step::kPress};
  if (line->TakeIf("mark")) return GuideVisitor{GuideVisitor::Step::kMark};
  if (line->TakeIf("close")) return GuideVisitor{GuideVisitor::Step::kClose};
  if (line->TakeIf("restart")) return GuideVisitor{GuideVisitor::Step::kRestart};
  if (line->TakeIf("continue")) return GuideVisitor{GuideVisitor::Step::kContinue};
  constexpr const char* kKnown = "skip, back, open, press, mark, close, restart or continue";
  const std::string word = line->Take(kKnown);
  line->Fail("unknown command 'tour " + word + "'; use " + kKnown + " after tour");
}

Command ParseCommand(LineReader* line) {
  if (line->TakeIf("map")) return ParseMap(line);
  if (line->TakeIf("place")) return ParsePlace(line);
  if (line->TakeIf("signpost")) return ParseSignpost(line);
  if (line->TakeIf("label")) return ParseLabel(line);
  if (line->TakeIf("image")) return ParseImage(line);
  if (line->TakeIf("sound")) return ParseSound(line);
  if (line->TakeIf("trail")) return ParseTrail(line);
  if (line->TakeIf("occluder")) return ParseOccluder(line);
  if (auto edit = ParseEdit(line)) return *std::move(edit);
  if (line->TakeIf("tour")) return ParseTour(line);
  if (line->TakeIf("undo")) return Undo{};
  if (line->TakeIf("redo")) return Redo{};
  if (line->TakeIf("save")) return Save{};
  const std::string word = line->Take("a command");
  line->Fail("unknown command '" + word + "'");
}

}  // namespace

std::vector<TimedCommand> ParseScript(std::string_view text, const std::string& name) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  std::vector<TimedCommand> commands;
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = text.find('\n');
    LineReader line(text.substr(0, end), name + ", line " + std::to_string(number));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (line.AtEnd()) continue;
    const std::string& time_text = line.Take("a time");
    const auto time = ParseSeconds(time_text);
    if (!time || *time < Timestamp{}) line.Fail("expected a time in seconds instead of '" + time_text + "'");
    if (!commands.empty() && *time < commands.back().time)
      line.Fail("the time is earlier than that of the previous command");
    TimedCommand command{*time, number, ParseCommand(&line)};
    line.ExpectEnd();
    if (const std::string problem = Validate(command.command); !problem.empty()) line.Fail(problem);
    commands.push_back(std::move(command));
  }
  return commands;
}

std::vector<TimedCommand> ReadScript(const std::filesystem::path& path) {
  return ParseScript(ReadTextFile(path, std::size_t{16} << 20), "'" + path.string() + "'");
}

}  // namespace docent::app
