// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "ui/gl_objects.h"
#include "ui/image_degradation.h"

namespace docent::ui {

// GLSL functions that draw content as the camera would have taken it, for a shader with the samplers `lookup`
// and `atlas` of the lens warp (see shaders.h).
//   vec4 BlurredContent(ivec2 pixel, out vec2 place)
//     The content at a pixel of the target, averaged over the motion during the exposure. `place`: where the
//     atlas has the content that covers the pixel most.
//   vec4 Degraded(vec4 color, ivec2 pixel)
//     The colour with the shading of the lens and the noise of the sensor. What is clear stays as it is.
std::string DegradationFunctions();
// Sets their uniforms; the program must be in use. `scale`: pixels of the target for one of the camera.
void SetDegradation(const GlProgram& program, const ImageDegradation& degradation, double scale);

}  // namespace docent::ui
