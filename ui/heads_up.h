// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "ui/canvas.h"
#include "ui/inset.h"
#include "ui/renderer.h"

// The 2D layers over the image. Each function draws into a canvas between its Begin and End. The functions
// keep no state, so the same View always gives the same image.
namespace docent::ui {

// The colour of a pyramid level in overlays and in the map view.
Color LevelColor(int level);

// Draws the matched points of a tracked frame: disks for inliers, rings for the others.
void DrawPoints(const engine::TrackedFrame& tracked, Canvas* canvas);

// Draws keyframes as small frusta, distorted by the lens.
void DrawKeyFrames(const engine::MapSnapshot& map, const engine::CameraModel& camera,
                   const engine::Rigid3& camera_from_map, Canvas* canvas);

// For a canvas of this height: texts and lines grow with it, so that they stay readable in a large image.
HeadsUpStyle HeadsUpStyleFor(int height_px);

// Draws the state, map name, quality bar, hint and message. Without a pose it also draws an animated figure
// that asks the wearer to search (a magnifying glass over a compass) or to move (a camera that moves
// sideways).
void DrawHeadsUp(const View& view, const HeadsUpStyle& style, Canvas* canvas);

// Draws the border of another camera's inset image; its colour is that camera's tracking quality.
void DrawInsetFrame(const engine::TrackedFrame& tracked, const Inset& inset, Canvas* canvas);

}  // namespace docent::ui
