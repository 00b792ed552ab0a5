// SPDX-License-Identifier: Apache-2.0
#include "app/session/augmentation_log.h"

#include "app/files/text_file.h"
#include "app/output/run_output.h"
#include "content/placement.h"

namespace docent::app {

AugmentationLog::AugmentationLog(const std::filesystem::path& folder) : file_(folder / "augmentations.csv") {
  file_.Write("timestamp,map,name,u,v\n");
}

void AugmentationLog::Add(const engine::TrackedFrame& frame, const engine::CameraModel& camera,
                          const std::string& map_name, const content::Scene& scene) {
  if (!engine::HasPose(frame.state)) return;
  for (const content::Entity& entity : scene.entities) {
    if (entity.hidden || entity.kind == content::Entity::Kind::kOccluder) continue;
    const auto pixel = camera.Project(frame.camera_from_map * content::BaseInMap(entity));
    if (!pixel || !camera.IsInside(*pixel)) continue;
    file_.Write(FormatSeconds(frame.frame.time) + ',' + CsvField(map_name) + ',' + CsvField(entity.name) +
                ',' + FormatNumber(pixel->x(), 7) + ',' + FormatNumber(pixel->y(), 7) + '\n');
  }
}

}  // namespace docent::app
