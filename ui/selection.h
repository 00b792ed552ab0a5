// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "content/scene.h"

namespace docent::ui {

// The selected entities of a scene, by name, in the order in which they were selected. One thread.
class Selection {
 public:
  bool empty() const { return names_.empty(); }
  const std::vector<std::string>& names() const { return names_; }
  bool Contains(const std::string& name) const {
    return std::find(names_.begin(), names_.end(), name) != names_.end();
  }
  void Clear() { names_.clear(); }
  // Selects one entity alone; with `add`, adds it to the others or takes it from them.
  void Select(const std::string& name, bool add) {
    if (!add) {
      names_ = {name};
    } else if (std::erase(names_, name) == 0) {
      names_.push_back(name);
    }
  }
  void Set(std::vector<std::string> names) { names_ = std::move(names); }
  void Rename(const std::string& name, const std::string& new_name) {
    std::replace(names_.begin(), names_.end(), name, new_name);
  }
  // Removes names that the scene does not have; all, without a scene.
  void KeepExisting(const content::Scene* scene) {
    std::erase_if(names_,
                  [&](const std::string& name) { return scene == nullptr || scene->Find(name) == nullptr; });
  }

 private:
  std::vector<std::string> names_;
};

}  // namespace docent::ui
