// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/adaptive_quality.h"

#include <algorithm>
#include <cmath>

namespace docent::app {

void AdaptiveQuality::WarmUp(ui::Renderer* renderer) {
  const engine::CameraModel camera(engine::LensModel::kRadialTangential, {64, 48, 50, 50, 31.5, 23.5}, {});
  engine::TrackedFrame tracked;
  tracked.frame.image = cv::Mat::zeros(48, 64, CV_8UC3);
  tracked.state = engine::TrackingState::kSixDof;
  content::Scene scene;
  content::Entity& sign = scene.entities.emplace_back();
  sign.name = "sign";
  sign.kind = content::Entity::Kind::kSignpost;
  sign.signpost.text = " ";
  sign.signpost.anchor = {0, 0.5, 2};
  sign.signpost.height = 0.5;
  sign.signpost.direction = Eigen::Vector3d::UnitX();
  ui::View view;
  view.tracked = &tracked;
  view.camera = &camera;
  view.scene = &scene;
  view.overlay.hud = false;
  for (const ui::DrawingQuality& quality : ui::kQualityLevels) {
    renderer->SetQuality(quality.samples, 1);
    view.shadows = quality.shadows;
    renderer->Draw(view);
  }
  renderer->SetQuality(ui::kQualityLevels.front().samples, 1);
  // Until the first image, nothing of that is shown.
  ui::View empty;
  empty.camera = &camera;
  empty.overlay.hud = false;
  renderer->Draw(empty);
}

void AdaptiveQuality::Apply(double pixels_per_pixel, ui::Renderer* renderer, ui::View* view) const {
  const ui::DrawingQuality& quality = controller_.quality();
  // In steps of an eighth, so that a window that is resized does not need a new lens table all the time.
  const double stepped = std::ceil(8 * pixels_per_pixel) / 8;
  const double least = std::min(1.0, quality.largest_scale);
  renderer->SetQuality(quality.samples, std::clamp(stepped, least, quality.largest_scale), quality.smooth);
  view->shadows = view->shadows && quality.shadows;
}

std::optional<std::string> AdaptiveQuality::Add(Clock::time_point begin, Clock::time_point now) {
  using Seconds = std::chrono::duration<double>;
  if (!controller_.Add(Seconds(now - start_).count(), Seconds(now - begin).count())) return std::nullopt;
  return std::string("The quality of drawing was changed: ") + controller_.quality().name;
}

}  // namespace docent::app
