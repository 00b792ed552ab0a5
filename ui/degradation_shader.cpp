// SPDX-License-Identifier: Apache-2.0
#include "ui/degradation_shader.h"

#include <algorithm>

namespace docent::ui {

// Numbers at random from the pixel and the image are those of pcg3d (Jarzynski and Olano, Hash Functions for
// GPU Rendering, 2020). The sum of six uniform numbers is nearly normal, with a variance of a half.
std::string DegradationFunctions() {
  return R"glsl(
uniform mat3x2 motion;
uniform float noise, shading, shading_reference, camera_pixel;
uniform int noise_seed;
const int kMaxTaps = 12;

vec4 BlurredContent(ivec2 pixel, out vec2 place) {
  place = texelFetch(lookup, pixel, 0).rg;
  vec2 way = motion * vec3(vec2(pixel), 1.0);
  int taps = min(kMaxTaps, int(length(way)) + 1);
  if (taps == 1) return textureLod(atlas, place, 0.0);
  vec4 sum = vec4(0.0);
  float most = -1.0;
  ivec2 last = textureSize(lookup, 0) - 1;
  for (int i = 0; i < taps; ++i) {
    vec2 at = vec2(pixel) + way * (float(i) / float(taps - 1) - 0.5);
    vec2 there = texelFetch(lookup, clamp(ivec2(round(at)), ivec2(0), last), 0).rg;
    if (there.x < 0.0) continue;
    vec4 content = textureLod(atlas, there, 0.0);
    sum += content;
    if (content.a > most) {
      most = content.a;
      place = there;
    }
  }
  return sum / float(taps);
}

uvec3 Hash(uvec3 v) {
  v = v * 1664525u + 1013904223u;
  v.x += v.y * v.z;
  v.y += v.z * v.x;
  v.z += v.x * v.y;
  v ^= v >> 16u;
  v.x += v.y * v.z;
  v.y += v.z * v.x;
  v.z += v.x * v.y;
  return v;
}

vec4 Degraded(vec4 color, ivec2 pixel) {
  if (shading != 0.0) {
    vec2 middle = 0.5 * vec2(textureSize(lookup, 0) - 1);
    vec2 from_middle = vec2(pixel) - middle;
    float radius2 = dot(from_middle, from_middle) / dot(middle, middle);
    // The exponent is of light; the power law is the one that is closest to the encoding.
    color.rgb = min(color.rgb * exp(shading * (radius2 - shading_reference) / 2.2), vec3(1.0));
  }
  if (noise > 0.0) {
    uvec3 random = Hash(uvec3(uvec2(vec2(pixel) / camera_pixel), uint(noise_seed)));
    uvec3 sums = (random & 0xffffu) + (random >> 16u);
    float normal = (float(sums.x + sums.y + sums.z) / 65535.0 - 3.0) * 1.41421356;
    color.rgb = max(color.rgb + color.a * noise * normal, vec3(0.0));
  }
  return color;
}
)glsl";
}

void SetDegradation(const GlProgram& program, const ImageDegradation& degradation, double scale) {
  // A pixel x of the target is (x + 0.5) / scale - 0.5 in the camera's image.
  const auto s = static_cast<float>(scale);
  glm::mat3x2 motion = degradation.motion;
  motion[2] = s * motion[2] + (0.5f - 0.5f * s) * (motion[0] + motion[1]);
  glUniformMatrix3x2fv(program.Uniform("motion"), 1, GL_FALSE, &motion[0][0]);
  glUniform1f(program.Uniform("noise"), degradation.noise);
  glUniform1i(program.Uniform("noise_seed"), static_cast<GLint>(degradation.noise_seed & 0x7fffffffu));
  glUniform1f(program.Uniform("shading"), degradation.shading);
  glUniform1f(program.Uniform("shading_reference"), degradation.shading_reference);
  glUniform1f(program.Uniform("camera_pixel"), std::max(1.0f, s));
}

}  // namespace docent::ui
