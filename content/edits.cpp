// SPDX-License-Identifier: Apache-2.0
#include "content/edits.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "engine/base/error.h"

namespace docent::content {
namespace {

// Returns the index of the entity with this name; throws Error when there is none.
std::size_t IndexOf(const Scene& scene, const std::string& name) {
  const Entity* found = scene.Find(name);
  if (found == nullptr) throw Error("There is no '" + name + "' in this map.");
  return static_cast<std::size_t>(found - scene.entities.data());
}

class Add : public Edit {
 public:
  explicit Add(Entity entity) : entity_(std::move(entity)) {}

  void Apply(Scene* scene) override {
    if (scene->Find(entity_.name) != nullptr)
      throw Error("There is already a '" + entity_.name + "' in this map.");
    scene->entities.push_back(entity_);
  }
  void Undo(Scene* scene) override {
    scene->entities.erase(scene->entities.begin() +
                          static_cast<std::ptrdiff_t>(IndexOf(*scene, entity_.name)));
  }
  void MoveWithAnchor(const std::string& name, const engine::Sim3& motion) override {
    if (name == entity_.name) content::MoveWithAnchor(motion, &entity_);
  }

 private:
  Entity entity_;
};

// An edit that changes one entity in place. Undo restores the previous entity.
class ChangeEdit : public Edit {
 public:
  explicit ChangeEdit(std::string name) : name_(std::move(name)) {}

  void Apply(Scene* scene) final {
    Entity& entity = scene->entities[IndexOf(*scene, name_)];
    Entity changed = entity;
    Change(&changed);
    before_ = std::exchange(entity, std::move(changed));
  }
  void Undo(Scene* scene) final { scene->entities[IndexOf(*scene, name_)] = before_; }
  void MoveWithAnchor(const std::string& name, const engine::Sim3& motion) final {
    if (name != name_) return;
    content::MoveWithAnchor(motion, &before_);
    MoveTarget(motion);
  }

 protected:
  // Transforms the edit's target position in the map, if it has one.
  virtual void MoveTarget(const engine::Sim3& /*motion*/) {}
  // May throw, because it works on a copy.
  virtual void Change(Entity* entity) = 0;
  const std::string& name() const { return name_; }

 private:
  std::string name_;
  Entity before_;
};

class Move : public ChangeEdit {
 public:
  Move(std::string name, const Eigen::Vector3d& position)
      : ChangeEdit(std::move(name)), position_(position) {}

 protected:
  void Change(Entity* entity) override {
    if (entity->kind == Entity::Kind::kModel) {
      entity->model.map_from_model.translation = position_;
    } else {
      entity->signpost.anchor = position_;
    }
  }
  void MoveTarget(const engine::Sim3& motion) override { position_ = motion * position_; }

 private:
  Eigen::Vector3d position_;
};

class Rotate : public ChangeEdit {
 public:
  Rotate(std::string name, double angle_deg) : ChangeEdit(std::move(name)), angle_deg_(angle_deg) {}

 protected:
  void Change(Entity* entity) override {
    if (!(std::abs(angle_deg_) <= kMaxAngle_deg))
      throw Error("'" + name() + "' cannot be rotated: the angle must be at most " +
                  std::to_string(std::lround(kMaxAngle_deg)) + " degrees.");
    if (entity->kind != Entity::Kind::kModel) {
      throw Error("'" + name() + "' is a signpost, which always faces the reader and cannot be rotated.");
    }
    const Eigen::Vector3d turn = Eigen::Vector3d::UnitY() * (angle_deg_ * std::numbers::pi / 180);
    engine::Rotation3& rotation = entity->model.map_from_model.rotation;
    rotation = rotation * engine::Rotation3::Exp(turn);
  }

 private:
  double angle_deg_;
};

class Scale : public ChangeEdit {
 public:
  Scale(std::string name, double factor) : ChangeEdit(std::move(name)), factor_(factor) {}

 protected:
  void Change(Entity* entity) override {
    double& size =
        entity->kind == Entity::Kind::kModel ? entity->model.map_from_model.scale : entity->signpost.height_m;
    size *= factor_;
  }

 private:
  double factor_;
};

class Remove : public Edit {
 public:
  explicit Remove(std::string name) : name_(std::move(name)) {}

  void Apply(Scene* scene) override {
    index_ = IndexOf(*scene, name_);
    entity_ = std::move(scene->entities[index_]);
    scene->entities.erase(scene->entities.begin() + static_cast<std::ptrdiff_t>(index_));
  }
  void Undo(Scene* scene) override {
    scene->entities.insert(scene->entities.begin() + static_cast<std::ptrdiff_t>(index_), entity_);
  }
  void MoveWithAnchor(const std::string& name, const engine::Sim3& motion) override {
    if (name == name_) content::MoveWithAnchor(motion, &entity_);
  }

 private:
  std::string name_;
  std::size_t index_ = 0;
  Entity entity_;
};

}  // namespace

std::unique_ptr<Edit> AddEdit(Entity entity) {
  return std::make_unique<Add>(std::move(entity));
}
std::unique_ptr<Edit> MoveEdit(std::string name, const Eigen::Vector3d& position_in_map) {
  return std::make_unique<Move>(std::move(name), position_in_map);
}
std::unique_ptr<Edit> RotateEdit(std::string name, double angle_deg) {
  return std::make_unique<Rotate>(std::move(name), angle_deg);
}
std::unique_ptr<Edit> ScaleEdit(std::string name, double factor) {
  return std::make_unique<Scale>(std::move(name), factor);
}
std::unique_ptr<Edit> RemoveEdit(std::string name) {
  return std::make_unique<Remove>(std::move(name));
}

void ApplyChecked(Edit* edit, Scene* scene) {
  edit->Apply(scene);
  const std::string problem = Validate(*scene);
  if (problem.empty()) return;
  edit->Undo(scene);
  throw Error(problem);
}

void EditHistory::Do(std::unique_ptr<Edit> edit, Scene* scene) {
  ApplyChecked(edit.get(), scene);
  done_.push_back(std::move(edit));
  undone_.clear();
}

bool EditHistory::Undo(Scene* scene) {
  if (done_.empty()) return false;
  done_.back()->Undo(scene);
  undone_.push_back(std::move(done_.back()));
  done_.pop_back();
  return true;
}

bool EditHistory::Redo(Scene* scene) {
  if (undone_.empty()) return false;
  ApplyChecked(undone_.back().get(), scene);
  done_.push_back(std::move(undone_.back()));
  undone_.pop_back();
  return true;
}

void EditHistory::MoveWithAnchor(const std::string& name, const engine::Sim3& motion) {
  for (auto* edits : {&done_, &undone_}) {
    for (const std::unique_ptr<Edit>& edit : *edits) edit->MoveWithAnchor(name, motion);
  }
}

}  // namespace docent::content
