// SPDX-License-Identifier: Apache-2.0
#include "ui/shaders.h"

#include "ui/degradation_shader.h"

namespace docent::ui {

const char* const kFullScreenVertexShader = R"glsl(#version 330 core
void main() {
  vec2 corner = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2);
  gl_Position = vec4(corner * 2.0 - 1.0, 0.0, 1.0);
}
)glsl";

// The video's bytes are uploaded in memory order (blue first). An image of the target's own size is copied
// texel by texel, so that it keeps its exact values.
const char* const kVideoFragmentShader = R"glsl(#version 330 core
uniform sampler2D video;
uniform ivec2 target_origin;
uniform ivec2 target_size;
uniform bool is_gray;
out vec4 color;
void main() {
  vec2 place = gl_FragCoord.xy - vec2(target_origin);
  vec3 bgr = textureSize(video, 0) == target_size ? texelFetch(video, ivec2(place), 0).rgb
                                                  : texture(video, place / vec2(target_size)).rgb;
  color = vec4(is_gray ? bgr.rrr : bgr.bgr, 1.0);
}
)glsl";

std::string WarpFragmentShader() {
  return R"glsl(#version 330 core
uniform sampler2D lookup;
uniform sampler2D atlas;
uniform float opacity;
out vec4 color;
)glsl" + DegradationFunctions() +
         R"glsl(
void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec2 place = texelFetch(lookup, pixel, 0).rg, content_place;
  if (place.x < 0.0) discard;
  color = opacity * Degraded(BlurredContent(pixel, content_place), pixel);
  if (color == vec4(0.0)) discard;  // A clear surface only adds its reflection.
}
)glsl";
}

const char* const kMeshVertexShader = R"glsl(#version 330 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 tangent;
layout(location = 3) in vec2 uv0;
layout(location = 4) in vec2 uv1;
layout(location = 5) in vec4 vertex_color;
layout(location = 6) in uvec4 joints;
layout(location = 7) in vec4 weights;
uniform mat4 clip_from_map;
uniform mat4 map_from_mesh;    // For a skinned mesh this is map_from_model.
uniform samplerBuffer joint_columns;  // Four texels per joint: model_from_bind.
uniform int first_joint;       // -1 if the mesh is not skinned.
uniform bool flip_normals;     // True if vertices are placed by a reflection.
out vec3 position_in_map;
out vec3 normal_in_map;
out vec4 tangent_in_map;
out vec2 texture_place[2];
out vec4 tint;

mat4 Joint(uint joint) {
  int base = (first_joint + int(joint)) * 4;
  return mat4(texelFetch(joint_columns, base), texelFetch(joint_columns, base + 1),
              texelFetch(joint_columns, base + 2), texelFetch(joint_columns, base + 3));
}

void main() {
  mat4 map_from_vertex = map_from_mesh;
  float weight = dot(weights, vec4(1.0));
  if (first_joint >= 0 && weight > 0.0) {
    mat4 blended = weights.x * Joint(joints.x);
    if (weights.y > 0.0) blended += weights.y * Joint(joints.y);
    if (weights.z > 0.0) blended += weights.z * Joint(joints.z);
    if (weights.w > 0.0) blended += weights.w * Joint(joints.w);
    map_from_vertex = map_from_mesh * (blended / weight);
  }
  mat3 linear = mat3(map_from_vertex);
  // The cofactor matrix equals the inverse transpose up to a factor and also exists for singular transforms.
  mat3 cofactors =
      mat3(cross(linear[1], linear[2]), cross(linear[2], linear[0]), cross(linear[0], linear[1]));
  vec4 place = map_from_vertex * vec4(position, 1.0);
  position_in_map = place.xyz;
  normal_in_map = cofactors * normal * (flip_normals ? -1.0 : 1.0);
  tangent_in_map = vec4(linear * tangent.xyz, flip_normals ? -tangent.w : tangent.w);
  texture_place[0] = uv0;
  texture_place[1] = uv1;
  tint = vertex_color;
  gl_Position = clip_from_map * place;
}
)glsl";

// The glTF 2.0 appendix B material model: Lambert plus GGX microfacets with Smith's joint visibility term and
// Schlick's Fresnel term, under one directional light and an analytic sky above a floor.
const char* const kMeshFragmentShader = R"glsl(#version 330 core
struct TextureUse {
  bool used;
  int uv_set;
  mat3 uv_transform;
};
in vec3 position_in_map;
in vec3 normal_in_map;
in vec4 tangent_in_map;
in vec2 texture_place[2];
in vec4 tint;
uniform sampler2D base_color_map, metallic_roughness_map, normal_map, occlusion_map, emissive_map,
    transmission_map;
uniform TextureUse base_color_use, metallic_roughness_use, normal_use, occlusion_use, emissive_use,
    transmission_use;
