// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "engine/map/map_snapshot.h"

namespace docent::maps {

// A map as COLMAP's text model (https://colmap.github.io/format.html). COLMAP's poses are camera_from_world
// as ours; its pixels have the top-left corner of the image at (0, 0), ours the centre of the top-left
// pixel, so that half a pixel is added to what lies in an image. Its ids begin at 1: ours plus one.
// Directions (infinite points) have no place in it: they are left out, and their observations belong to no
// point.
struct ColmapModel {
  std::string cameras, images, points3d;                             // the three files
  std::vector<std::pair<std::string, engine::KeyFrameId>> image_of;  // name in images.txt, keyframe
};
// A pure function.
ColmapModel MakeColmapModel(const engine::MapSnapshot& map);

// The finite points as a PLY file (binary, little-endian): x y z and normal as float, metres of the map; red
// green blue as uchar, the grey value where the point's patch was cut.
std::string MakePly(const engine::MapSnapshot& map);

}  // namespace docent::maps
