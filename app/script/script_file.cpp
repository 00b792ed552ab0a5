// SPDX-License-Identifier: Apache-2.0
#include "app/script/script_file.h"

#include <algorithm>

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
  if (line->TakeIf("policy")) {
    SetPolicy command;
    command.name = line->TakeName("a map's name");
    const std::string& word = line->Take("a policy");
    const std::optional<maps::Policy> policy = maps::ParsePolicy(word);
    if (!policy) line->Fail("unknown policy '" + word + "'; use open, bounded, augment-only or read-only");
    command.policy = *policy;
    return command;
  }
  const std::string word = line->Take("new, stop, use or policy");
  line->Fail("unknown command 'map " + word + "'; use map new, map stop, map use or map policy");
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

Command ParseCommand(LineReader* line) {
  if (line->TakeIf("map")) return ParseMap(line);
  if (line->TakeIf("place")) return ParsePlace(line);
  if (line->TakeIf("signpost")) return ParseSignpost(line);
  if (line->TakeIf("move")) return ParseMove(line);
  if (line->TakeIf("rotate")) return ParseRotate(line);
  if (line->TakeIf("scale")) return ParseScale(line);
  if (line->TakeIf("remove")) return RemoveEntity{line->TakeName("a name")};
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

struct Formatter {
  std::string operator()(const NewMap& c) const { return "map new " + AlwaysQuoted(c.name); }
  std::string operator()(const StopMap&) const { return "map stop"; }
  std::string operator()(const UseMap& c) const { return "map use " + AlwaysQuoted(c.name); }
  std::string operator()(const SetPolicy& c) const {
    return "map policy " + AlwaysQuoted(c.name) + ' ' + maps::ToString(c.policy);
  }
  std::string operator()(const PlaceModel& c) const {
    return "place " + Quoted(c.file) + " at " + Pixel(c.pixel) +
           (c.scale != 1 ? " scale " + Number(c.scale) : "") +
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
  std::string operator()(const RemoveEntity& c) const { return "remove " + Quoted(c.name); }
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