uniform vec4 base_color;
uniform vec3 emissive;
uniform float metallic, roughness, normal_scale, occlusion_strength, transmission;
uniform int alpha_mode;  // 0 opaque, 1 mask, 2 blend
uniform float alpha_cutoff;
uniform bool unlit;
uniform vec3 eye_in_map;
uniform vec3 up_in_map;
uniform vec3 direction_to_light;  // Unit vector in the map.
uniform vec3 light_radiance, sky_radiance, floor_radiance;
// Of the room, where it is known: the brightness of white surfaces by their normal, as spherical harmonics, and
// the part of it that comes from the main light.
uniform bool light_is_known;
uniform float room_brightness[9];
uniform float direct;
uniform vec3 exposure;  // Of the video relative to that for which the light is given.
out vec4 color;
const float kPi = 3.14159265;

vec2 Place(TextureUse use) {
  return (use.uv_transform * vec3(use.uv_set == 0 ? texture_place[0] : texture_place[1], 1.0)).xy;
}

vec3 Encode(vec3 linear) {  // IEC 61966-2-1
  linear = clamp(linear, 0.0, 1.0);
  return mix(12.92 * linear, 1.055 * pow(linear, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, linear));
}

// Leaves colours below the shoulder unchanged and compresses brighter ones towards white.
vec3 Compress(vec3 linear) {
  const float shoulder = 0.75;
  vec3 above = max(linear - shoulder, 0.0) / (1.0 - shoulder);
  return min(linear, shoulder) + (1.0 - shoulder) * (1.0 - exp(-above));
}

vec3 Normal() {
  vec3 normal = normalize(normal_in_map);
  if (!normal_use.used) return normal;
  vec2 place = Place(normal_use);
  vec3 tangent = tangent_in_map.xyz - normal * dot(normal, tangent_in_map.xyz);
  vec3 bitangent;
  if (dot(tangent, tangent) > 1e-8 * dot(tangent_in_map.xyz, tangent_in_map.xyz)) {
    tangent = normalize(tangent);
    bitangent = cross(normal, tangent) * tangent_in_map.w;
  } else {  // Without a usable vertex tangent, it is computed from screen-space derivatives.
    vec3 dx = dFdx(position_in_map), dy = dFdy(position_in_map);
    vec2 du = dFdx(place), dv = dFdy(place);
    tangent = dx * dv.y - dy * du.y;
    tangent -= normal * dot(normal, tangent);
    if (dot(tangent, tangent) == 0.0) return normal;
    tangent = normalize(tangent) * sign(du.x * dv.y - dv.x * du.y + 1e-30);
    bitangent = cross(normal, tangent);
  }
  vec3 local = texture(normal_map, place).xyz * 2.0 - 1.0;
  local.xy *= normal_scale;
  return normalize(tangent * local.x + bitangent * local.y + normal * local.z);
}

// The radiance of the environment in a direction, blurred by the roughness of the reflecting surface.
vec3 EnvironmentRadiance(vec3 direction, float blur) {
  if (light_is_known) {
    vec3 d = direction;
    float all = room_brightness[0] + room_brightness[1] * d.y + room_brightness[2] * d.z +
                room_brightness[3] * d.x + room_brightness[4] * d.x * d.y + room_brightness[5] * d.y * d.z +
                room_brightness[6] * (3.0 * d.z * d.z - 1.0) + room_brightness[7] * d.x * d.z +
                room_brightness[8] * (d.x * d.x - d.y * d.y);
    // Without the main light, as far as the harmonics contain it.
    float x = dot(d, direction_to_light);
    return vec3(max(all - direct * (0.25 + 0.5 * x + 0.15625 * (3.0 * x * x - 1.0)), 0.0));
  }
  float height = dot(direction, up_in_map);
  float width = mix(0.08, 1.0, blur);
  vec3 sky = sky_radiance * mix(1.25, 0.85, smoothstep(0.0, 0.9, height));
  return mix(floor_radiance, mix(sky, sky_radiance, blur), smoothstep(-width, width, height));
}

// The light that a surface scatters from below it, and that it reflects.
struct Reflection {
  vec3 diffuse;
  vec3 specular;
};

