// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "content/gltf/json.h"
#include "content/scene.h"

namespace docent::content {

// Reads the members of one JSON object that was written to a library. Each function throws Error, which names
// the place, where a member is missing or is not what is asked for. Single thread; refers to the object.
class ObjectReader {
 public:
  ObjectReader(std::string_view where, std::string place, const Json& object)
      : where_(where), place_(std::move(place)), object_(object) {
    if (!object.is_object()) Refuse(where_, place_, "is not a JSON object.");
  }

  const Json& Member(const char* name) const {
    const auto found = object_.find(name);
    if (found == object_.end()) Refuse(where_, place_, "has no " + std::string(name) + ".");
    return *found;
  }

  std::string Text(const char* name) const {
    const Json& value = Member(name);
    if (!value.is_string() || value.get_ref<const std::string&>().size() > kMaxTextBytes) {
      Refuse(where_, PlaceOfMember(name),
             "is not a string of at most " + std::to_string(kMaxTextBytes) + " bytes.");
    }
    return value.get<std::string>();
  }

  // The member may be missing. Languages and lengths are left to Validate (scene.h).
  Translations TextByLanguage(const char* name) const {
    Translations translations;
    const auto found = object_.find(name);
    if (found == object_.end()) return translations;
    if (!found->is_object()) Refuse(where_, PlaceOfMember(name), "is not a JSON object.");
    for (const auto& [language, text] : found->items()) {
      if (!text.is_string()) Refuse(where_, PlaceOfMember(name), "has a text that is not a string.");
      translations.emplace(language, text.get<std::string>());
    }
    return translations;
  }

  bool Truth(const char* name) const {
    const Json& value = Member(name);
    if (!value.is_boolean()) Refuse(where_, PlaceOfMember(name), "is neither true nor false.");
    return value.get<bool>();
  }

  std::uint64_t Key(const char* name) const {
    const Json& value = Member(name);
    if (!value.is_number_unsigned()) Refuse(where_, PlaceOfMember(name), "is not the key of a map.");
    return value.get<std::uint64_t>();
  }

  double Number(const char* name, double least, double most) const {
    return AsNumber(Member(name), PlaceOfMember(name), least, most);
  }

  template <int N>
  Eigen::Matrix<double, N, 1> Vector(const char* name, double most) const {
    const Json& value = Member(name);
    const std::string place = PlaceOfMember(name);
    if (!value.is_array() || value.size() != N)
      Refuse(where_, place, "is not a list of " + std::to_string(N) + " numbers.");
    Eigen::Matrix<double, N, 1> vector;
    for (int k = 0; k < N; ++k) vector[k] = AsNumber(value[static_cast<std::size_t>(k)], place, -most, most);
    return vector;
  }

  // Reads a list of at most `limit` vectors.
  template <int N = 3>
  std::vector<Eigen::Matrix<double, N, 1>> Vectors(const char* name, std::size_t limit, double most) const {
    const Json& value = Member(name);
    const std::string place = PlaceOfMember(name);
    if (!value.is_array() || value.size() > limit)
      Refuse(where_, place, "is not a list of at most " + std::to_string(limit) + " points.");
    std::vector<Eigen::Matrix<double, N, 1>> vectors;
    for (const Json& point : value) {
      if (!point.is_array() || point.size() != N) Refuse(where_, place, "is not a list of points.");
      Eigen::Matrix<double, N, 1>& vector = vectors.emplace_back();
      for (int k = 0; k < N; ++k)
        vector[k] = AsNumber(point[static_cast<std::size_t>(k)], place, -most, most);
    }
    return vectors;
  }

  // Reads a vector that must have length 1, up to rounding.
  template <int N>
  Eigen::Matrix<double, N, 1> UnitVector(const char* name) const {
    const Eigen::Matrix<double, N, 1> vector = Vector<N>(name, 2);
    if (std::abs(vector.norm() - 1) > 1e-3) Refuse(where_, PlaceOfMember(name), "does not have length 1.");
    return vector;
  }

 private:
  std::string PlaceOfMember(const char* name) const { return place_ + "." + name; }

  double AsNumber(const Json& value, const std::string& place, double least, double most) const {
    const double number = value.is_number() ? value.get<double>() : std::nan("");
    if (!(number >= least && number <= most)) Refuse(where_, place, "is not a number in its range.");
    return number;
  }

  std::string_view where_;
  std::string place_;
  const Json& object_;
};

}  // namespace docent::content
