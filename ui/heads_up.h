// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "ui/canvas.h"
#include "ui/inset.h"
#include "ui/renderer.h"

// The flat layers over the image. Each adds to a canvas between its Begin and End; nothing here keeps
// state, so that the same View always gives the same image.
namespace docent::ui {

// Colour of a pyramid level, in overlays and in the map view.
Color LevelColor(int level);

// The points of a tracked frame where they were found: disks for inliers, rings for the others.
void DrawPoints(const engine::TrackedFrame& tracked, Canvas* canvas);

// Keyframes as small pyramids, through the lens.
void DrawKeyFrames(const engine::MapSnapshot& map, const engine::CameraModel& camera,
                   const engine::Rigid3& camera_from_map, Canvas* canvas);

// State, map, quality bar, hint and message; while there is no pose also the figure that invites the wearer
// to search (a lens wandering over a compass) or to move (a camera gliding sideways).
void DrawHeadsUp(const View& view, Canvas* canvas);

// The frame around another camera's small image: its colour says how that camera is tracked.
void DrawInsetFrame(const engine::TrackedFrame& tracked, const Inset& inset, Canvas* canvas);

}  // namespace docent::ui
