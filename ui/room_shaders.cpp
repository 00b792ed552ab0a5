// SPDX-License-Identifier: Apache-2.0
#include "ui/room_shaders.h"

#include "ui/degradation_shader.h"

namespace docent::ui {
namespace {

// The constants: a shadow whose edge is soft over 3 texels of its image; a bias of half a percent of the
// casters' sphere against touching surfaces; the contact takes at most 60 % of the light away, as the rest
// comes from the side under things that are not flat. Taps of the contact lie on two rings and in the middle.
// What a caster as a whole takes from the sky is that of an ellipsoid of its size, of which it fills about
// half; it ends at twice its size.
const char* const kDarkness = R"glsl(
uniform sampler2D surface_depth, main_depth, contact_depth;
uniform mat4 main_from_map, contact_from_map;
uniform float main_strength;
uniform float contact_reach;  // As a depth of its image.
uniform int body_count;
uniform mat4 sphere_from_map[16];  // The ellipsoid of each caster.
uniform vec3 body_middle[16], body_up[16];
out vec4 color;
const float kBias = 0.005, kContact = 0.6, kBody = 0.5, kBodyReach2 = 5.0;

vec3 Place(mat4 clip_from_map, vec3 point) {
  return 0.5 + 0.5 * (clip_from_map * vec4(point, 1.0)).xyz;
}

bool IsInside(vec2 place) {
  return all(greaterThan(place, vec2(0.0))) && all(lessThan(place, vec2(1.0)));
}

float MainShadow(vec3 point) {
  vec3 place = Place(main_from_map, point);
  if (main_strength == 0.0 || !IsInside(place.xy)) return 0.0;
  vec2 texel = 1.0 / vec2(textureSize(main_depth, 0));
  float blocked = 0.0;
  for (int y = -1; y <= 1; ++y) {
    for (int x = -1; x <= 1; ++x) {
      float depth = textureLod(main_depth, place.xy + 1.5 * vec2(x, y) * texel, 0.0).r;
      blocked += depth < 1.0 && depth < place.z - kBias ? 1.0 : 0.0;  // At 1 there is no caster.
    }
  }
  return blocked / 9.0;
}

// A caster whose underside is at a height above the point takes the more light away the lower it is.
float ContactAt(vec2 place, float depth) {
  float height = textureLod(contact_depth, place, 0.0).r;
  if (height == 1.0) return 0.0;
  float above = (height - depth) / contact_reach;
  if (above < -1.0 || above > 1.0) return 0.0;
  float near = 1.0 - max(above, 0.0);
  return near * near;
}

float ContactShadow(vec3 point) {
  vec3 place = Place(contact_from_map, point);
  if (!IsInside(place.xy)) return 0.0;
  float sum = ContactAt(place.xy, place.z);
  const vec2 ring[8] = vec2[8](vec2(1, 0), vec2(0.7071, 0.7071), vec2(0, 1), vec2(-0.7071, 0.7071), vec2(-1, 0),
                               vec2(-0.7071, -0.7071), vec2(0, -1), vec2(0.7071, -0.7071));
  for (int i = 0; i < 8; ++i)
    sum += ContactAt(place.xy + 0.4 * contact_reach * ring[i], place.z) +
           ContactAt(place.xy + 0.9 * contact_reach * ring[i].yx, place.z);
  return sum / 17.0;
}

// The light from all sides that the bodies leave to a level surface at a point: a sphere of radius 1 at a distance d takes
// cos / d^2 of it away, where the angle is that between its direction and up.
float LeftByBodies(vec3 point) {
  float left = 1.0;
  for (int i = 0; i < body_count; ++i) {
    vec3 place = (sphere_from_map[i] * vec4(point, 1.0)).xyz;
    float distance2 = max(dot(place, place), 1.0);
    float cosine = dot(body_up[i], normalize(body_middle[i] - point));
    float end = clamp((kBodyReach2 - distance2) / (kBodyReach2 - 1.0), 0.0, 1.0);
    left *= 1.0 - kBody * max(cosine, 0.0) / distance2 * end * end;
  }
  return left;
}

vec4 Darkness(vec3 point) {
  float left = (1.0 - main_strength * MainShadow(point)) * (1.0 - kContact * ContactShadow(point)) *
               LeftByBodies(point);
  return vec4(1.0 - left, 0.0, 0.0, 1.0);
}
)glsl";

}  // namespace

const char* const kPlaneVertexShader = R"glsl(#version 330 core
uniform mat4 clip_from_map;
uniform vec3 middle, half_u, half_v;
out vec3 point;
void main() {
  point = middle + half_u * float((gl_VertexID & 1) * 2 - 1) + half_v * float((gl_VertexID >> 1) * 2 - 1);
  gl_Position = clip_from_map * vec4(point, 1.0);
}
)glsl";

std::string ShadowOnSurfacesShader() {
  return std::string("#version 330 core\n") + kDarkness + R"glsl(
uniform mat4 map_from_clip;
uniform ivec4 viewport;  // x, y, width, height
void main() {
  float depth = texelFetch(surface_depth, ivec2(gl_FragCoord.xy), 0).r;
  if (depth == 1.0) discard;
  vec3 place = vec3((gl_FragCoord.xy - vec2(viewport.xy)) / vec2(viewport.zw), depth);
  vec4 point = map_from_clip * vec4(2.0 * place - 1.0, 1.0);
  color = Darkness(point.xyz / point.w);
}
)glsl";
}

