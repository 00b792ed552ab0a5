// SPDX-License-Identifier: Apache-2.0
#include "app/calibration/yaml_reader.h"

#include <cmath>

#include "app/files/text_file.h"
#include "engine/base/error.h"

namespace docent::app {

namespace {

// yaml-cpp parses nested lists recursively, so a file of brackets could exhaust the stack. No calibration
// nests deeper than this.
constexpr int kMaxDepth = 32;
constexpr std::size_t kMaxIndent = 256;

// OpenCV's `%YAML:1.0` is not a directive of the YAML standard, so all lines that begin with % are removed.
std::string WithoutDirectives(const std::string& text) {
  std::string result;
  std::size_t begin = text.starts_with("\xEF\xBB\xBF") ? 3 : 0;
  while (begin < text.size()) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    if (text[begin] != '%') result.append(text, begin, end - begin);
    result += '\n';
    begin = end + 1;
  }
  return result;
}

bool IsDeep(const std::string& text) {
  int depth = 0;
  std::size_t leading = 0;
  bool at_start = true;
  for (const char c : text) {
    if (c == '[' || c == '{') {
      if (++depth > kMaxDepth) return true;
    } else if (c == ']' || c == '}') {
      depth = std::max(0, depth - 1);
    }
    if (c == '\n') {
      at_start = true;
      leading = 0;
    } else if (at_start) {
      // Block nesting is indentation, or a chain of "- - -" or "? ? ?".
      if (c == ' ' || c == '-' || c == '?' || c == ':' || c == '\t') {
        if (++leading > kMaxIndent) return depth == 0;
      } else {
        at_start = false;
      }
    }
  }
  return false;
}

}  // namespace

YamlReader::YamlReader(const std::string& text, std::string name) : name_(std::move(name)) {
  const std::string clean = WithoutDirectives(text);
  if (IsDeep(clean)) throw Error(name_ + " is nested too deeply for a calibration.");
  try {
    root_ = YAML::Load(clean);
  } catch (const YAML::Exception& error) {
    throw Error(name_ + (error.mark.is_null() ? "" : ", line " + std::to_string(error.mark.line + 1)) +
                " is not valid YAML: " + error.msg + ".");
  }
  if (!root_.IsMap()) throw Error(name_ + " is not a calibration; expected lines such as 'fx: 525'.");
}

YAML::Node YamlReader::Find(const std::string& field) const {
  for (const auto& entry : root_) {
    if (entry.first.IsScalar() && entry.first.Scalar() == field) return entry.second;
  }
  return YAML::Node(YAML::NodeType::Undefined);
}

YAML::Node YamlReader::Need(const std::string& field) const {
  YAML::Node node = Find(field);
  if (!node) throw Error(name_ + " has no field '" + field + "'.");
  return node;
}

double YamlReader::ToNumber(const YAML::Node& node, const std::string& field) const {
  const auto value = node.IsScalar() ? ParseNumber(Trim(node.Scalar())) : std::nullopt;
  if (!value) throw Error(name_ + ": the field '" + field + "' is not a finite number.");
  return *value;
}

double YamlReader::Number(const std::string& field) const {
  return ToNumber(Need(field), field);
}

int YamlReader::Integer(const std::string& field) const {
  const double value = Number(field);
  if (value != std::floor(value) || std::abs(value) > 1e9) {
    throw Error(name_ + ": the field '" + field + "' is not a whole number.");
  }
  return static_cast<int>(value);
}

std::string YamlReader::Text(const std::string& field) const {
  const YAML::Node node = Need(field);
  if (!node.IsScalar()) throw Error(name_ + ": the field '" + field + "' is not a text.");
  return node.Scalar();
}

std::vector<double> YamlReader::Numbers(const std::string& field) const {
  constexpr std::size_t kMaxCount = 64;
  YAML::Node node = Need(field);
  if (node.IsMap()) {
    YAML::Node data(YAML::NodeType::Undefined);
    for (const auto& entry : node) {
      if (entry.first.IsScalar() && entry.first.Scalar() == "data") data.reset(entry.second);
    }
    node.reset(data);
  }
  if (!node || !node.IsSequence())
    throw Error(name_ + ": the field '" + field + "' is not a list of numbers.");
  if (node.size() > kMaxCount) throw Error(name_ + ": the field '" + field + "' is too long.");
  std::vector<double> values;
  for (const auto& entry : node) values.push_back(ToNumber(entry, field));
  return values;
}

double YamlReader::NumberOr(const std::string& field, double fallback) const {
  return Has(field) ? Number(field) : fallback;
}

std::string YamlReader::TextOr(const std::string& field, const std::string& fallback) const {
  return Has(field) ? Text(field) : fallback;
}

std::string YamlReader::FirstOf(std::initializer_list<const char*> fields) const {
  for (const char* field : fields) {
    if (Has(field)) return field;
  }
  return {};
}

}  // namespace docent::app
