// SPDX-License-Identifier: Apache-2.0
#include "content/gltf/schema.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "content/gltf/schema_tables.h"

namespace docent::content {
namespace {

class Checker {
 public:
  Checker(std::string_view file, const Json& root) : file_(file), root_(root) {}

  void CheckObject(const Json& object, const Schema& schema, const std::string& place) const {
    if (!object.is_object()) Refuse(file_, place, "is not a JSON object.");
    for (const Field& field : schema.fields) {
      const auto member = object.find(field.name);
      if (member == object.end()) {
        if (field.required) Refuse(file_, place, "has no " + std::string(field.name) + ".");
        continue;
      }
      CheckMember(*member, field, Join(place, field.name));
    }
  }

 private:
  static std::string Join(const std::string& place, std::string_view name) {
    return place.empty() ? std::string(name) : place + "." + std::string(name);
  }

  void CheckMember(const Json& value, const Field& field, const std::string& place) const {
    if (!field.list) {
      CheckValue(value, field, place);
      return;
    }
    if (!value.is_array()) Refuse(file_, place, "is not an array.");
    if (value.size() < field.min_count || value.size() > field.max_count) {
      Refuse(file_, place, "has " + std::to_string(value.size()) + " entries.");
    }
    for (std::size_t i = 0; i < value.size(); ++i) CheckValue(value[i], field, Place(place, i));
    if (field.distinct) CheckDistinct(value, place);
  }

  void CheckValue(const Json& value, const Field& field, const std::string& place) const {
    switch (field.kind) {
      case Field::Kind::kBoolean:
        if (!value.is_boolean()) Refuse(file_, place, "is neither true nor false.");
        break;
      case Field::Kind::kString:
        CheckString(value, field, place);
        break;
      case Field::Kind::kInteger:
      case Field::Kind::kNumber:
        CheckNumber(value, field, place);
        break;
      case Field::Kind::kIndex:
        CheckIndex(value, field, place);
        break;
      case Field::Kind::kIndexMap:
        CheckIndexMap(value, field, place);
        break;
      case Field::Kind::kObject:
        CheckObject(value, *field.schema, place);
        break;
    }
  }

  void CheckString(const Json& value, const Field& field, const std::string& place) const {
    if (!value.is_string()) Refuse(file_, place, "is not a string.");
    const std::string& text = value.get_ref<const std::string&>();
    if (!field.words.empty() &&
        std::find(field.words.begin(), field.words.end(), text) == field.words.end()) {
      Refuse(file_, place, "is \"" + text.substr(0, 40) + "\", which is not valid in glTF 2.0.");
    }
  }

  void CheckNumber(const Json& value, const Field& field, const std::string& place) const {
    if (!value.is_number()) Refuse(file_, place, "is not a number.");
    const double number = value.get<double>();
    if (!(std::abs(number) <= std::numeric_limits<float>::max())) Refuse(file_, place, "is too large.");
    if (field.kind == Field::Kind::kInteger) {
      if (number != std::floor(number)) Refuse(file_, place, "is not an integer.");
      // Beyond 2^53 the comparison below would use a rounded number.
      if (std::abs(number) > 9e15) Refuse(file_, place, "is too large.");
    }
    const bool known = field.codes.empty() || std::any_of(field.codes.begin(), field.codes.end(),
                                                          [&](int code) { return code == number; });
    if (!known || number < field.min || number > field.max) {
      Refuse(file_, place, "is " + value.dump() + ", which is out of range.");
    }
  }

  void CheckIndex(const Json& value, const Field& field, const std::string& place) const {
    const double number = value.is_number() ? value.get<double>() : -1;
    if (number < 0 || number != std::floor(number)) Refuse(file_, place, "is not an index.");
    const std::size_t count = CountOf(root_, field.target);
    if (number >= static_cast<double>(count)) {
      Refuse(file_, place,
             "is " + value.dump() + ", and the file has " + std::to_string(count) + " " + field.target + ".");
    }
  }

  void CheckIndexMap(const Json& value, const Field& field, const std::string& place) const {
    if (!value.is_object()) Refuse(file_, place, "is not a JSON object.");
    if (value.size() < field.min_count) Refuse(file_, place, "is empty.");
    for (const auto& [name, index] : value.items()) CheckIndex(index, field, Join(place, name.substr(0, 40)));
  }

  void CheckDistinct(const Json& value, const std::string& place) const {
    std::vector<Json> sorted(value.begin(), value.end());
    std::sort(sorted.begin(), sorted.end());
    if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end()) {
      Refuse(file_, place, "contains an entry twice.");
    }
  }

  std::string_view file_;
  const Json& root_;
};

}  // namespace

void CheckSchema(std::string_view file, const Json& root) {
  Checker(file, root).CheckObject(root, RootSchema(), "");
}

}  // namespace docent::content
