// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/placing_ghost.h"

#include <numbers>
#include <utility>

#include "app/session/map_axes.h"
#include "app/session/session.h"
#include "app/session/surface_at_pixel.h"
#include "content/asset.h"
#include "content/placement.h"
#include "engine/base/error.h"
#include "ui/strings.h"

namespace docent::app {

std::shared_ptr<const content::Asset> ModelPreviews::Get(const std::string& file) {
  {
    const std::scoped_lock lock(mutex_);
    if (const auto found = read_.find(file); found != read_.end()) return found->second.asset;
  }
  if (file.empty() || (worker_ && !worker_->finished())) return nullptr;
  worker_.emplace("model preview", [this, file](const std::stop_token&) {
    Read read;
    try {
      std::filesystem::path path = folder_ / file;
      std::error_code error;
      if (!std::filesystem::exists(path, error)) path = file;
      read.asset = std::make_shared<content::Asset>(content::ImportAsset(path));
    } catch (const Error&) {
      // The command that places it says why.
    }
    const std::scoped_lock lock(mutex_);
    read_[file] = std::move(read);
  });
  return nullptr;
}

std::shared_ptr<const content::Scene> PlacingGhost::AddTo(const std::shared_ptr<const content::Scene>& scene,
                                                          const AuthorView& view,
                                                          const ui::AuthoringChoices& choices,
                                                          const Eigen::Vector2d& pixel, std::string* note) {
  note->clear();
  if (!view.has_pose() || !scene) return scene;
  content::Entity entity;
  entity.name = name();
  if (choices.tool == ui::AuthoringTool::kModel) {
    entity.kind = content::Entity::Kind::kModel;
    entity.model.asset = models_.Get(choices.model_file);
    if (!entity.model.asset) return scene;
  } else if (choices.sign_text.empty()) {
    *note = ui::strings::kWriteText;
    return scene;
  }
  const engine::TrackedFrame& frame = view.frame->tracked;
  content::SurfaceHit hit;
  try {
    hit = SurfaceAtPixel(frame, view.camera.lens, pixel);
  } catch (const Error&) {
    *note = ui::strings::kNoSurface;
    return scene;
  }
  const double distance = (hit.point - view.eye()).norm();
  const Eigen::Vector3d up = UpOf(*scene, *frame.map);
  if (entity.kind == content::Entity::Kind::kModel) {
    const content::Model& model = *entity.model.asset->model;
    const double scale =
        choices.automatic_size
            ? content::AutomaticScale(model, scene->settings, SessionOptions().model_side * distance)
            : choices.scale;
    engine::Sim3& pose = entity.model.map_from_model;
    pose = content::FacingPose(hit.point, view.eye(), hit.normal, up,
                               choices.yaw_deg * std::numbers::pi / 180, scale);
    pose.translation = hit.point - pose.scale * (pose.rotation * content::BaseOf(model));
  } else {
    entity.signpost.text = choices.sign_text;
    entity.signpost.to_map = choices.sign_to_map;
    entity.signpost.anchor = hit.point;
    entity.signpost.up = up;
    entity.signpost.height_m = SessionOptions().signpost_height * distance;
  }
  auto result = std::make_shared<content::Scene>(*scene);
  result->entities.push_back(std::move(entity));
  return result;
}

}  // namespace docent::app
