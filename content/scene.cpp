// SPDX-License-Identifier: Apache-2.0
#include "content/scene.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

namespace docent::content {

const char* NameOf(Entity::Kind kind) {
  switch (kind) {
    case Entity::Kind::kModel:
      return "model";
    case Entity::Kind::kSignpost:
      return "signpost";
    case Entity::Kind::kLabel:
      return "label";
    case Entity::Kind::kImage:
      return "image";
    case Entity::Kind::kSound:
      return "sound";
    case Entity::Kind::kTrail:
      return "trail";
    case Entity::Kind::kOccluder:
      return "occluder";
  }
  return "";
}

bool HasModel(const Entity& entity) {
  return entity.kind == Entity::Kind::kModel || entity.kind == Entity::Kind::kImage;
}

std::shared_ptr<const Asset> AssetOf(const Entity& entity) {
  if (HasModel(entity)) return entity.model.asset;
  return entity.kind == Entity::Kind::kSound ? entity.sound.asset : nullptr;
}

const std::string* TextOf(const Entity& entity) {
  if (entity.kind == Entity::Kind::kSignpost) return &entity.signpost.text;
  if (entity.kind == Entity::Kind::kLabel) return &entity.label.text;
  return entity.kind == Entity::Kind::kSound ? &entity.sound.caption : nullptr;
}

std::string* TextOf(Entity* entity) {
  return const_cast<std::string*>(TextOf(std::as_const(*entity)));
}

const Translations* TranslationsOf(const Entity& entity) {
  if (entity.kind == Entity::Kind::kSignpost) return &entity.signpost.translations;
  if (entity.kind == Entity::Kind::kLabel) return &entity.label.translations;
  return entity.kind == Entity::Kind::kSound ? &entity.sound.translations : nullptr;
}

Translations* TranslationsOf(Entity* entity) {
  return const_cast<Translations*>(TranslationsOf(std::as_const(*entity)));
}

const std::string& ShownText(const Entity& entity, const std::string& language) {
  static const std::string kNoText;
  const std::string* const text = TextOf(entity);
  return text != nullptr ? TextFor(language, *text, *TranslationsOf(entity)) : kNoText;
}

std::set<std::string> LanguagesOf(const Scene& scene) {
  std::set<std::string> languages;
  for (const Entity& entity : scene.entities) {
    const Translations* const translations = TranslationsOf(entity);
    if (translations == nullptr) continue;
    for (const auto& [language, text] : *translations) languages.insert(language);
  }
  return languages;
}

std::vector<std::string> MissingLanguages(const Entity& entity, const std::set<std::string>& languages) {
  const std::string* const text = TextOf(entity);
  std::vector<std::string> missing;
  if (text == nullptr || text->empty()) return missing;
  for (const std::string& language : languages) {
    if (!HasVariant(language, *TranslationsOf(entity))) missing.push_back(language);
  }
  return missing;
}

const Entity* Scene::Find(const std::string& name) const {
  const auto found = std::find_if(entities.begin(), entities.end(),
                                  [&](const Entity& entity) { return entity.name == name; });
  return found == entities.end() ? nullptr : &*found;
}

std::string Scene::FreeName(const std::string& base) const {
  if (Find(base) == nullptr) return base;
  for (int number = 2;; ++number) {
    const std::string name = base + "-" + std::to_string(number);
    if (Find(name) == nullptr) return name;
  }
}

std::string Scene::FreeNumberedName(const std::string& base) const {
  for (int number = 1;; ++number) {
    const std::string name = base + "-" + std::to_string(number);
    if (Find(name) == nullptr) return name;
  }
}

std::string NameFromFile(const std::filesystem::path& file) {
  const nlohmann::json stem(file.stem().string());
  return nlohmann::json::parse(stem.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace))
      .get<std::string>();
}

}  // namespace docent::content
