// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace docent::engine {

// What a person can do so that a map starts, or so that a camera is tracked or found again. The application
// forms the sentences.
enum class Hint : std::uint8_t {
  kNone,  // nothing needs to be done
  // No map has been started.
  kChooseMap,  // start a map, or look at a mapped place
  // A map is starting.
  kMoveSideways,             // the image does not move
  kMoveInsteadOfTurning,     // the camera only rotates
  kMoveFurther,              // there is too little parallax
  kAvoidPlane,               // two motions explain the plane in view
  kFindMoreDetail,           // too few keypoints were matched
  kWaitUntilStill,           // no rigid motion explains the image
  kStartWhereThereIsDetail,  // the first view has too few keypoints
  kFindTarget,               // the planar target is not in view
  kWaitForMap,               // the mapper works on the first views
  // A map is tracked.
  kMoveMoreSlowly,     // the tracking quality is not good
  kLowTexture,         // only the rotation is tracked
  kLeftMap,            // the camera was lost in this frame
  kLookBack,           // the camera is lost
  kFollowOtherCamera,  // this camera was found in another map than the one that the cameras are in
};

}  // namespace docent::engine
