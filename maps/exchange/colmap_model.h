// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "engine/map/map_snapshot.h"

namespace docent::maps {

// A map in COLMAP's text format (https://colmap.github.io/format.html). COLMAP's poses are camera_from_world,
// as in Docent. Its pixel (0, 0) is the top-left corner of the image, whereas Docent's is the centre of the
// top-left pixel, so half a pixel is added to image coordinates. Its ids begin at 1, so each id is Docent's
// plus one. The format cannot represent infinite points: they are left out, and their observations have no 3D
// point.
struct ColmapModel {
  std::string cameras, images, points3d;  // The contents of the three files.
  std::vector<std::pair<std::string, engine::KeyFrameId>>
      image_of;  // Image name in images.txt and keyframe id.
};
// A pure function.
ColmapModel MakeColmapModel(const engine::MapSnapshot& map);

// The finite points as a binary little-endian PLY file: x y z and normal as float, in map units; red green
// blue as uchar, the grey value at the centre of the point's patch in its source keyframe.
std::string MakePly(const engine::MapSnapshot& map);

}  // namespace docent::maps
