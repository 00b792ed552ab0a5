// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/placing_ghost.h"

#include <numbers>
#include <utility>

#include "app/command_line/placing_tool.h"
#include "app/session/file_kind.h"
#include "app/session/map_axes.h"
#include "app/session/new_entities.h"
#include "app/session/session_options.h"
#include "app/session/surface_at_pixel.h"
#include "content/asset.h"
#include "content/placement.h"
#include "engine/base/error.h"
#include "ui/strings.h"

namespace docent::app {

std::shared_ptr<const content::Asset> ModelPreviews::Get(const std::string& file) {
  if (file.empty()) return nullptr;
  std::filesystem::path path = folder_ / file;
  std::error_code error;
  if (!std::filesystem::exists(path, error)) path = file;
  const FileStamp stamp = StampOf(path);
  std::shared_ptr<const content::Asset> before;
  {
    const std::scoped_lock lock(mutex_);
    if (const auto found = read_.find(file); found != read_.end()) {
      before = found->second.asset;
      if (found->second.stamp == stamp) return before;
    }
  }
  if (worker_ && !worker_->finished()) return before;
  worker_.emplace("model preview", [this, file, path, stamp](const std::stop_token&) {
    Read read;
    read.stamp = stamp;
    try {
      const content::AssetKind kind = KindOfFile(path);
      read.asset =
          std::make_shared<content::Asset>(kind == content::AssetKind::kImage   ? content::ImportImage(path)
                                           : kind == content::AssetKind::kSound ? content::ImportSound(path)
                                                                                : content::ImportAsset(path));
    } catch (const Error&) {
      // The command that places it says why.
    }
    const std::scoped_lock lock(mutex_);
    read_[file] = std::move(read);
  });
  return before;
}

namespace {

// Puts an entity that has what the tool needs to its place.
content::Entity GhostAt(const content::Entity& begun, const ui::AuthoringChoices& choices,
                        const content::SurfaceHit& hit, const Eigen::Vector3d& viewer,
                        const content::MapSettings& settings, const Eigen::Vector3d& up,
                        const std::optional<Eigen::Vector3d>& trail_end) {
  const double distance = (hit.point - viewer).norm();
  content::Entity entity = begun;
  switch (begun.kind) {
    case content::Entity::Kind::kModel: {
      const content::Model& model = *entity.model.asset->model;
      const double scale =
          choices.automatic_size
              ? content::AutomaticScale(model, settings, SessionOptions().model_side * distance)
              : choices.scale;
      engine::Sim3& pose = entity.model.map_from_model;
      pose = content::FacingPose(hit.point, viewer, hit.normal, up, choices.yaw_deg * std::numbers::pi / 180,
                                 scale);
      pose.translation = hit.point - pose.scale * (pose.rotation * content::BaseOf(model));
      return entity;
    }
    case content::Entity::Kind::kSignpost:
      entity.signpost.anchor = hit.point;
      entity.signpost.up = up;
      entity.signpost.height = SessionOptions().signpost_height * distance;
      return entity;
    case content::Entity::Kind::kLabel:
      return NewLabel(choices.label_text, hit.point, up, distance);
    case content::Entity::Kind::kImage:
      return NewImage(begun.model.asset, hit, viewer, up, SessionOptions().model_side * distance,
                      choices.image_upright);
    case content::Entity::Kind::kSound:
      return NewSound(begun.sound.asset, hit.point, distance);
    case content::Entity::Kind::kTrail:
      return NewTrail({*trail_end, hit.point}, hit.on_plane ? hit.normal : up, up, distance);
    case content::Entity::Kind::kOccluder:
      return NewOccluder(OccluderAt(choices, Eigen::Vector2d::Zero()), {&hit, 1}, viewer, up);
  }
  return entity;
}

}  // namespace

std::optional<content::Entity> PlacingGhost::Begun(const ui::AuthoringChoices& choices, bool has_trail,
                                                   std::string* note) {
  using Tool = ui::AuthoringTool;
  const auto refuse = [&](const char* why) {
    *note = why;
    return std::optional<content::Entity>();
  };
  content::Entity entity;
  switch (choices.tool) {
    case Tool::kModel:
      entity.kind = content::Entity::Kind::kModel;
      entity.model.asset = models_.Get(choices.model_file);
      return entity.model.asset && entity.model.asset->model ? std::optional(entity) : std::nullopt;
    case Tool::kSignpost:
      entity.signpost.text = choices.sign_text;
      entity.signpost.to_map = choices.sign_to_map;
      return choices.sign_text.empty() ? refuse(ui::strings::kWriteText) : std::optional(entity);
    case Tool::kLabel:
      entity.kind = content::Entity::Kind::kLabel;
      return choices.label_text.empty() ? refuse(ui::strings::kWriteText) : std::optional(entity);
    case Tool::kImage:
      entity.kind = content::Entity::Kind::kImage;
      if (choices.image_file.empty()) return refuse(ui::strings::kChooseImage);
      entity.model.asset = models_.Get(choices.image_file);
      return entity.model.asset && entity.model.asset->model ? std::optional(entity) : std::nullopt;
    case Tool::kSound:
      entity.kind = content::Entity::Kind::kSound;
      if (choices.sound_file.empty()) return refuse(ui::strings::kChooseSound);
      if (choices.caption.empty()) return refuse(ui::strings::kWriteCaption);
      entity.sound.asset = models_.Get(choices.sound_file);
      return entity.sound.asset ? std::optional(entity) : std::nullopt;
    case Tool::kTrail:
      entity.kind = content::Entity::Kind::kTrail;
      return has_trail ? std::optional(entity) : std::nullopt;
    case Tool::kOccluder:
      entity.kind = content::Entity::Kind::kOccluder;
      return entity;
    case Tool::kSelect:
      break;
  }
  return std::nullopt;
}

std::shared_ptr<const content::Scene> PlacingGhost::AddTo(const std::shared_ptr<const content::Scene>& scene,
                                                          const AuthorView& view,
                                                          const ui::AuthoringChoices& choices,
                                                          const Eigen::Vector2d& pixel,
                                                          const std::optional<Eigen::Vector3d>& trail_end,
                                                          std::string* note) {
  note->clear();
  if (!view.has_pose() || !scene) return scene;
  const auto begun = Begun(choices, trail_end.has_value(), note);
  if (!begun) return scene;
  const engine::TrackedFrame& frame = view.frame->tracked;
  content::SurfaceHit hit;
  try {
    hit = SurfaceAtPixel(frame, view.camera.lens, pixel);
  } catch (const Error&) {
    *note = ui::strings::kNoSurface;
    return scene;
  }
  auto result = std::make_shared<content::Scene>(*scene);
  result->entities.push_back(
      GhostAt(*begun, choices, hit, view.eye(), scene->settings, UpOf(*scene, *frame.map), trail_end));
  result->entities.back().name = name();
  return result;
}

}  // namespace docent::app
