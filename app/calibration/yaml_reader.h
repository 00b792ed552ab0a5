// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <yaml-cpp/yaml.h>

#include <optional>
#include <string>
#include <vector>

namespace docent::app {

// One map of a YAML file, with getters that name file and field when something is wrong. Holds no reference
// to the text. Every number it gives out is finite.
class YamlReader {
 public:
  // Throws Error when the text is no YAML map. OpenCV's `%YAML:1.0` line and `!!opencv-matrix` tags are
  // taken.
  YamlReader(const std::string& text, std::string name);

  const std::string& name() const { return name_; }
  bool Has(const std::string& field) const { return static_cast<bool>(Find(field)); }

  // Throw Error when the field is missing or of another kind.
  double Number(const std::string& field) const;
  int Integer(const std::string& field) const;
  std::string Text(const std::string& field) const;
  // A list of numbers, or a matrix (a map with `data`) read row by row; at most 64 of them.
  std::vector<double> Numbers(const std::string& field) const;

  // The fallback when the field is missing; still an Error when it is there and no number.
  double NumberOr(const std::string& field, double fallback) const;
  std::string TextOr(const std::string& field, const std::string& fallback) const;

  // The first of these fields that is there, or empty.
  std::string FirstOf(std::initializer_list<const char*> fields) const;

 private:
  YAML::Node Find(const std::string& field) const;
  YAML::Node Need(const std::string& field) const;
  double ToNumber(const YAML::Node& node, const std::string& field) const;

  std::string name_;
  YAML::Node root_;
};

}  // namespace docent::app
