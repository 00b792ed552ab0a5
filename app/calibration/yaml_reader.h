// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <yaml-cpp/yaml.h>

#include <optional>
#include <string>
#include <vector>

namespace docent::app {

// Reads one YAML map. Its errors name the file and the field. It keeps no reference to the text, and every
// number it returns is finite.
class YamlReader {
 public:
  // Throws Error when the text is not a YAML map. OpenCV's `%YAML:1.0` line and `!!opencv-matrix` tags are
  // accepted.
  YamlReader(const std::string& text, std::string name);

  const std::string& name() const { return name_; }
  bool Has(const std::string& field) const { return static_cast<bool>(Find(field)); }

  // These throw Error when the field is missing or has another type.
  double Number(const std::string& field) const;
  int Integer(const std::string& field) const;
  std::string Text(const std::string& field) const;
  // A list of numbers, or a matrix (a map with `data`) row by row; at most 64 numbers.
  std::vector<double> Numbers(const std::string& field) const;

  // Return the fallback when the field is missing, but still throw Error when it has another type.
  double NumberOr(const std::string& field, double fallback) const;
  std::string TextOr(const std::string& field, const std::string& fallback) const;

  // The first of these fields that exists, or empty.
  std::string FirstOf(std::initializer_list<const char*> fields) const;

 private:
  YAML::Node Find(const std::string& field) const;
  YAML::Node Need(const std::string& field) const;
  double ToNumber(const YAML::Node& node, const std::string& field) const;

  std::string name_;
  YAML::Node root_;
};

}  // namespace docent::app
