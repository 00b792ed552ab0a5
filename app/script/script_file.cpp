// SPDX-License-Identifier: Apache-2.0
#include "app/script/script_file.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "app/files/text_file.h"
#include "engine/base/error.h"

namespace docent::app {

namespace {

struct Word {
  std::string text;
  bool quoted = false;
};

// Reads the words of one line in order; its errors name the line.
class LineReader {
 public:
  LineReader(std::string_view line, std::string where) : where_(std::move(where)) { Split(line); }

  bool AtEnd() const { return next_ == words_.size(); }

  const std::string& Take(const char* what) {
    if (AtEnd()) Fail(std::string("expected ") + what + " at the end of the line");
    return words_[next_++].text;
  }
  // Consumes the next word if it is this keyword. A quoted word is never a keyword.
  bool TakeIf(std::string_view keyword) {
    if (AtEnd() || words_[next_].quoted || words_[next_].text != keyword) return false;
    ++next_;
    return true;
  }
  void Expect(std::string_view keyword) {
    if (TakeIf(keyword)) return;
    Fail("expected '" + std::string(keyword) + "'" + (AtEnd() ? " at the end of the line" : Instead()));
  }
  std::string TakeName(const char* what) {
    const std::string& name = Take(what);
    if (name.empty()) Fail(std::string("expected ") + what + " that is not empty");
    return name;
  }
  double TakeNumber(const char* what) {
    const std::string& text = Take(what);
    const auto value = ParseNumber(text);
    if (!value) Fail(std::string("expected ") + what + " instead of '" + text + "'");
    return *value;
  }
  // The next number of a list whose items are separated by commas: `last` becomes true where no comma
  // follows.
  double TakeItemNumber(const char* what, bool* last) {
    const std::string text = Take(what);
    const bool comma = text.ends_with(',');
    const auto value = ParseNumber(std::string_view(text).substr(0, text.size() - (comma ? 1 : 0)));
    if (!value) Fail(std::string("expected ") + what + " instead of '" + text + "'");
    *last = !comma && !TakeIf(",");
    return *value;
  }
  Eigen::Vector2d TakePixel() {
    Expect("pixel");
    const double u = TakeNumber("a pixel's column");
    const double v = TakeNumber("a pixel's row");
    return {u, v};
  }
  void ExpectEnd() {
    if (!AtEnd()) {
      Fail("unexpected '" + words_[next_].text + "'; put a name with spaces in double quotes");
    }
  }
  [[noreturn]] void Fail(const std::string& what) const { throw Error(where_ + ": " + what + "."); }

 private:
  std::string Instead() const { return " instead of '" + words_[next_].text + "'"; }

  void Split(std::string_view line) {
    constexpr std::string_view kBlank = " \t\r\f\v";
    for (std::size_t i = 0; i < line.size();) {
      if (kBlank.find(line[i]) != std::string_view::npos) {
        ++i;
      } else if (line[i] == '#') {
        return;
      } else if (line[i] == '"') {
        i = ReadQuoted(line, i + 1);
      } else {
        const std::size_t end = std::min(line.find_first_of(" \t\r\f\v#\"", i), line.size());
        words_.push_back({std::string(line.substr(i, end - i)), false});
        i = end;
      }
    }
  }

  // Returns the index after the closing quote.
  std::size_t ReadQuoted(std::string_view line, std::size_t i) {
    Word word{{}, true};
    for (; i < line.size() && line[i] != '"'; ++i) {
      if (line[i] != '\\') {
        word.text += line[i];
        continue;
      }
      const char escaped = ++i < line.size() ? line[i] : '\0';
      if (escaped != '"' && escaped != '\\' && escaped != 'n') Fail("expected \", \\ or n after a backslash");
      word.text += escaped == 'n' ? '\n' : escaped;
    }
    if (i >= line.size()) Fail("a double quote is not closed");
    words_.push_back(std::move(word));
    return i + 1;
  }