std::string ShadowOnPlaneShader() {
  return std::string("#version 330 core\nin vec3 point;\n") + kDarkness + R"glsl(
void main() {
  if (texelFetch(surface_depth, ivec2(gl_FragCoord.xy), 0).r < 1.0) discard;
  color = Darkness(point);
}
)glsl";
}

// What is hidden is decided for each pixel by comparing the content's depth with the surfaces around the
// pixel, weighted by how much the video there looks like the pixel (a joint bilateral filter; Kopf et al.
// 2007): the edge of a surface comes to lie on the edge in the image, and is soft. Only pixels with an edge
// around them are filtered. Unknown depth, 1, hides nothing.
std::string RoomWarpFragmentShader() {
  return R"glsl(#version 330 core
uniform sampler2D lookup, atlas, content_depth, surface_depth, shadow, video;
)glsl" + DegradationFunctions() +
         R"glsl(
uniform float opacity;
uniform bool has_surfaces, has_shadows;
uniform vec2 depth_range;  // Nearest and farthest distance along the axis.
uniform float depth_bias;
out vec4 color;
const int kRadius = 6, kStep = 2;  // Pixels; three times the median error of an edge of a mesh.
const float kSpace = 0.03;       // 1 / (2 sigma^2) for a sigma of 4 pixels.
const float kLikeness = 120.0;   // The same for a sigma of 0.065, 16 grey levels, about four times the noise.

float Distance(float depth) {
  return depth_range.x * depth_range.y / (depth_range.y - depth * (depth_range.y - depth_range.x));
}

ivec2 AtlasTexel(ivec2 pixel) {
  return ivec2(texelFetch(lookup, pixel, 0).rg * vec2(textureSize(atlas, 0)));
}

// Whether the lens has a ray for the pixel; only then it has a place in the atlas.
bool HasRay(ivec2 pixel) {
  return texelFetch(lookup, pixel, 0).r >= 0.0;
}

float Hides(ivec2 pixel, float content) {
  float depth = texelFetch(surface_depth, AtlasTexel(pixel), 0).r;
  return depth < 1.0 && Distance(depth) * (1.0 + depth_bias) < content ? 1.0 : 0.0;
}

// The video at a pixel of the target, which may be larger.
vec3 Video(ivec2 pixel) {
  return textureLod(video, (vec2(pixel) + 0.5) / vec2(textureSize(lookup, 0)), 0.0).rgb;
}

float Hidden(ivec2 pixel, ivec2 texel) {
  float nearest = texelFetch(content_depth, texel, 0).r;
  // Partly covered pixels at the silhouette of the content have the depth of the nearest texel around them.
  if (nearest == 1.0) {
    for (int i = 0; i < 25; ++i)
      nearest = min(nearest, texelFetch(content_depth, texel + ivec2(i % 5 - 2, i / 5 - 2), 0).r);
  }
  if (nearest == 1.0) return 0.0;
  float content = Distance(nearest);
  float middle = Hides(pixel, content);
  ivec2 last = textureSize(lookup, 0) - 1;
  bool is_edge = false;
  for (int i = 0; i < 16 && !is_edge; ++i) {
    ivec2 step = ivec2[8](ivec2(1, 0), ivec2(0, 1), ivec2(-1, 0), ivec2(0, -1), ivec2(1, 1), ivec2(-1, 1),
                          ivec2(-1, -1), ivec2(1, -1))[i % 8] * (i < 8 ? kRadius : kRadius / 2);
    ivec2 other = clamp(pixel + step, ivec2(0), last);
    is_edge = HasRay(other) && Hides(other, content) != middle;
  }
  if (!is_edge) return middle;
  vec3 own = Video(pixel);
  float hidden = 0.0, all = 0.0;
  for (int y = -kRadius; y <= kRadius; y += kStep) {
    for (int x = -kRadius; x <= kRadius; x += kStep) {
      ivec2 other = clamp(pixel + ivec2(x, y), ivec2(0), last);
      if (!HasRay(other)) continue;
      vec3 difference = Video(other) - own;
      float weight = exp(-kSpace * float(x * x + y * y) - kLikeness * dot(difference, difference));
      hidden += weight * Hides(other, content);
      all += weight;
    }
  }
  return smoothstep(0.3, 0.7, hidden / all);
}

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec2 place = texelFetch(lookup, pixel, 0).rg;
  if (place.x < 0.0) discard;
  vec2 content_place;
  color = BlurredContent(pixel, content_place);
  if (color != vec4(0.0) && has_surfaces)
    color *= 1.0 - Hidden(pixel, ivec2(content_place * vec2(textureSize(atlas, 0))));
  color = opacity * Degraded(color, pixel);
  if (has_shadows) {
    // The video is encoded; light is taken from it by the power law that is closest to the encoding.
    float left = pow(1.0 - opacity * textureLod(shadow, place, 0.0).r, 1.0 / 2.2);
    color.a = 1.0 - left * (1.0 - color.a);
  }
  if (color == vec4(0.0)) discard;
}
)glsl";
}

}  // namespace docent::ui