Reflection Shade(vec3 albedo, vec3 normal, float metal, float rough, float occlusion) {
  vec3 view = normalize(eye_in_map - position_in_map);
  if (!gl_FrontFacing) normal = -normal;
  vec3 half_way = normalize(view + direction_to_light);
  float nv = max(dot(normal, view), 1e-3);
  float nl = max(dot(normal, direction_to_light), 0.0);
  float nh = max(dot(normal, half_way), 0.0);
  float vh = max(dot(view, half_way), 0.0);
  vec3 f0 = mix(vec3(0.04), albedo, metal);
  vec3 diffuse = albedo * (1.0 - metal);
  float alpha = max(rough * rough, 0.002);
  float alpha2 = alpha * alpha;
  float spread = nh * nh * (alpha2 - 1.0) + 1.0;
  float distribution = alpha2 / (kPi * spread * spread);
  float visibility = 0.5 / (nl * sqrt(nv * nv * (1.0 - alpha2) + alpha2) +
                            nv * sqrt(nl * nl * (1.0 - alpha2) + alpha2) + 1e-5);
  vec3 fresnel = f0 + (1.0 - f0) * pow(1.0 - vh, 5.0);
  vec3 direct = light_radiance * nl;
  vec3 mirror = f0 + (max(vec3(1.0 - rough), f0) - f0) * pow(1.0 - nv, 5.0);
  return Reflection(diffuse * ((1.0 - fresnel) / kPi * direct +
                               EnvironmentRadiance(normal, 1.0) * (1.0 - mirror) * occlusion),
                    fresnel * min(distribution * visibility, 40.0) * direct +
                        mirror * EnvironmentRadiance(reflect(-view, normal), rough) * occlusion);
}

void main() {
  vec4 base = base_color * tint;
  if (base_color_use.used) base *= texture(base_color_map, Place(base_color_use));
  if (alpha_mode == 1 && base.a < alpha_cutoff) discard;
  float alpha = alpha_mode == 2 ? clamp(base.a, 0.0, 1.0) : 1.0;
  if (unlit) {
    color = vec4(Encode(base.rgb) * alpha, alpha);
    return;
  }
  float metal = metallic, rough = roughness, occlusion = 1.0;
  if (metallic_roughness_use.used) {
    vec2 sampled = texture(metallic_roughness_map, Place(metallic_roughness_use)).bg;
    metal *= sampled.x;
    rough *= sampled.y;
  }
  if (occlusion_use.used)
    occlusion = mix(1.0, texture(occlusion_map, Place(occlusion_use)).r, occlusion_strength);
  metal = clamp(metal, 0.0, 1.0);
  Reflection shaded = Shade(base.rgb, Normal(), metal, clamp(rough, 0.04, 1.0), occlusion);
  vec3 glow = emissive;
  if (emissive_use.used) glow *= texture(emissive_map, Place(emissive_use)).rgb;
  // Light from behind takes the place of the diffuse part (KHR_materials_transmission); metals let none pass.
  float passing = transmission * (1.0 - metal);
  if (transmission_use.used) passing *= texture(transmission_map, Place(transmission_use)).r;
  vec3 opaque = Encode(Compress(exposure * (shaded.diffuse + shaded.specular + glow)));
  vec3 clear = Encode(Compress(exposure * (shaded.specular + glow)));
  color = vec4(mix(opaque, clear, passing) * alpha, alpha * (1.0 - passing));
}
)glsl";

const char* const kSurfaceVertexShader = R"glsl(#version 330 core
layout(location = 0) in vec3 position_in_map;
uniform mat4 clip_from_map;
void main() {
  gl_Position = clip_from_map * vec4(position_in_map, 1.0);
}
)glsl";

const char* const kSurfaceFragmentShader = R"glsl(#version 330 core
void main() {}
)glsl";

const char* const kCanvasVertexShader = R"glsl(#version 330 core
layout(location = 0) in vec2 position_px;
layout(location = 1) in vec2 local;
layout(location = 2) in vec4 shape;  // Half width, half height, corner radius, stroke width (0: filled).
layout(location = 3) in vec4 shape_color;
uniform vec2 target_size;
uniform float up;  // -1 where row 0 of the framebuffer is at the bottom.
out vec2 place;
flat out vec4 form;
flat out vec4 paint;
void main() {
  place = local;
  form = shape;
  paint = shape_color;
  gl_Position = vec4((position_px + 0.5) / target_size * 2.0 - 1.0, 0.0, 1.0) * vec4(1.0, up, 1.0, 1.0);
}
)glsl";

// Every shape is a rounded box, filled or stroked, with an edge that is anti-aliased over one pixel.
const char* const kCanvasShapeFragmentShader = R"glsl(#version 330 core
in vec2 place;
flat in vec4 form;
flat in vec4 paint;
out vec4 color;
void main() {
  vec2 beyond = abs(place) - (form.xy - form.z);
  float distance_px = length(max(beyond, 0.0)) + min(max(beyond.x, beyond.y), 0.0) - form.z;
  if (form.w > 0.0) distance_px = abs(distance_px + 0.5 * form.w) - 0.5 * form.w;
  float coverage = clamp(0.5 - distance_px, 0.0, 1.0);
  color = vec4(paint.rgb, 1.0) * paint.a * coverage;
}
)glsl";

// A text or an image; `place` is a texture coordinate. Not in one shader with the shapes, as a processor that
// draws does both for each pixel.
const char* const kCanvasImageFragmentShader = R"glsl(#version 330 core
in vec2 place;
flat in vec4 form;
flat in vec4 paint;
uniform sampler2D label;
out vec4 color;
void main() {
  color = texture(label, place) * paint.a;
}
)glsl";

}  // namespace docent::ui