  std::string where_;
  std::vector<Word> words_;
  std::size_t next_ = 0;
};

Command ParseMap(LineReader* line) {
  if (line->TakeIf("new")) return NewMap{line->TakeName("a map's name")};
  if (line->TakeIf("stop")) return StopMap{};
  if (line->TakeIf("use")) return UseMap{line->TakeName("a map's name")};
  if (line->TakeIf("rename")) {
    const std::string name = line->TakeName("a map's name");
    return RenameMap{name, line->TakeName("a new name")};
  }
  if (line->TakeIf("remove")) return RemoveMap{line->TakeName("a map's name")};
  if (line->TakeIf("policy")) {
    SetPolicy command;
    command.name = line->TakeName("a map's name");
    const std::string& word = line->Take("a policy");
    const std::optional<maps::Policy> policy = maps::ParsePolicy(word);
    if (!policy) line->Fail("unknown policy '" + word + "'; use open, bounded, augment-only or read-only");
    command.policy = *policy;
    return command;
  }
  const std::string word = line->Take("new, stop, use, policy, rename or remove");
  line->Fail("unknown command 'map " + word + "'; use new, stop, use, policy, rename or remove after map");
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
    if (line->TakeIf("pixel")) {
      const double u = line->TakeNumber("a pixel's column");
      pair.pixel = {u, line->TakeItemNumber("a pixel's row", &last)};
    } else {
      for (const int axis : {0, 1}) pair.in_map[axis] = line->TakeNumber("X Y Z in map units");
      pair.in_map[2] = line->TakeItemNumber("X Y Z in map units", &last);
    }
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

Command ParsePaste(LineReader* line) {
  PasteEntities command;
  command.names = ParseNames(line, "from");
  command.from_map = line->TakeName("'from' and a map's name");
  if (line->TakeIf("at")) command.to_pixel = line->TakePixel();
  return command;
}

// The commands that name models and signposts; empty for another command.
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
  if (line->TakeIf("text")) {
    const std::string name = line->TakeName("a name");
    return SetEntityText{name, line->TakeName("a text")};
  }
  if (line->TakeIf("target")) return ParseTarget(line);
  if (line->TakeIf("lock")) return ParseFlag(line, EntityFlag::kLocked, true);
  if (line->TakeIf("unlock")) return ParseFlag(line, EntityFlag::kLocked, false);
  if (line->TakeIf("hide")) return ParseFlag(line, EntityFlag::kHidden, true);
  if (line->TakeIf("show")) return ParseFlag(line, EntityFlag::kHidden, false);
  if (line->TakeIf("group")) return ParseGroup(line);
  if (line->TakeIf("ungroup")) return GroupEntities{ParseNames(line), ""};
  if (line->TakeIf("paste")) return ParsePaste(line);
  return std::nullopt;
}

Command ParseCommand(LineReader* line) {
  if (line->TakeIf("map")) return ParseMap(line);
  if (line->TakeIf("place")) return ParsePlace(line);
  if (line->TakeIf("signpost")) return ParseSignpost(line);
  if (auto edit = ParseEdit(line)) return *std::move(edit);
  if (line->TakeIf("undo")) return Undo{};
  if (line->TakeIf("redo")) return Redo{};
  if (line->TakeIf("save")) return Save{};
  const std::string word = line->Take("a command");
  line->Fail("unknown command '" + word + "'");
}

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

std::string Number(double value) {
  return FormatNumber(value, 17);
}
std::string Pixel(const Eigen::Vector2d& pixel) {
  return "pixel " + Number(pixel.x()) + ' ' + Number(pixel.y());
}

std::string Names(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += ' ' + AlwaysQuoted(name);
  return text;
}

std::string Point(const Eigen::Vector3d& point) {
  return Number(point.x()) + ' ' + Number(point.y()) + ' ' + Number(point.z());
}

std::string Pairs(const std::vector<PointPair>& pairs) {
  std::string text;
  for (const PointPair& pair : pairs) {
    text += (text.empty() ? " " : ", ") + Point(pair.in_model) + " to " +
            (pair.pixel ? Pixel(*pair.pixel) : Point(pair.in_map));
  }
  return text;
}

struct Formatter {
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
  std::string operator()(const PlaceModel& c) const {
    return "place " + Quoted(c.file) + " at " + Pixel(c.pixel) +
           (c.scale ? " scale " + Number(*c.scale) : "") +
           (c.yaw_deg != 0 ? " yaw " + Number(c.yaw_deg) : "");
  }
  std::string operator()(const PlaceSignpost& c) const {
    return "signpost " + AlwaysQuoted(c.text) + " at " + Pixel(c.pixel) +
           (c.to_map.empty() ? "" : " to " + AlwaysQuoted(c.to_map));
  }
  std::string operator()(const MoveEntity& c) const {
    const std::string begin = "move " + Quoted(c.name) + ' ';
    if (c.to_pixel) return begin + "to " + Pixel(*c.to_pixel);
    return begin + Number(c.by_in_map.x()) + ' ' + Number(c.by_in_map.y()) + ' ' + Number(c.by_in_map.z());
  }
  std::string operator()(const RotateEntity& c) const {
    return "rotate " + Quoted(c.name) + ' ' + Number(c.angle_deg);
  }
  std::string operator()(const ScaleEntity& c) const {
    return "scale " + Quoted(c.name) + ' ' + Number(c.factor);
  }
  std::string operator()(const TransformEntities& c) const {
    std::string text = "transform";
    for (const auto& [name, pose] : c.poses) {
      text += (&name == &c.poses.front().name ? " " : ", ") + Quoted(name);
      for (const double value : pose.translation) text += ' ' + Number(value);
      const Eigen::Vector4d quaternion = Settled(pose.rotation).quaternion().coeffs();
      for (const double value : quaternion) text += ' ' + Number(value);
      text += ' ' + Number(pose.scale);
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
    return "text " + AlwaysQuoted(c.name) + ' ' + AlwaysQuoted(c.text);
  }
  std::string operator()(const SetSignpostTarget& c) const {
    return "target " + AlwaysQuoted(c.name) + (c.to_map.empty() ? "" : ' ' + AlwaysQuoted(c.to_map));
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
  std::string operator()(const Undo&) const { return "undo"; }
  std::string operator()(const Redo&) const { return "redo"; }
  std::string operator()(const Save&) const { return "save"; }
};

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

std::string FormatCommand(const Command& command) {
  return std::visit(Formatter{}, command);
}

std::string FormatScriptLine(const TimedCommand& command) {
  std::string seconds = FormatSeconds(command.time);
  seconds.erase(seconds.find_last_not_of('0') + 1);  // "12.5" is easier to read than "12.500000000"
  if (seconds.ends_with('.')) seconds.pop_back();
  return seconds + ' ' + FormatCommand(command.command);
}

}  // namespace docent::app
